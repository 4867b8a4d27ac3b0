//! Rays towards small lamps.
//!
//! A lamp that covers the share f of what n rays of a pixel see is met by n f of them: with fewer than one or two, most
//! pixels miss it, and a few hold a speckle. So a pixel that sees such a lamp gets m more rays towards it, by a sketch
//! of the lens: a ray from the place x of the pixel (a square of side 1) through the point q of the pupil's disk meets
//! the lamp's plane about at
//!
//! ```text
//! Δ = a + X x + M q      from the middle of the lamp; a and M of the tile of the disk that q is in, of 17 × 17
//! ```
//! from traced rays. Of a lamp out of focus, a place x in the pixel and a place d in the unit disk give the q with
//! Δ = r d, which is searched for tile by tile; of one in focus, d and q give x. All rays of the pixel then have the
//! weight
//!
//! ```text
//! w = 1/(1 + Σ m/(n s)),      s = r²/|det M| or π r²/|det X|
//! ```
//! with a sum over the lamps with |Δ| ≤ r whose search ends in the tile of q. That is the balance heuristic (Veach &
//! Guibas, SIGGRAPH 1995): unbiased for any sketch, as all other rays see the lamp, too, and count in full.

use std::f64::consts::PI;

use glam::{DMat2, DVec2, DVec3};

use super::camera::Camera;
use super::pixel_aim::PixelAim;
use super::tracer::Tracer;
use crate::frames::camera_from_sensor_mm;
use crate::rays::RayBatch;
use crate::sampling::{concentric_disk, hash};
use crate::scene::world::Lamp;
use crate::simd::SimdLevel;
use crate::spectrum::ChannelWavelengths;

/// Lamps of a pixel and colour, at most.
const LAMPS: usize = 4;
/// Rays of a block per ray towards one lamp in one colour.
const RAYS_PER_LAMP_RAY: usize = 4;
/// A lamp with a larger share of the rays is met often enough.
const LARGEST_SHARE: f64 = 0.25;
/// Tiles on a side of the square around the pupil's disk.
const TILES: usize = 17;
/// Between the middles of tiles, of the disk's radius.
const STEP: f64 = 0.125;
/// Steps from tile to tile of a search.
const SEARCHES: usize = 4;
/// Added to a lamp's radius, widths of a pixel: for the width of a band.
const MARGIN: f64 = 0.05;
/// Added where the camera has diffraction at the lens's aperture, in λ N: some 60 % of Airy's light is within it.
const BLUR: f64 = 0.5;
/// A point beside the disk: the lens stops most rays through it.
const OUTSIDE: DVec2 = DVec2::new(2.0, 0.0);
/// Keeps the random numbers of these rays apart from others.
const KEY: u64 = 0x1A3D_5EED;

/// A ray's place in its pixel (0 to 1) and the point of the pupil's disk that it goes through.
pub(super) type PlaceAndPupil = (DVec2, DVec2);

/// A lamp as a pixel sees it in one colour.
#[derive(Clone, Debug)]
pub(super) struct LampSketch {
    /// X, per width of the pixel.
    place_mm: DMat2,
    /// X⁻¹, if the place is what is drawn.
    place_from_mm: Option<DMat2>,
    /// By the whole disk, to begin a search with.
    coarse: Tile,
    /// Row by row; `None` where the lens lets no light through.
    tiles: Vec<Option<Tile>>,
}

/// Δ = a + M q, M⁻¹ and r.
#[derive(Clone, Copy, Debug)]
struct Tile {
    radius_mm: f64,
    offset_mm: DVec2,
    pupil_mm: DMat2,
    pupil_from_mm: DMat2,
}

/// The lamps of which a pixel's rays meet few, by each of the lens's `tracers`: to each colour a lamp stands elsewhere.
pub(super) fn lamp_sketches<'a>(
    camera: &Camera,
    tracers: impl Iterator<Item = &'a Tracer>,
    aim: &PixelAim,
    lamps: &[Lamp],
) -> Vec<LampSketch> {
    let mut found = Vec::new();
    for tracer in tracers {
        let Some(few) = Probes::few(camera, tracer, aim) else {
            continue;
        };
        let mut seen = lamps.iter().filter(|lamp| few.is_near(lamp)).peekable();
        if seen.peek().is_some() {
            let probes = Probes::many(camera, tracer, aim);
            found.extend(
                seen.filter_map(|lamp| probes.sketch(&few, lamp))
                    .take(LAMPS),
            );
        }
    }
    found
}

/// Rays of a block of `n` towards each lamp in each colour.
pub(super) fn rays_per_sketch(n: usize) -> usize {
    n.div_ceil(RAYS_PER_LAMP_RAY)
}

/// The weight of a ray of a block of `n`; 0 of one outside of the pixel or the pupil.
pub(super) fn weight(sketches: &[LampSketch], n: usize, (place, q): PlaceAndPupil) -> f64 {
    if q.length_squared() > 1.0 || place.min_element() < 0.0 || place.max_element() > 1.0 {
        return 0.0;
    }
    let rays = rays_per_sketch(n) as f64 / n as f64;
    let density = |sketch: &LampSketch| sketch.share(place, q).map_or(0.0, |share| rays / share);
    1.0 / (1.0 + sketches.iter().map(density).sum::<f64>())
}

/// Key of the random numbers of a pixel's rays by its sketch `k`, in the block that begins with ray `first`.
pub(super) fn lamp_key(pixel: u64, k: usize, first: usize) -> u64 {
    hash(pixel, &[KEY, k as u64, first as u64])
}

impl LampSketch {
    /// The ray of four numbers in [0, 1); its place is outside of the pixel, or its point outside of the disk, where
    /// none in it is found.
    pub fn ray(&self, [x, y, s, t]: [f64; 4]) -> PlaceAndPupil {
        if let Some(place_from_mm) = self.place_from_mm {
            let d = DVec2::from(concentric_disk(x, y));
            let q = DVec2::from(concentric_disk(s, t));
            let place = |tile: &Tile| place_from_mm * (tile.radius_mm * d - tile.miss_mm(q));
            return match self.tile(q) {
                Some(tile) => (place(tile), q),
                None => (DVec2::ZERO, OUTSIDE),
            };
        }
        let place = DVec2::new(x, y);
        let found = self.search(place, DVec2::from(concentric_disk(s, t)));
        (place, found.map_or(OUTSIDE, |(q, _)| q))
    }

    /// The point of the disk through which a place on the lamp is seen, and its tile.
    fn search(&self, place: DVec2, on_lamp: DVec2) -> Option<(DVec2, usize)> {
        let shift_mm = self.place_mm * place;
        let mut q = self.coarse.point(on_lamp, shift_mm);
        for _ in 0..SEARCHES {
            let number = tile_at(q)?;
            let tile = self.tiles[number].as_ref()?;
            q = tile.point(on_lamp, shift_mm);
            if tile_at(q) == Some(number) {
                return Some((q, number));
            }
        }
        None
    }

    /// Of the rays that a search finds, those like this one over those of the whole disk: s; `None` of a ray that no
    /// search finds.
    fn share(&self, place: DVec2, q: DVec2) -> Option<f64> {
        let tile = self.tile(q)?;
        let on_lamp = (tile.miss_mm(q) + self.place_mm * place) / tile.radius_mm;
        if on_lamp.length_squared() > 1.0 {
            return None;
        }
        if self.place_from_mm.is_some() {
            return Some(tile.share_by_place(self.place_mm));
        }
        let end = self.search(place, on_lamp).map(|(_, number)| number);
        (end == tile_at(q)).then(|| tile.share())
    }

    fn tile(&self, q: DVec2) -> Option<&Tile> {
        self.tiles[tile_at(q)?].as_ref()
    }
}

/// The tile that holds a point of the disk.
fn tile_at(q: DVec2) -> Option<usize> {
    let cell = (q / STEP).round() + (TILES / 2) as f64;
    let is_inside = cell.min_element() >= 0.0 && cell.max_element() < TILES as f64;
    is_inside.then(|| cell.y as usize * TILES + cell.x as usize)
}

/// Traced rays of a pixel: first one from each of two places beside the pixel's middle, then those from its middle.
struct Probes {
    batch: RayBatch,
    /// Added to a lamp's radius, widths of a pixel.
    margin: f64,
}

impl Probes {
    /// Through the pupil's middle and four points about it, all of which must pass.
    fn few(camera: &Camera, tracer: &Tracer, aim: &PixelAim) -> Option<Self> {
        let points = [DVec2::ZERO, DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
        let probes = Self::new(camera, tracer, aim, points.into_iter().map(|p| 0.5 * p));
        let passed = probes.batch.status.iter().all(|status| *status == 0);
        passed.then_some(probes)
    }

    /// Through the middles of all tiles.
    fn many(camera: &Camera, tracer: &Tracer, aim: &PixelAim) -> Self {
        let middle = |i: usize| STEP * (i as f64 - (TILES / 2) as f64);
        let points = (0..TILES * TILES).map(|k| DVec2::new(middle(k % TILES), middle(k / TILES)));
        Self::new(camera, tracer, aim, points)
    }

    fn new(
        camera: &Camera,
        tracer: &Tracer,
        aim: &PixelAim,
        points: impl Iterator<Item = DVec2>,
    ) -> Self {
        let pupil = &aim.pupil;
        let mut batch = RayBatch::with_capacity(TILES * TILES + 2);
        let mut probe = |place: DVec2, q: DVec2| {
            let on_sensor = aim.position_mm + camera.sensor().pitch_mm() * place;
            let origin = camera_from_sensor_mm(on_sensor, camera.sensor_z_mm());
            let in_plane = pupil.axis_a_mm * q.x + pupil.axis_b_mm * q.y;
            let aimed = pupil.centre_mm + in_plane.extend(0.0);
            batch.push(origin, (aimed - origin).normalize());
        };
        probe(0.5 * DVec2::X, DVec2::ZERO);
        probe(0.5 * DVec2::Y, DVec2::ZERO);
        points.for_each(|q| probe(DVec2::ZERO, q));
        tracer.trace_backward(&mut batch, SimdLevel::detect());
        let f_number = 0.5 * (pupil.centre_mm.z - camera.sensor_z_mm()) / pupil.axis_a_mm.length();
        let wavelength_mm = camera.system(ChannelWavelengths::REFERENCE).wavelength_nm * 1e-6;
        let blur = BLUR * wavelength_mm * f_number.abs() / camera.sensor().pitch_mm();
        let margin = MARGIN + camera.lens_diffraction().map_or(0.0, |_| blur);
        Self { batch, margin }
    }

    /// Whether a pixel whose `few` probes these are may see the lamp.
    fn is_near(&self, lamp: &Lamp) -> bool {
        let (place_mm, coarse) = self.first_order(lamp);
        let width = |m: DMat2| m.x_axis.length() + m.y_axis.length();
        let middle = coarse.offset_mm + place_mm * DVec2::splat(0.5);
        // Half as much again as to first order: aberrations.
        let reach = 1.5 * (width(coarse.pupil_mm) + width(place_mm)) + lamp.radius_mm;
        middle.length() <= reach
    }

    /// X, and a and M of the whole disk, from the `few` probes.
    fn first_order(&self, lamp: &Lamp) -> (DMat2, Tile) {
        let at: [DVec2; 7] = std::array::from_fn(|i| self.on_plane(i, lamp.centre_mm));
        let place_mm = DMat2::from_cols(2.0 * (at[0] - at[2]), 2.0 * (at[1] - at[2]));
        let pupil_mm = DMat2::from_cols(at[3] - at[4], at[5] - at[6]);
        let offset_mm = at[2] - place_mm * DVec2::splat(0.5);
        (place_mm, Tile::new(offset_mm, pupil_mm, lamp.radius_mm))
    }

    /// By these, the `many`; `None` of a lamp that is met often enough.
    fn sketch(&self, few: &Self, lamp: &Lamp) -> Option<LampSketch> {
        let (place_mm, coarse) = few.first_order(lamp);
        let pixel = 0.5 * (place_mm.x_axis.length() + place_mm.y_axis.length());
        let at = |column: usize, row: usize| -> Option<DVec2> {
            let number = (column < TILES && row < TILES).then_some(row * TILES + column + 2)?;
            (self.batch.status[number] == 0).then(|| self.on_plane(number, lamp.centre_mm))
        };
        let tile = |k: usize| {
            let (column, row) = (k % TILES, k / TILES);
            let here = at(column, row)?;
            // Below the first column and row the number wraps round, to one that is none.
            let (left, up) = (
                at(column.wrapping_sub(1), row),
                at(column, row.wrapping_sub(1)),
            );
            let (across, bend_x) = slope(left, here, at(column + 1, row))?;
            let (along, bend_y) = slope(up, here, at(column, row + 1))?;
            let pupil_mm = DMat2::from_cols(across, along);
            let middle = STEP * (DVec2::new(column as f64, row as f64) - (TILES / 2) as f64);
            let offset_mm = here - pupil_mm * middle - place_mm * DVec2::splat(0.5);
            let radius_mm = lamp.radius_mm + self.margin * pixel + bend_x + bend_y;
            Some(Tile::new(offset_mm, pupil_mm, radius_mm))
        };
        let traced: Vec<Option<Tile>> = (0..TILES * TILES).map(tile).collect();
        // At the rim, of which the middle of a tile may be outside, its neighbour towards the middle.
        let inwards = |i: usize| i + usize::from(i < TILES / 2) - usize::from(i > TILES / 2);
        let neighbour = |k: usize| traced[inwards(k / TILES) * TILES + inwards(k % TILES)];
        let tiles = (0..TILES * TILES)
            .map(|k| traced[k].or(neighbour(k)))
            .collect();
        let by_place = coarse.share_by_place(place_mm);
        let sketch = LampSketch {
            place_mm,
            place_from_mm: (by_place < coarse.share()).then(|| place_mm.inverse()),
            coarse,
            tiles,
        };
        // Not a number compares as false.
        (coarse.share().min(by_place) <= LARGEST_SHARE).then_some(sketch)
    }

    /// Where a ray meets the plane z of `centre`, from there.
    fn on_plane(&self, number: usize, centre: DVec3) -> DVec2 {
        let ray = self.batch.ray(number);
        let along = (centre.z - ray.origin_mm.z) / ray.direction.z;
        (ray.origin_mm + along * ray.direction - centre).truncate()
    }
}

/// Slope over a tile, per radius of the disk, from the middles before and behind it, and by how much its edge is off
/// the straight line.
fn slope(before: Option<DVec2>, here: DVec2, behind: Option<DVec2>) -> Option<(DVec2, f64)> {
    match (before, behind) {
        (Some(before), Some(behind)) => {
            let bend = 0.125 * (before + behind - 2.0 * here).length();
            Some(((behind - before) / (2.0 * STEP), bend))
        }
        (Some(before), None) => Some(((here - before) / STEP, 0.0)),
        (None, Some(behind)) => Some(((behind - here) / STEP, 0.0)),
        (None, None) => None,
    }
}

impl Tile {
    fn new(offset_mm: DVec2, pupil_mm: DMat2, radius_mm: f64) -> Self {
        Self {
            radius_mm,
            offset_mm,
            pupil_mm,
            pupil_from_mm: pupil_mm.inverse(),
        }
    }

    /// q with Δ = r d of a ray whose place in the pixel shifts Δ.
    fn point(&self, d: DVec2, shift_mm: DVec2) -> DVec2 {
        self.pupil_from_mm * (self.radius_mm * d - shift_mm - self.offset_mm)
    }

    /// M q + a.
    fn miss_mm(&self, q: DVec2) -> DVec2 {
        self.offset_mm + self.pupil_mm * q
    }

    /// Of the pixel's area: what sees a ball of radius r through a point of the disk.
    fn share_by_place(&self, place_mm: DMat2) -> f64 {
        PI * self.radius_mm * self.radius_mm / place_mm.determinant().abs()
    }

    /// Of the disk's area: what sees a ball of radius r from a place.
    fn share(&self) -> f64 {
        self.radius_mm * self.radius_mm / self.pupil_mm.determinant().abs()
    }
}
