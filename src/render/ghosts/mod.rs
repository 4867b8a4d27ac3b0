//! Ghosts and veiling glare: light that two surfaces of the lens reflect on its way to the sensor.
//!
//! The light on sub-pixel `id` of a pixel of area A, over the lens's front disk (places p, in the plane of the first
//! rim), the direction cosines s across the axis and all pairs of surfaces (see [`crate::lens::Reflections`]):
//!
//! ```text
//! E_id = 1/A Σ_pairs ∫∫ L(p, s) W(p, s)/T P_id(u, v) [lands in the pixel] d²s dA      (d²s = cos θ dω)
//! ```
//!
//! Rays are followed from the scene to the sensor: ghosts of a small lamp cover many pixels, of which a ray from the
//! sensor would hardly ever find the lamp. T is what the lens lets through along the axis: pictures are in units of the
//! direct light, so that its loss is a gain common to all that shows nowhere.
//!
//! A ray is drawn by a table over bins (where the light comes from: a cell of directions, a lamp or a sun; the pair; a
//! cell of the front disk) in proportion to how bright it is there and how much of that a few rays bring to the window;
//! a part of all rays goes by brightness alone, so that nothing is without chance. Its weight is one over the density
//! of all ways to draw it (the balance heuristic; Veach & Guibas, SIGGRAPH 1995): the estimate has no bias. Rays are
//! numbered and added in the order of their numbers, so that threads do not show.
//!
//! Ghosts are far out of focus, and few rays make them: so the light of a ray is spread over a square of pixels
//! ([`spread`]; a variable kernel, B. W. Silverman, Density Estimation (1986), section 5.3). The more rays, the smaller
//! the squares.

mod front;
mod pilot;
mod sources;
mod splat;
mod spread;
mod table;

use rayon::prelude::*;

use super::{Camera, RenderSettings};
use crate::sampling::hash;
use crate::scene::Scene;
use front::FrontDisk;
use splat::{Landed, Splatter};
use spread::Spread;
use table::GhostTable;

/// Rays of the image per ray of its ghosts.
const SHARE: usize = 64;
/// Rays of an image's ghosts: at least, and at most.
const RAYS: [usize; 2] = [1 << 14, 1 << 22];
/// Rays of a batch.
const BATCH: usize = 1024;
/// Cells on a side of the square around the front disk.
const CELLS: usize = 4;
/// Blocks on a side of the window of an estimate.
const BLOCKS: usize = 8;
/// Keeps these random numbers apart from others.
const KEY: u64 = 0x6057_5EED;

/// Ghosts of an image, as the sub-pixels' mosaic has them; `None` where the camera simulates none.
pub(super) fn ghost_light(
    camera: &Camera,
    scene: &Scene,
    settings: &RenderSettings,
) -> Option<Vec<f64>> {
    let sensor = camera.sensor();
    let values = 3 * sensor.subpixels().count() * sensor.width() * sensor.height();
    let image_rays = sensor.width() * sensor.height() * settings.rays_per_pixel;
    let rays = (image_rays / SHARE).clamp(RAYS[0], RAYS[1]);
    let seed = hash(settings.seed, &[KEY]);
    let ghosts = Ghosts::new(camera, scene, CELLS, seed)?;
    let all = ghosts.follow(rays, seed);
    let spread = Spread::new(&all, sensor);
    let splatter = Splatter::new(camera, rays);
    let mut mosaic = vec![0.0; values];
    for landed in &all {
        splatter.add(landed, &spread.pixels(landed), &mut mosaic);
    }
    Some(mosaic)
}

/// How closely ghosts are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GhostLook {
    /// Enough to tell ghosts that are far below a tolerance: a quarter of the bins, and of the rays.
    Short,
    /// Enough to tell them from a tolerance.
    Long,
}

impl GhostLook {
    /// Cells on a side of the square around the front disk.
    fn cells(self) -> usize {
        match self {
            Self::Short => CELLS / 2,
            Self::Long => CELLS,
        }
    }

    /// Rays of each of the two sets.
    fn rays(self) -> usize {
        match self {
            Self::Short => 1 << 11,
            Self::Long => 1 << 13,
        }
    }
}

/// Ghosts in blocks of the window, twice.
#[derive(Clone, Debug)]
pub struct GhostBlocks {
    /// `[set][block and channel]`: mean of the sub-pixels, sr times the unit of radiance; errors of the two sets are
    /// independent.
    pub values: [Vec<f64>; 2],
}

/// A coarse look at the ghosts of an image, in blocks, by few rays: as many as `look` says. `None` where the camera
/// simulates none.
pub fn ghost_blocks(
    camera: &Camera,
    scene: &Scene,
    seed: u64,
    look: GhostLook,
) -> Option<GhostBlocks> {
    let sensor = camera.sensor();
    let (columns, rows) = (BLOCKS.min(sensor.width()), BLOCKS.min(sensor.height()));
    let ghosts = Ghosts::new(camera, scene, look.cells(), hash(seed, &[KEY]))?;
    let per_block = (sensor.width() * sensor.height()) as f64 / (columns * rows) as f64;
    let scale = 1.0 / (per_block * sensor.subpixels().count() as f64);
    let splatter = Splatter::new(camera, look.rays());
    let values = [1, 2].map(|set| {
        let mut blocks = vec![0.0; 3 * columns * rows];
        let seed = hash(seed, &[KEY, set]);
        for landed in &ghosts.follow(look.rays(), seed) {
            let column = landed.column * columns / sensor.width();
            let row = landed.row * rows / sensor.height();
            let block = 3 * (row * columns + column);
            splatter.for_each(landed, |channel, _, value| {
                blocks[block + channel] += scale * value;
            });
        }
        blocks
    });
    Some(GhostBlocks { values })
}

/// What all rays share.
struct Ghosts<'a> {
    camera: &'a Camera,
    scene: &'a Scene,
    front: FrontDisk,
    table: GhostTable,
}

impl<'a> Ghosts<'a> {
    /// `None` where nothing reflects, no light comes, or none of it comes near the window.
    fn new(camera: &'a Camera, scene: &'a Scene, cells: usize, seed: u64) -> Option<Self> {
        let reflections = camera.reflections()?;
        let front = FrontDisk::new(camera)?;
        let table = GhostTable::new(camera, reflections, scene, &front, cells, seed)?;
        Some(Self {
            camera,
            scene,
            front,
            table,
        })
    }

    /// Follows so many rays: those that land, in the order of their numbers.
    fn follow(&self, rays: usize, seed: u64) -> Vec<Landed> {
        let batches = (0..rays.div_ceil(BATCH)).into_par_iter();
        let landed = batches.flat_map_iter(|batch| {
            let numbers = batch * BATCH..rays.min((batch + 1) * BATCH);
            self.batch(numbers, rays, seed)
        });
        landed.collect()
    }
}
