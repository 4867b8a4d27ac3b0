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
        let margin = conversion.margin(reach_px).max(least);
        let white = WhiteField::from_fields(camera, conversion.fields);
        Ok(Self {
            relief: Relief::new(conversion.picture, &levels, margin),
            aperture: apart::aperture(camera, margin).ok_or(RgbdError::Dark)?,
            shading: white.grid(sensor),
            sensor: sensor.clone(),
            tile: conversion.tile,
            parts: match camera.is_diffracted() {
                true => Parts::of_bank(&bank),
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
            &self.aperture,
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
        let mut here = vec![0.0; self.shading.components()];
        over_tiles(
            &scatter,
            (width, rows),
            self.tile,
            |x, y, light, [other, made_up]| {
                converted.occlusion.pixel_mut(x, y)[0] = other;
                converted.made_up.pixel_mut(x, y)[0] = made_up;
                let place = sensor.position_mm(x as f64, y as f64);
                self.shading.sample(place, &mut here);
                let mut sum = [0.0; 3];
                for (lane, white) in here.iter().enumerate() {
                    let (c, s) = (lane / (m * n), lane % (m * n));
                    let to = (converted.image.mosaic).pixel_mut(x * m + s % m, y * n + s / m);
                    to[c] = light[lane] * *white as f32;
                    sum[c] += *white as f32;
                }
                let target = converted.target.pixel_mut(x, y);
                target.iter_mut().zip(sum).for_each(|(t, w)| *t *= w);
            },
        );
        converted
    }
}

/// Calls `give(x, y, light, [other, made-up])` for every pixel of some rows, counted from the first of them, a row of
/// tiles after the other.
pub(super) fn over_tiles<const L: usize>(
    scatter: &Scatter<'_, L>,
    (width, rows): (usize, Range<usize>),
    side: usize,
    mut give: impl FnMut(usize, usize, &[f32; L], [f32; 2]),
) {
    for y in rows.clone().step_by(side) {
        let tile = |x: usize| Tile {
            x,
            y,
            width: side.min(width - x),
            height: side.min(rows.end - y),
        };
        let tiles: Vec<Tile> = (0..width).step_by(side).map(tile).collect();
        let done: Vec<_> = tiles.par_iter().map(|t| scatter.tile(*t)).collect();
        for (tile, sums) in tiles.iter().zip(&done) {
            for (i, light) in sums.light.iter().enumerate() {
                let (x, y) = (tile.x + i % tile.width, y - rows.start + i / tile.width);
                give(x, y, light, [sums.other[i], sums.made_up[i]]);
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
