//! Where the light of a source goes that enters by a cell of the front disk: a few rays of each pair of surfaces, which
//! tell where it is worth to draw more.

use glam::{DMat2, DVec2};

use super::front::{FrontDisk, inwards};
use super::sources::Source;
use super::table::place_at;
use crate::field::SensorWindowMm;
use crate::frames::sensor_from_camera;
use crate::lens::{GhostPairs, OpticalSystem, Reflections};
use crate::sampling::uniform;

/// Places of a cell that are tried for one that light goes through.
const TRIES: u64 = 3;
/// From there to places beside it, of the cell's side.
const STEP: f64 = 0.1;
/// Places on a side of a cell that are tried with a lamp or a sun.
const GRID: usize = 7;
/// The window is taken this much larger: the map is no straight one.
const SLACK: f64 = 1.25;

/// A part of a cell of the front disk, which goes from 0 to 1 along both sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceBox {
    pub least: DVec2,
    pub greatest: DVec2,
}

impl PlaceBox {
    pub const WHOLE: Self = Self {
        least: DVec2::ZERO,
        greatest: DVec2::ONE,
    };

    const NOWHERE: Self = Self {
        least: DVec2::ONE,
        greatest: DVec2::ZERO,
    };

    fn union(&self, other: &Self) -> Self {
        Self {
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
        }
    }

    pub fn size(&self) -> DVec2 {
        (self.greatest - self.least).max(DVec2::ZERO)
    }

    fn area(&self) -> f64 {
        self.size().element_product()
    }

    /// Of an even draw.
    pub fn density(&self, within: DVec2) -> f64 {
        let inside = within.cmpge(self.least).all() && within.cmplt(self.greatest).all();
        if inside { 1.0 / self.area() } else { 0.0 }
    }
}

/// Where rays of a pair land on the sensor, mm, and which part of their radiance is left.
type Landed = Option<(DVec2, f64)>;

/// Looks where the rays of a source go. Its looks are one for each pair: about how much of the radiance comes to the
/// window, and through which part of the cell.
pub(super) struct Pilot<'a> {
    pub system: &'a OpticalSystem,
    pub reflections: &'a Reflections,
    pub pairs: &'a GhostPairs,
    pub front: &'a FrontDisk,
    pub cells: usize,
    pub window: SensorWindowMm,
    pub seed: u64,
}

impl Pilot<'_> {
    /// Of the light that enters by a cell, by the first-order map from there and the source to the sensor. `number`:
    /// of the source and the cell.
    pub fn look(&self, source: &Source, place: usize, number: u64) -> Vec<(f64, PlaceBox)> {
        let mut looks = self.look_first_order(source, place, number);
        if matches!(source, Source::Cell(_)) {
            return looks;
        }
        let around = self.look_around(source, place);
        for ((first_order, aimed), (met, among)) in looks.iter_mut().zip(around) {
            match (*first_order > 0.0, met > 0.0) {
                (_, false) => {}
                (false, true) => (*first_order, *aimed) = (met, among),
                (true, true) => {
                    (*first_order, *aimed) = (met.max(*first_order), aimed.union(&among));
                }
            }
        }
        looks
    }

    /// Where light lands that comes from a place of a cell and a direction of the source, by pairs; only those that
    /// are `wanted`.
    fn land(
        &self,
        source: &Source,
        place: usize,
        (within, [a, b]): (DVec2, [f64; 2]),
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<Landed> {
        let place_mm = (self.front).place_mm(place_at(place, self.cells, within));
        let light = place_mm
            .and_then(|place_mm| Some(inwards(place_mm, source.direction(place_mm, a, b)?)));
        let Some(light) = light else {
            return vec![None; self.pairs.len()];
        };
        let landed = (self.reflections).trace_pairs(self.system, self.pairs, light, wanted);
        let at = |landed: crate::lens::Reflected| {
            let at = sensor_from_camera(landed.ray.origin_mm).truncate();
            (at, landed.share)
        };
        landed.into_iter().map(|landed| landed.map(at)).collect()
    }

    /// By rays through a grid of places of the cell.
    fn look_around(&self, source: &Source, place: usize) -> Vec<(f64, PlaceBox)> {
        let [middle, ..] = source.outline();
        let half = SLACK * DVec2::new(self.window.half_width, self.window.half_height);
        let mut looks = vec![(0.0, PlaceBox::NOWHERE); self.pairs.len()];
        let step = DVec2::splat(1.0 / GRID as f64);
        for k in 0..GRID * GRID {
            let within = step * (DVec2::new((k % GRID) as f64, (k / GRID) as f64) + 0.5);
            let landed = self.land(source, place, (within, middle), |_| true);
            for ((sum, part), landed) in looks.iter_mut().zip(landed) {
                let Some((at, share)) = landed else {
                    continue;
                };
                if (at - self.window.centre).abs().cmplt(half).all() {
                    *sum += share / (GRID * GRID) as f64;
                    let around = PlaceBox {
                        least: (within - step).max(DVec2::ZERO),
                        greatest: (within + step).min(DVec2::ONE),
                    };
                    *part = part.union(&around);
                }
            }
        }
        looks
    }

    fn look_first_order(&self, source: &Source, place: usize, number: u64) -> Vec<(f64, PlaceBox)> {
        let mut looks = vec![(0.0, PlaceBox::WHOLE); self.pairs.len()];
        let mut is_open = vec![true; self.pairs.len()];
        let [middle, edges @ ..] = source.outline();
        // From any place of the cell that light goes through.
        for k in 0..TRIES {
            let random = |d: u64| uniform(self.seed, &[number, k, d]);
            let within = match k {
                0 => DVec2::splat(0.5),
                _ => DVec2::new(random(0), random(1)),
            };
            let land = |step: DVec2, at: [f64; 2], wanted: &dyn Fn(usize) -> bool| {
                self.land(source, place, (within + step, at), wanted)
            };
            let here = land(DVec2::ZERO, middle, &|pair| is_open[pair]);
            if here.iter().all(Option::is_none) {
                continue;
            }
            let found = |pair: usize| here[pair].is_some();
            let slopes = [DVec2::X * STEP, DVec2::Y * STEP].map(|step| {
                let ahead = land(step, middle, &found);
                let lost = |pair: usize| found(pair) && ahead[pair].is_none();
                let behind = match (0..here.len()).any(lost) {
                    true => land(-step, middle, &lost),
                    false => vec![None; here.len()],
                };
                (ahead, behind)
            });
            let edges = edges.map(|edge| land(DVec2::ZERO, edge, &found));
            for (pair, here) in here.iter().enumerate() {
                let Some((at, share)) = *here else {
                    continue;
                };
                let slope = |(ahead, behind): &(Vec<Landed>, Vec<Landed>)| {
                    let ahead = ahead[pair].map(|(there, _)| (there - at) / STEP);
                    ahead.or(behind[pair].map(|(there, _)| (at - there) / STEP))
                };
                let around = Around {
                    within,
                    at,
                    slopes: slopes.each_ref().map(slope),
                    edges: edges
                        .each_ref()
                        .map(|edge| edge[pair].map(|(there, _)| there)),
                };
                let (seen, part) = self.first_order(&around);
                looks[pair] = (share * seen, part);
                is_open[pair] = false;
            }
        }
        looks
    }

    /// Which part of a cell's light comes to the window, and through which part of the cell.
    fn first_order(&self, around: &Around) -> (f64, PlaceBox) {
        let Around { within, at, .. } = *around;
        let half = DVec2::new(self.window.half_width, self.window.half_height);
        let spread = (around.edges).map(|edge| edge.map_or(half, |there| (there - at).abs()));
        let reach = SLACK * (half + spread[0] + spread[1]);
        let seen = (half / reach).element_product();
        let [Some(x), Some(y)] = around.slopes else {
            return (seen, PlaceBox::WHOLE);
        };
        let to_window = self.window.centre - at;
        let map = DMat2::from_cols(x, y);
        // All of the cell lands within the reach, or none does.
        let extent = x.abs() + y.abs();
        if extent.cmplt(0.25 * reach).all() {
            let near = to_window.abs().cmplt(reach + extent).all();
            return (if near { seen } else { 0.0 }, PlaceBox::WHOLE);
        }
        let back = map.inverse();
        let centre = within + back * to_window;
        let size = back.x_axis.abs() * reach.x + back.y_axis.abs() * reach.y;
        if !(centre.is_finite() && size.is_finite()) {
            return (seen, PlaceBox::WHOLE);
        }
        let part = PlaceBox {
            least: (centre - size).max(DVec2::ZERO),
            greatest: (centre + size).min(DVec2::ONE),
        };
        match part.area() {
            area if area > 0.0 => (seen * area, part),
            _ => (0.0, PlaceBox::WHOLE),
        }
    }
}

/// Light of a pair around a place of a cell.
struct Around {
    within: DVec2,
    /// Where it lands, mm.
    at: DVec2,
    /// By how much that changes over the cell's sides; `None` where light is lost to either side.
    slopes: [Option<DVec2>; 2],
    /// Where light from two places of the source's edge lands.
    edges: [Option<DVec2>; 2],
}
