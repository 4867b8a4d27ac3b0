//! How rays are drawn: by bins of source, pair and place on the front disk.

use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;

use super::super::Camera;
use super::front::{FrontDisk, inwards};
use super::sources::{Source, sources};
use crate::field::SensorWindowMm;
use crate::frames::sensor_from_camera;
use crate::lens::{GhostPair, OpticalSystem, Reflections};
use crate::sampling::{hash, uniform};
use crate::scene::Scene;
use crate::spectrum::ChannelWavelengths;

/// Part of the rays that go by brightness alone.
const BLIND: f64 = 0.2;
/// Places of a cell that are tried for one that light goes through.
const TRIES: u64 = 3;
/// From there to places beside it, of the cell's side.
const STEP: f64 = 0.1;
/// Places on a side of a cell that are tried with a lamp or a sun.
const GRID: usize = 7;
/// The window is taken this much larger: the map is no straight one.
const SLACK: f64 = 1.25;

/// See the module.
pub(super) struct GhostTable {
    pub pairs: Vec<GhostPair>,
    /// Cells on a side of the square around the front disk.
    cells: usize,
    sources: Vec<Source>,
    /// `[source][pair][place]`.
    bins: Vec<Bin>,
    /// Running sums of the bins' chances.
    sums: Vec<f64>,
}

/// How rays of a bin are drawn.
#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Part of all rays that go through `part` of the cell of the front disk.
    aimed: f64,
    part: PlaceBox,
    /// Part of all rays that go through any place of the cell.
    blind: f64,
}

/// A ray as it was drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub pair: usize,
    pub place_mm: DVec3,
    /// Away from the camera.
    pub direction: DVec3,
    /// One over its density, mm² (d²s has no unit).
    pub weight: f64,
}

impl GhostTable {
    /// With so many cells on a side of the square around the front disk; `None` where no light comes near the window.
    pub fn new(
        camera: &Camera,
        reflections: &Reflections,
        scene: &Scene,
        front: &FrontDisk,
        cells: usize,
        seed: u64,
    ) -> Option<Self> {
        let system = camera.system(ChannelWavelengths::REFERENCE);
        let pairs = reflections.pairs(system);
        let (sources, bright): (Vec<_>, Vec<_>) = sources(camera, scene, front, hash(seed, &[2]))
            .into_iter()
            .unzip();
        let bins = sources.len() * pairs.len() * cells * cells;
        let pilot = Pilot {
            system,
            reflections,
            front,
            cells,
            window: camera.sensor().window_mm(),
            seed: hash(seed, &[3]),
        };
        let bins = (0..bins).into_par_iter().map(|number| {
            let (source, pair, place) = split(number, pairs.len(), cells);
            let (found, part) = pilot.look(&sources[source], pairs[pair], place, number as u64);
            Bin {
                aimed: bright[source] * found,
                part,
                blind: bright[source] * reflections.pair_on_axis(system, pairs[pair]),
            }
        });
        let mut bins: Vec<Bin> = bins.collect();
        let aimed: f64 = bins.iter().map(|bin| bin.aimed).sum();
        let blind: f64 = bins.iter().map(|bin| bin.blind).sum();
        // Written so that NaN fails.
        if !(aimed > 0.0 && blind > 0.0) {
            return None;
        }
        let mut sum = 0.0;
        let sums = bins.iter_mut().map(|bin| {
            bin.aimed *= (1.0 - BLIND) / aimed;
            bin.blind *= BLIND / blind;
            sum += bin.aimed + bin.blind;
            sum
        });
        Some(Self {
            sums: sums.collect(),
            pairs,
            cells,
            sources,
            bins,
        })
    }

    /// Ray `number` of `rays`, each from its own part of the bins' sum; `None` where it would miss the disk.
    pub fn draw(&self, front: &FrontDisk, number: usize, rays: usize, seed: u64) -> Option<Drawn> {
        let random = |k: u64| uniform(seed, &[number as u64, k]);
        let all = self.sums.last().copied().unwrap_or(0.0);
        let along = all * (number as f64 + random(0)) / rays as f64;
        let chosen = self.sums.partition_point(|sum| *sum <= along);
        let chosen = chosen.min(self.sums.len() - 1);
        let (source, pair, place) = split(chosen, self.pairs.len(), self.cells);
        let bin = &self.bins[chosen];
        let part = match random(5) * (bin.aimed + bin.blind) < bin.aimed {
            true => bin.part,
            false => PlaceBox::WHOLE,
        };
        let within = part.least + DVec2::new(random(1), random(2)) * part.size();
        let place_mm = front.place_mm(place_at(place, self.cells, within))?;
        let direction = self.sources[source].direction(place_mm, random(3), random(4))?;
        let of_source = |(source, of): (usize, &Source)| {
            let row = source * self.pairs.len() + pair;
            let bin = &self.bins[row * self.cells * self.cells + place];
            let chance = bin.blind + bin.aimed * bin.part.density(within);
            chance * of.density(place_mm, direction)
        };
        let density: f64 = self.sources.iter().enumerate().map(of_source).sum();
        let side = front.side_mm() / self.cells as f64;
        Some(Drawn {
            pair,
            place_mm,
            direction,
            weight: all * side * side / density,
        })
    }
}

/// Source, pair and place of a bin.
fn split(bin: usize, pairs: usize, cells: usize) -> (usize, usize, usize) {
    let (row, place) = (bin / (cells * cells), bin % (cells * cells));
    (row / pairs, row % pairs, place)
}

/// −1 to 1 along each side of the square around the front disk, of a place `within` the cell, 0 to 1.
fn place_at(place: usize, cells: usize, within: DVec2) -> DVec2 {
    let cell = DVec2::new((place % cells) as f64, (place / cells) as f64);
    (cell + within) * (2.0 / cells as f64) - 1.0
}

/// A part of a cell of the front disk, which goes from 0 to 1 along both sides.
#[derive(Clone, Copy, Debug)]
struct PlaceBox {
    least: DVec2,
    greatest: DVec2,
}

impl PlaceBox {
    const WHOLE: Self = Self {
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

    fn size(&self) -> DVec2 {
        (self.greatest - self.least).max(DVec2::ZERO)
    }

    fn area(&self) -> f64 {
        self.size().element_product()
    }

    /// Of an even draw.
    fn density(&self, within: DVec2) -> f64 {
        let inside = within.cmpge(self.least).all() && within.cmplt(self.greatest).all();
        if inside { 1.0 / self.area() } else { 0.0 }
    }
}

/// Looks where the rays of a bin go.
struct Pilot<'a> {
    system: &'a OpticalSystem,
    reflections: &'a Reflections,
    front: &'a FrontDisk,
    cells: usize,
    window: SensorWindowMm,
    seed: u64,
}

impl Pilot<'_> {
    /// About how much of the radiance of a bin's rays comes to the window, and through which part of the cell: by the
    /// first-order map from the cell and the source to the sensor.
    fn look(&self, source: &Source, pair: GhostPair, place: usize, bin: u64) -> (f64, PlaceBox) {
        let (first_order, aimed) = self.look_first_order(source, pair, place, bin);
        if matches!(source, Source::Cell(_)) {
            return (first_order, aimed);
        }
        let (met, among) = self.look_around(source, pair, place);
        match (first_order > 0.0, met > 0.0) {
            (_, false) => (first_order, aimed),
            (false, true) => (met, among),
            (true, true) => (met.max(first_order), aimed.union(&among)),
        }
    }

    /// The same by rays through a grid of places of the cell: how much comes to the window, and through which part.
    fn look_around(&self, source: &Source, pair: GhostPair, place: usize) -> (f64, PlaceBox) {
        let [middle, ..] = source.outline();
        let half = SLACK * DVec2::new(self.window.half_width, self.window.half_height);
        let (mut sum, mut part) = (0.0, PlaceBox::NOWHERE);
        let step = DVec2::splat(1.0 / GRID as f64);
        for k in 0..GRID * GRID {
            let within = step * (DVec2::new((k % GRID) as f64, (k / GRID) as f64) + 0.5);
            let Some(place_mm) = self.front.place_mm(place_at(place, self.cells, within)) else {
                continue;
            };
            let Some(direction) = source.direction(place_mm, middle[0], middle[1]) else {
                continue;
            };
            let light = inwards(place_mm, direction);
            let Some(landed) = (self.reflections).trace_pair(self.system, pair, light) else {
                continue;
            };
            let at = sensor_from_camera(landed.ray.origin_mm).truncate();
            if (at - self.window.centre).abs().cmplt(half).all() {
                sum += landed.share;
                let around = PlaceBox {
                    least: (within - step).max(DVec2::ZERO),
                    greatest: (within + step).min(DVec2::ONE),
                };
                part = part.union(&around);
            }
        }
        (sum / (GRID * GRID) as f64, part)
    }

    fn look_first_order(
        &self,
        source: &Source,
        pair: GhostPair,
        place: usize,
        bin: u64,
    ) -> (f64, PlaceBox) {
        let nothing = (0.0, PlaceBox::WHOLE);
        let [middle, edges @ ..] = source.outline();
        let land = |within: DVec2, [a, b]: [f64; 2]| -> Option<(DVec2, f64)> {
            let place_mm = self.front.place_mm(place_at(place, self.cells, within))?;
            let light = inwards(place_mm, source.direction(place_mm, a, b)?);
            let landed = (self.reflections).trace_pair(self.system, pair, light)?;
            Some((
                sensor_from_camera(landed.ray.origin_mm).truncate(),
                landed.share,
            ))
        };
        // From any place of the cell that light goes through.
        let found = (0..TRIES).find_map(|k| {
            let random = |d: u64| uniform(self.seed, &[bin, k, d]);
            let within = match k {
                0 => DVec2::splat(0.5),
                _ => DVec2::new(random(0), random(1)),
            };
            land(within, middle).map(|(at, share)| (within, at, share))
        });
        let Some((within, at, share)) = found else {
            return nothing;
        };
        let slope = |step: DVec2| {
            let (ahead, behind) = (land(within + step, middle), land(within - step, middle));
            let ahead = ahead.map(|(there, _)| (there - at) / STEP);
            ahead.or(behind.map(|(there, _)| (at - there) / STEP))
        };
        let half = DVec2::new(self.window.half_width, self.window.half_height);
        let spread =
            edges.map(|edge| land(within, edge).map_or(half, |(there, _)| (there - at).abs()));
        let reach = SLACK * (half + spread[0] + spread[1]);
        let seen = (half / reach).element_product();
        let (Some(x), Some(y)) = (slope(DVec2::X * STEP), slope(DVec2::Y * STEP)) else {
            return (share * seen, PlaceBox::WHOLE);
        };
        let to_window = self.window.centre - at;
        let map = DMat2::from_cols(x, y);
        // All of the cell lands within the reach, or none does.
        let extent = x.abs() + y.abs();
        if extent.cmplt(0.25 * reach).all() {
            let near = to_window.abs().cmplt(reach + extent).all();
            return if near {
                (share * seen, PlaceBox::WHOLE)
            } else {
                nothing
            };
        }
        let back = map.inverse();
        let centre = within + back * to_window;
        let size = back.x_axis.abs() * reach.x + back.y_axis.abs() * reach.y;
        if !(centre.is_finite() && size.is_finite()) {
            return (share * seen, PlaceBox::WHOLE);
        }
        let part = PlaceBox {
            least: (centre - size).max(DVec2::ZERO),
            greatest: (centre + size).min(DVec2::ONE),
        };
        match part.area() {
            area if area > 0.0 => (share * seen * area, part),
            _ => nothing,
        }
    }
}
