//! Where light comes from: cells of directions, lamps and suns.

use glam::{DVec2, DVec3};

use super::super::Camera;
use super::front::{FrontDisk, outwards};
use crate::rays::{RayBatch, RaySlices};
use crate::sampling::{hash, uniform};
use crate::scene::world::{Lamp, PathKey};
use crate::scene::{Hits, Scene};

/// Cells on a side of the square of direction cosines.
const CELLS: usize = 6;
/// Rays that look how bright a source is.
const LOOKS: usize = 16;
/// Lamps and suns that have a row of their own, at most; these are looked at first.
const LAMPS: usize = 24;
const LAMPS_LOOKED_AT: usize = 64;
/// Of the mean brightness, at least: nothing is dark for certain.
const FLOOR: f64 = 0.02;

/// Where a ray's light comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// A square of direction cosines, side 2/CELLS, from this corner.
    Cell(DVec2),
    /// A ball.
    Lamp(Lamp),
    /// A cone of directions around this one with 1 − cos of half its angle.
    Sun(DVec3, f64),
}

impl Source {
    /// A direction in it from a place; `None` where it has none there.
    pub fn direction(&self, place_mm: DVec3, a: f64, b: f64) -> Option<DVec3> {
        let (axis, rise) = match *self {
            Self::Cell(corner) => {
                return outwards(corner + DVec2::new(a, b) * (2.0 / CELLS as f64));
            }
            _ => self.cone(place_mm)?,
        };
        let down = a * rise;
        let sin = (down * (2.0 - down)).max(0.0).sqrt();
        let (x, y) = axis.any_orthonormal_pair();
        let (s, c) = (b * std::f64::consts::TAU).sin_cos();
        let d = ((1.0 - down) * axis + sin * (c * x + s * y)).normalize();
        outwards(d.truncate()).filter(|_| d.z < 0.0)
    }

    /// Numbers with which [`Self::direction`] gives its middle and two places of its edge.
    pub fn outline(&self) -> [[f64; 2]; 3] {
        const END: f64 = 1.0 - 1e-9;
        match self {
            Self::Cell(_) => [[0.5, 0.5], [END, 0.5], [0.5, END]],
            _ => [[0.0, 0.0], [END, 0.0], [END, 0.25]],
        }
    }

    /// Density over d²s of [`Self::direction`].
    pub fn density(&self, place_mm: DVec3, direction: DVec3) -> f64 {
        if let Self::Cell(corner) = *self {
            let within = (direction.truncate() - corner) * (0.5 * CELLS as f64);
            let inside = within.min_element() >= 0.0 && within.max_element() < 1.0;
            return if inside {
                0.25 * (CELLS * CELLS) as f64
            } else {
                0.0
            };
        }
        match self.cone(place_mm) {
            // |a − b|² = 2 (1 − cos), exact for small angles; a hair more, for rounding.
            Some((axis, rise))
                if 0.5 * (direction - axis).length_squared() <= rise * (1.0 + 1e-9) =>
            {
                1.0 / (std::f64::consts::TAU * rise * direction.z.abs())
            }
            _ => 0.0,
        }
    }

    /// Whether any of its directions is one.
    fn is_before_the_lens(&self) -> bool {
        let Self::Cell(corner) = *self else {
            return true;
        };
        let end = corner + 2.0 / CELLS as f64;
        outwards(DVec2::ZERO.clamp(corner.min(end), end)).is_some()
    }

    /// Axis and 1 − cos of half the angle; `None` from within a lamp.
    fn cone(&self, place_mm: DVec3) -> Option<(DVec3, f64)> {
        match *self {
            Self::Cell(_) => None,
            Self::Sun(axis, rise) => Some((axis, rise)),
            Self::Lamp(lamp) => {
                let to = lamp.centre_mm - place_mm;
                let sin2 = lamp.radius_mm * lamp.radius_mm / to.length_squared();
                (sin2 > 0.0 && sin2 < 1.0)
                    .then(|| (to.normalize(), sin2 / (1.0 + (1.0 - sin2).sqrt())))
            }
        }
    }
}

/// The sources of a scene that any light comes from, and how much: radiance times d²s, of all channels together.
pub(super) fn sources(
    camera: &Camera,
    scene: &Scene,
    front: &FrontDisk,
    seed: u64,
) -> Vec<(Source, f64)> {
    let side = 2.0 / CELLS as f64;
    let corner = |k: usize| DVec2::new((k % CELLS) as f64, (k / CELLS) as f64) * side - 1.0;
    let cells = (0..CELLS * CELLS).map(|k| Source::Cell(corner(k)));
    let mut rows: Vec<Source> = cells.collect();
    if let Some((world, _)) = scene.world() {
        let suns = world
            .suns()
            .map(|(towards, rise)| Source::Sun(towards, rise));
        let lamps = world.lamps().iter().take(LAMPS_LOOKED_AT);
        rows.extend(
            suns.take(LAMPS)
                .chain(lamps.map(|lamp| Source::Lamp(*lamp))),
        );
    }
    let bright = brightness(camera, scene, front, &rows, seed);
    let mut found: Vec<(Source, f64)> = rows.into_iter().zip(bright).collect();
    let mut others = found.split_off(CELLS * CELLS);
    let mean = found.iter().map(|(_, b)| b).sum::<f64>() / found.len() as f64;
    found.retain(|(source, _)| source.is_before_the_lens());
    found.iter_mut().for_each(|(_, b)| *b += FLOOR * mean);
    others.retain(|(_, b)| *b > 0.0);
    others.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.extend(others.into_iter().take(LAMPS));
    found.retain(|(_, b)| *b > 0.0);
    found
}

/// ∫ L d²s of each source as the middle of the disk sees it.
fn brightness(
    camera: &Camera,
    scene: &Scene,
    front: &FrontDisk,
    rows: &[Source],
    seed: u64,
) -> Vec<f64> {
    let mut batch = RayBatch::with_capacity(rows.len() * LOOKS);
    let mut of = Vec::new();
    for (row, source) in rows.iter().enumerate() {
        for look in 0..LOOKS {
            let random = |k: u64| uniform(seed, &[row as u64, look as u64, k]);
            let a = (look as f64 + random(0)) / LOOKS as f64;
            let place_mm = front.centre_mm();
            if let Some(d) = source.direction(place_mm, a, random(1)) {
                batch.push(place_mm, d);
                of.push((row, 1.0 / (LOOKS as f64 * source.density(place_mm, d))));
            }
        }
    }
    let radiance = radiance(camera, scene, &mut batch, hash(seed, &[1]));
    let mut bright = vec![0.0; rows.len()];
    for (i, (row, weight)) in of.into_iter().enumerate() {
        bright[row] += weight * radiance.iter().map(|l| f64::from(l[i])).sum::<f64>();
    }
    bright
}

/// Of all channels along rays away from the camera.
pub(super) fn radiance(
    camera: &Camera,
    scene: &Scene,
    batch: &mut RayBatch,
    key: u64,
) -> [Vec<f32>; 3] {
    batch.status.clear();
    batch.status.resize(batch.len(), 0);
    let mut out: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; batch.len()]);
    let key = |number| PathKey {
        key,
        number: number as u32,
        spread: camera.ray_spread(1),
    };
    let (rays, mut hits) = (RaySlices::from_batch(batch), Hits::default());
    scene.intersect(rays, &mut hits);
    scene.radiance(rays, &mut hits, 0..3, key, &mut out);
    out
}
