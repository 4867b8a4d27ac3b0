//! What is converted, and the bank of its camera and depths.

use super::cell_kernels::CELL;
use super::error::RgbdError;
use super::levels::Levels;
use super::picture::DepthPicture;
use super::spread::Spread;
use crate::image::Image;
use crate::memory;
use crate::render::kernels::{BankPlan, Footprint, KernelBank};
use crate::render::truth::{DisparityField, SightRays};
use crate::render::{Camera, SubPixelImage};

/// Rays per field node and channel.
pub(super) const RAYS: usize = 4096;
/// Distance of field nodes, px, and their number along a side.
const NODE_PX: usize = 128;
const NODES: std::ops::RangeInclusive<usize> = 3..=9;
/// Part of a kernel's light that is cut off on each side.
const CUT: f64 = 2.5e-4;
/// Side of a tile, px.
const TILE: usize = 64;
/// Pixels that the target's diffraction reaches at most.
const LEAST_MARGIN: usize = 12;
/// Pixels that diffraction adds to a blur.
const DIFFRACTION_PX: usize = 8;

/// What is converted, and by what.
#[derive(Clone, Copy)]
pub struct Conversion<'a> {
    pub(super) camera: &'a Camera,
    pub(super) sight: &'a SightRays,
    pub(super) fields: &'a [DisparityField],
    pub(super) picture: &'a DepthPicture,
    pub(super) tile: usize,
}

/// A converted picture, or rows of it.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The mosaic, in sr times the unit of radiance.
    pub image: SubPixelImage,
    /// The all-in-focus target, in the unit of the sum of the sub-pixels: W × H × 3.
    pub target: Image,
    /// Part of the light of each pixel from other surfaces than the one that it stands for: W × H × 1.
    pub occlusion: Image,
    /// Part of the light of each pixel from places that are made up (see [`super::Relief`]): W × H × 1.
    pub made_up: Image,
    /// Rays through the lens.
    pub rays: u64,
}

impl<'a> Conversion<'a> {
    /// By a camera whose window has the picture's size. `sight`, `fields`: of the camera.
    pub fn new(
        camera: &'a Camera,
        sight: &'a SightRays,
        fields: &'a [DisparityField],
        picture: &'a DepthPicture,
    ) -> Self {
        Self {
            camera,
            sight,
            fields,
            picture,
            tile: TILE,
        }
    }

    /// With tiles of another side, px, which changes no bit.
    pub fn tile(self, tile: usize) -> Self {
        Self {
            tile: tile.max(1),
            ..self
        }
    }

    /// Converts.
    ///
    /// # Errors
    /// A window of another size, a blur larger than the picture, a dark window, too much memory.
    pub fn run(&self) -> Result<Converted, RgbdError> {
        let spread = self.spread()?;
        let height = self.camera.sensor().height();
        memory::check("a converted picture", spread.bytes(height))?;
        Ok(spread.rows(0..height))
    }

    /// What all rows share: kernels and surfaces.
    ///
    /// # Errors
    /// As of [`Self::run`].
    pub fn spread(&self) -> Result<Spread, RgbdError> {
        Spread::new(self)
    }

    /// The window's size, if it is the picture's.
    pub(super) fn check_window(&self) -> Result<(usize, usize), RgbdError> {
        let sensor = self.camera.sensor();
        let (width, height) = (sensor.width(), sensor.height());
        let light = self.picture.light();
        match (light.width(), light.height()) == (width, height) {
            true => Ok((width, height)),
            false => Err(RgbdError::Window {
                sensor: format!("{width} × {height}"),
                picture: format!("{} × {}", light.width(), light.height()),
            }),
        }
    }

    /// Pixels around the picture that its own may see (of [`Self::reach_px`]), or that the target's diffraction
    /// reaches: whole cells, so that those of the picture are the same whatever it is.
    pub(super) fn margin(&self, reach_px: usize) -> usize {
        let least = (reach_px + DIFFRACTION_PX).max(LEAST_MARGIN);
        least.next_multiple_of(CELL)
    }

    /// How far the nearest and the farthest depth are blurred, px, by few rays: a blur that is too large is found
    /// before it takes memory.
    pub(super) fn reach_px(&self, levels: &Levels) -> Result<usize, RgbdError> {
        let (width, height) = self.check_window()?;
        let depths = levels.inverse_depths_per_mm();
        let few = plan(vec![depths[0], depths[depths.len() - 1]], (2, 2), 64);
        let reach_px = KernelBank::reach_px(self.camera, self.sight, self.fields, &few)?;
        match 2 * reach_px >= width.min(height) {
            true => Err(RgbdError::Blur {
                nearest_m: 1e-3 / depths[0],
                reach_px,
                width,
                height,
            }),
            false => Ok(reach_px),
        }
    }

    pub(super) fn bank(&self, levels: &Levels) -> Result<KernelBank, RgbdError> {
        let (width, height) = self.check_window()?;
        let along = |px: usize| (px.div_ceil(NODE_PX) + 1).clamp(*NODES.start(), *NODES.end());
        let nodes = (along(width), along(height));
        let plan = plan(levels.inverse_depths_per_mm(), nodes, RAYS);
        Ok(KernelBank::new(
            self.camera,
            self.sight,
            self.fields,
            &plan,
        )?)
    }
}

fn plan(inverse_depths_per_mm: Vec<f64>, nodes: (usize, usize), rays: usize) -> BankPlan {
    BankPlan {
        nodes,
        inverse_depths_per_mm,
        rays,
        footprint: Footprint::Sample,
        cut_share: CUT,
    }
}
