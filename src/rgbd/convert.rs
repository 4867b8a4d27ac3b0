//! The whole picture: the bank of its camera and depths, tile by tile.

use rayon::prelude::*;

use super::apart;
use super::error::RgbdError;
use super::levels::Levels;
use super::picture::DepthPicture;
use super::relief::Relief;
use super::tile::{Scatter, Tile};
use crate::image::Image;
use crate::memory;
use crate::render::kernels::{BankPlan, Footprint, KernelBank};
use crate::render::truth::{DisparityField, SightRays, WhiteField};
use crate::render::{Camera, SubPixelImage};
use crate::sensor::Sensor;

/// Rays per field node and channel.
const RAYS: usize = 4096;
/// Distance of field nodes, px, and their number along a side.
const NODE_PX: usize = 128;
const NODES: std::ops::RangeInclusive<usize> = 3..=9;
/// Part of a kernel's light that is cut off on each side.
const CUT: f64 = 2.5e-4;
/// Side of a tile, px.
const TILE: usize = 64;
/// Pixels that the target's diffraction reaches at most.
const LEAST_MARGIN: usize = 12;
/// Lanes of R, G, B alone.
pub(super) const LANES_OF_ONE: usize = 4;

/// What is converted, and by what.
#[derive(Clone, Copy)]
pub struct Conversion<'a> {
    pub(super) camera: &'a Camera,
    pub(super) sight: &'a SightRays,
    pub(super) fields: &'a [DisparityField],
    pub(super) picture: &'a DepthPicture,
    pub(super) tile: usize,
}

/// A converted picture.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The mosaic, in sr times the unit of radiance.
    pub image: SubPixelImage,
    /// The all-in-focus target, in the unit of the sum of the sub-pixels: W × H × 3.
    pub target: Image,
    /// Part of the light of each pixel from other surfaces than the one that it stands for: W × H × 1.
    pub occlusion: Image,
    /// Part of the light of each pixel from places that are made up (see [`Relief`]): W × H × 1.
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
        let subpixels = self.camera.sensor().subpixels().count();
        match 3 * subpixels {
            0..=4 => self.run_in::<4>(),
            5..=8 => self.run_in::<8>(),
            9..=12 => self.run_in::<12>(),
            13..=28 => self.run_in::<28>(),
            29..=48 => self.run_in::<48>(),
            _ => Err(RgbdError::Subpixels { subpixels }),
        }
    }

    fn run_in<const L: usize>(&self) -> Result<Converted, RgbdError> {
        let sensor = self.camera.sensor();
        let (width, height) = self.check_window()?;
        let levels = Levels::new(self.camera, self.picture.inverse_range_per_mm())?;
        let bank = self.bank(&levels)?;
        let margin = self.margin(&bank);
        let per_pixel = 4 * (2 * 3 * sensor.subpixels().count() + 16) as u64;
        memory::check("a converted picture", per_pixel * (width * height) as u64)?;
        let relief = Relief::new(self.picture, &levels, margin);
        let scatter = Scatter::<L>::new(&bank, &relief, sensor, false);
        let white = WhiteField::from_fields(self.camera, self.fields);
        let shading = white.grid(sensor);
        let (m, n) = (sensor.subpixels().m(), sensor.subpixels().n());
        let mut converted = Converted {
            image: SubPixelImage {
                subpixels: sensor.subpixels(),
                mosaic: Image::zeros(width * m, height * n, 3),
            },
            target: apart::target(self.camera, &relief, self.tile).ok_or(RgbdError::Dark)?,
            occlusion: Image::zeros(width, height, 1),
            made_up: Image::zeros(width, height, 1),
            rays: (bank.size().0 * bank.size().1 * self.fields.len() * RAYS) as u64,
        };
        let mut here = vec![0.0; shading.components()];
        over_tiles(
            sensor,
            self.tile,
            &scatter,
            |x, y, light, [other, made_up]| {
                converted.occlusion.pixel_mut(x, y)[0] = other;
                converted.made_up.pixel_mut(x, y)[0] = made_up;
                shading.sample(sensor.position_mm(x as f64, y as f64), &mut here);
                let mut sum = [0.0; 3];
                for (lane, white) in here.iter().enumerate() {
                    let (c, s) = (lane / (m * n), lane % (m * n));
                    let to = converted
                        .image
                        .mosaic
                        .pixel_mut(x * m + s % m, y * n + s / m);
                    to[c] = light[lane] * *white as f32;
                    sum[c] += *white as f32;
                }
                let target = converted.target.pixel_mut(x, y);
                target.iter_mut().zip(sum).for_each(|(t, w)| *t *= w);
            },
        );
        Ok(converted)
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

    /// Pixels around the picture that its own may see, or that the target's diffraction reaches.
    pub(super) fn margin(&self, bank: &KernelBank) -> usize {
        let reach = bank.support().map_or(0, |s| s.reach());
        (reach + 1).max(LEAST_MARGIN)
    }

    fn trace_bank(&self, plan: &BankPlan) -> Result<KernelBank, RgbdError> {
        KernelBank::new(self.camera, self.sight, self.fields, plan).ok_or(RgbdError::Dark)
    }

    /// The kernels of the nearest and the farthest depth by few rays: a blur that is too large is found before it takes
    /// memory.
    pub(super) fn bank_of_ends(&self, levels: &Levels) -> Result<KernelBank, RgbdError> {
        let (width, height) = self.check_window()?;
        let depths = levels.inverse_depths_per_mm();
        let ends = vec![depths[0], depths[depths.len() - 1]];
        let few = self.trace_bank(&plan(ends, (2, 2), 64))?;
        let reach = few.support().map_or(0, |s| s.reach());
        match 2 * reach >= width.min(height) {
            true => Err(RgbdError::Blur {
                nearest_m: 1e-3 / depths[0],
                reach_px: reach,
                width,
                height,
            }),
            false => Ok(few),
        }
    }

    fn bank(&self, levels: &Levels) -> Result<KernelBank, RgbdError> {
        let (width, height) = self.check_window()?;
        let along = |px: usize| (px.div_ceil(NODE_PX) + 1).clamp(*NODES.start(), *NODES.end());
        let few = self.bank_of_ends(levels)?;
        let reach = few.support().map_or(0, |s| s.reach());
        let depths = levels.inverse_depths_per_mm();
        let nodes = (along(width), along(height));
        let pixels: u64 = (depths.len() * (2 * reach + 1).pow(2)) as u64;
        let values = pixels * (nodes.0 * nodes.1 * few.lanes()) as u64;
        memory::check("kernels of all depths", 4 * values / 2)?;
        self.trace_bank(&plan(depths, nodes, RAYS))
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

/// Calls `give(x, y, light, [other, made-up])` for every pixel, a row of tiles after the other.
pub(super) fn over_tiles<const L: usize>(
    sensor: &Sensor,
    side: usize,
    scatter: &Scatter<'_, L>,
    mut give: impl FnMut(usize, usize, &[f32; L], [f32; 2]),
) {
    let (width, height) = (sensor.width(), sensor.height());
    for y in (0..height).step_by(side) {
        let tile = |x: usize| Tile {
            x,
            y,
            width: side.min(width - x),
            height: side.min(height - y),
        };
        let tiles: Vec<Tile> = (0..width).step_by(side).map(tile).collect();
        let done: Vec<_> = tiles.par_iter().map(|t| scatter.tile(*t)).collect();
        for (tile, sums) in tiles.iter().zip(&done) {
            for (i, light) in sums.light.iter().enumerate() {
                let (x, y) = (tile.x + i % tile.width, tile.y + i / tile.width);
                give(x, y, light, [sums.other[i], sums.made_up[i]]);
            }
        }
    }
}
