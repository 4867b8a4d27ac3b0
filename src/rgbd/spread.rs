//! The picture spread into the sub-pixels: kernels and surfaces, of any rows, tile by tile.

use std::ops::Range;

use rayon::prelude::*;

use super::apart;
use super::convert::{Conversion, Converted, RAYS};
use super::error::RgbdError;
use super::halo::Parts;
use super::levels::Levels;
use super::relief::Relief;
use super::tile::{Scatter, Tile};
use crate::field::FieldGrid;
use crate::image::Image;
use crate::memory;
use crate::render::SubPixelImage;
use crate::render::kernels::KernelBank;
use crate::render::truth::WhiteField;
use crate::sensor::Sensor;

/// Values per pixel, at most: three colours of 4 × 4 sub-pixels.
const MOST_LANES: usize = 48;

/// What the rows of a conversion share.
#[derive(Clone, Debug)]
pub struct Spread {
    sensor: Sensor,
    bank: KernelBank,
    parts: Vec<Parts>,
    /// Diffraction at the lens's aperture, for the target.
    aperture: KernelBank,
    aperture_parts: Vec<Parts>,
    relief: Relief,
    /// What a white wall gives each channel and sub-pixel.
    shading: FieldGrid,
    tile: usize,
    rays: u64,
}

impl Spread {
    pub(super) fn new(conversion: &Conversion<'_>) -> Result<Self, RgbdError> {
        let camera = conversion.camera;
        let sensor = camera.sensor();
        conversion.check_window()?;
        let subpixels = sensor.subpixels().count();
        if 3 * subpixels > MOST_LANES {
            return Err(RgbdError::Subpixels { subpixels });
        }
        let levels = Levels::new(camera, conversion.picture.inverse_range_per_mm())?;
        let reach_px = conversion.reach_px(&levels)?;
        let bank = conversion.bank(&levels)?;
        // Few rays bound a blur nearly.
        let least = bank.support().map_or(0, |s| s.reach() + 1);
        let margin = conversion.margin(reach_px.max(least));
        let white = WhiteField::from_fields(camera, conversion.fields);
        let aperture = apart::aperture(camera, margin).ok_or(RgbdError::Dark)?;
        Ok(Self {
            relief: Relief::new(conversion.picture, &levels, margin),
            aperture_parts: Parts::of_bank(&aperture),
            aperture,
            shading: white.grid(sensor),
            sensor: sensor.clone(),
            tile: conversion.tile,
            parts: match camera.is_diffracted() {
                true => {
                    memory::check("halos of kernels", Parts::bytes(&bank))?;
                    Parts::of_bank(&bank)
                }
                false => Parts::whole(&bank),
            },
            rays: (bank.size().0 * bank.size().1 * conversion.fields.len() * RAYS) as u64,
            bank,
        })
    }

    /// Rays through the lens that its kernels took.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Memory of as many converted rows, bytes.
    pub fn bytes(&self, rows: usize) -> u64 {
        let per_pixel = 4 * (2 * 3 * self.sensor.subpixels().count() + 16) as u64;
        per_pixel * (self.sensor.width() * rows) as u64
    }

    /// Some rows of the picture, the same whatever rows they are asked for with.
    ///
    /// # Panics
    /// Rows that the picture does not have, or none.
    pub fn rows(&self, rows: Range<usize>) -> Converted {
        match 3 * self.sensor.subpixels().count() {
            0..=4 => self.rows_in::<4>(rows),
            5..=8 => self.rows_in::<8>(rows),
            9..=12 => self.rows_in::<12>(rows),
            13..=28 => self.rows_in::<28>(rows),
            _ => self.rows_in::<MOST_LANES>(rows),
        }
    }

    fn target(&self, rows: Range<usize>) -> Image {
        apart::target(
            (&self.aperture, &self.aperture_parts),
            &self.relief,
            (&self.sensor, rows),
            self.tile,
        )
    }

    fn rows_in<const L: usize>(&self, rows: Range<usize>) -> Converted {
        let sensor = &self.sensor.rows(rows.clone());
        let scatter =
            Scatter::<L>::new((&self.bank, &self.parts), &self.relief, &self.sensor, false);
        let (width, height) = (sensor.width(), sensor.height());
        let (m, n) = (sensor.subpixels().m(), sensor.subpixels().n());
        let mut converted = Converted {
            image: SubPixelImage {
                subpixels: sensor.subpixels(),
                mosaic: Image::zeros(width * m, height * n, 3),
            },
            target: self.target(rows.clone()),
            occlusion: Image::zeros(width, height, 1),
            made_up: Image::zeros(width, height, 1),
            rays: self.rays,
        };
        let tile = |tile: Tile| {
            let mut sums = scatter.tile(tile);
            let white = self.shade(tile, &mut sums.light);
            (sums, white)
        };
        // Where each value of a pixel lies in the mosaic, from its first one.
        let line = 3 * width * m;
        let beside = |lane: usize| {
            let (c, s) = (lane / (m * n), lane % (m * n));
            s / m * line + 3 * (s % m) + c
        };
        let beside: Vec<usize> = (0..3 * m * n).map(beside).collect();
        over_tiles((width, rows), self.tile, tile, |x, y, i, (sums, white)| {
            converted.occlusion.pixel_mut(x, y)[0] = sums.other[i];
            converted.made_up.pixel_mut(x, y)[0] = sums.made_up[i];
            let mosaic = &mut converted.image.mosaic.data_mut()[y * n * line + 3 * x * m..];
            for (beside, light) in beside.iter().zip(&sums.light[i]) {
                mosaic[*beside] = *light;
            }
            let target = converted.target.pixel_mut(x, y);
            target.iter_mut().zip(white[i]).for_each(|(t, w)| *t *= w);
        });
        converted
    }

    /// Brings the radiance of a tile's pixels to what their sub-pixels get of it, and gives what the sum gets of a
    /// white wall, per colour.
    fn shade<const L: usize>(&self, tile: Tile, light: &mut [[f32; L]]) -> Vec<[f32; 3]> {
        let subpixels = self.sensor.subpixels().count();
        let mut here = vec![0.0; self.shading.components()];
        let mut all = Vec::with_capacity(light.len());
        for (row, light) in light.chunks_exact_mut(tile.width).enumerate() {
            let place = |x: usize| self.sensor.position_mm(x as f64, (tile.y + row) as f64);
            let along = self.shading.row(place(0).y, 0, here.len());
            for (column, light) in light.iter_mut().enumerate() {
                along.sample(place(tile.x + column).x, &mut here);
                let mut sum = [0.0; 3];
                for (lane, white) in here.iter().enumerate() {
                    light[lane] *= *white as f32;
                    sum[lane / subpixels] += *white as f32;
                }
                all.push(sum);
            }
        }
        all
    }
}

/// Calls `give(x, y, i, tile)` for every pixel of some rows, counted from the first of them, a row of tiles after the
/// other; i: the pixel's number in its tile.
pub(super) fn over_tiles<T: Send>(
    (width, rows): (usize, Range<usize>),
    side: usize,
    make: impl Fn(Tile) -> T + Sync,
    mut give: impl FnMut(usize, usize, usize, &T),
) {
    for y in rows.clone().step_by(side) {
        let tile = |x: usize| Tile {
            x,
            y,
            width: side.min(width - x),
            height: side.min(rows.end - y),
        };
        let tiles: Vec<Tile> = (0..width).step_by(side).map(tile).collect();
        let done: Vec<T> = tiles.par_iter().map(|t| make(*t)).collect();
        for (tile, done) in tiles.iter().zip(&done) {
            for i in 0..tile.width * tile.height {
                let (x, y) = (tile.x + i % tile.width, y - rows.start + i / tile.width);
                give(x, y, i, done);
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::lens::{FocusBy, Lens, Prescription};
    use crate::render::Camera;
    use crate::render::truth::{DisparityField, SightRays};
    use crate::response::{GeometricResponse, Response};
    use crate::rgbd::DepthPicture;
    use crate::sensor::{ShiftRule, Subpixels};
    use crate::spectrum::ChannelWavelengths;

    /// A picture of black and white noise, the worst there is for blocks, on two cards.
    fn noise(side: usize) -> DepthPicture {
        let value = |i: usize| (crate::sampling::hash(3, &[i as u64]) % 2) as f32;
        let light = (0..3 * side * side).map(value).collect();
        let depth = |i: usize| if i % side < side / 2 { 500.0 } else { 1500.0 };
        let depth = (0..side * side).map(depth).collect();
        let light = Image::from_vec(side, side, 3, light).unwrap();
        DepthPicture::new(light, Image::from_vec(side, side, 1, depth).unwrap()).unwrap()
    }

    #[test]
    fn halos_by_blocks_are_those_of_whole_kernels() {
        let lens = Prescription::builtin("wide_US20120327520A1_emb3").unwrap();
        let lens = (Lens::new(&lens).unwrap())
            .focused_at(700.0, FocusBy::Sensor, 550.0)
            .unwrap();
        let pixel = GeometricResponse::new(Subpixels::new(2, 2).unwrap(), 2.8, 4.0).unwrap();
        let side = 64;
        let sensor = Sensor::new(2.8, pixel.subpixels(), (side, side), DVec2::ZERO);
        let bands = ChannelWavelengths::default();
        let response = Response::Geometric(pixel);
        let camera = Camera::new(
            &lens,
            sensor.unwrap(),
            ShiftRule::ChiefRay,
            &response,
            bands,
        );
        let camera = camera.unwrap().with_lens_diffraction();
        let fields = DisparityField::of_channels(&camera).unwrap();
        let sight = SightRays::centroids(&fields);
        let picture = noise(side);
        let spread = Conversion::new(&camera, &sight, &fields, &picture)
            .spread()
            .unwrap();
        assert!(spread.parts.iter().all(|p| p.halo.is_some()));
        let whole = Spread {
            parts: Parts::whole(&spread.bank),
            ..spread.clone()
        };
        let [a, b] = [spread, whole].map(|s| s.rows(0..side).image.mosaic);
        let mean = |f: &dyn Fn(usize) -> f64| {
            (0..a.data().len()).map(f).sum::<f64>() / a.data().len() as f64
        };
        let light = mean(&|i| f64::from(b.data()[i]));
        let differ = |i: usize| f64::from(a.data()[i] - b.data()[i]) / light;
        let (rms, off) = (mean(&|i| differ(i).powi(2)).sqrt(), mean(&differ));
        println!("halos by blocks: RMS {rms:.5}, mean {off:.6}");
        // The texture's contrast is 1; kernels of 4096 rays err by 0.004.
        assert!(rms < 0.004 && off.abs() < 1e-4, "{rms} {off}");
    }
}
