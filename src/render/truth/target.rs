//! The all-in-focus target.
//!
//! The mean radiance over the rays of sight ([`SightRays`]) of 16 places in the pixel: a picture without the blur of
//! defocus and aberrations, of the same geometry (distortion included). By the centroid each of its channels stands
//! where that channel of the sum does, in a world all where green does. Where the camera has diffraction at the lens's
//! aperture, the target has it too: no camera sees more.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::{SightRays, WhiteField};
use crate::image::Image;
use crate::rays::RaySlices;
use crate::render::diffraction::{BlurField, PixelBlur};
use crate::render::{Camera, RenderSettings};
use crate::sampling::hash;
use crate::scene::world::PathKey;
use crate::scene::{Hits, Scene};
use crate::spectrum::ChannelWavelengths;

/// Places in the pixel at which the target is sampled.
const PLACES: usize = 16;
/// Keeps the target's random numbers apart from the image's.
const KEY: u64 = 0x7A26_E700;
/// Rows that are sampled together before they are blurred, and columns that are blurred alike.
const ROWS: usize = 64;
const COLUMNS: usize = 16;

impl SightRays {
    /// The target, W × H × 3, in the unit of the sum image: radiance × what a white wall would give there. NaN where
    /// there is no ray of sight. A world of meshes is given half as many paths per pixel as `settings` has rays, 16 at
    /// least: with them the target errs about as much as the sum image, or less
    /// (benches/runs/2026-11-28/lights.md).
    pub fn target(
        &self,
        camera: &Camera,
        scene: &Scene,
        white: &WhiteField,
        settings: &RenderSettings,
    ) -> Image {
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let mut target = Image::zeros(width, height, 3);
        let sampler = Sampler {
            sight: self,
            camera,
            scene,
            settings,
        };
        match sampler.blurs() {
            None => {
                (target.data_mut().par_chunks_mut(width * 3).enumerate()).for_each(|(row, out)| {
                    for (samples, out) in sampler.row(row).chunks_exact(PLACES).zip(out) {
                        *out = samples.iter().sum::<f32>() / PLACES as f32;
                    }
                })
            }
            Some(blurs) => sampler.blurred(&blurs, &mut target),
        }
        (target.data_mut().par_chunks_mut(width * 3).enumerate()).for_each(|(row, out)| {
            for (column, pixel) in out.chunks_exact_mut(3).enumerate() {
                let place = camera.sensor().position_mm(column as f64, row as f64);
                let white = white.sum_sr(place);
                pixel
                    .iter_mut()
                    .zip(white)
                    .for_each(|(p, w)| *p *= w as f32);
            }
        });
        target
    }
}

/// What all rows share.
struct Sampler<'a> {
    sight: &'a SightRays,
    camera: &'a Camera,
    scene: &'a Scene,
    settings: &'a RenderSettings,
}

impl Sampler<'_> {
    /// Radiance of a row: `[column][channel][place]`, NaN where there is no ray of sight.
    fn row(&self, row: usize) -> Vec<f32> {
        let width = self.camera.sensor().width();
        let n = width * PLACES;
        // Cards need no light to be followed.
        let paths = match self.scene.world() {
            Some(_) => self.settings.rays_per_pixel.div_ceil(2 * PLACES),
            None => 1,
        };
        let mut out = vec![0.0; 3 * n];
        let mut radiance = [0; 3].map(|_| vec![0.0; n]);
        for channels in self.channels_of_a_ray() {
            let rows = offsets().map(|[dx, dy]| (dx, row as f64 + dy));
            let channel = match channels.len() {
                1 => channels.start,
                _ => ChannelWavelengths::REFERENCE,
            };
            let batch = self.sight.rays_of_rows(self.camera, channel, rows);
            let mut hits = Hits::default();
            (self.scene).find_surfaces(RaySlices::from_batch(&batch), &mut hits);
            for path in 0..paths {
                let key = |ray| PathKey {
                    key: hash(self.settings.seed, &[KEY, row as u64, (ray % width) as u64]),
                    number: (path * PLACES + ray / width) as u32,
                    spread: self.camera.ray_spread(paths * PLACES),
                };
                let rays = RaySlices::from_batch(&batch);
                (self.scene).radiance(rays, &mut hits, channels.clone(), key, &mut radiance);
                for channel in channels.clone() {
                    let places = radiance[channel]
                        .chunks(width)
                        .zip(batch.status.chunks(width));
                    for (place, (radiance, status)) in places.enumerate() {
                        let columns = out.chunks_exact_mut(3 * PLACES);
                        for ((out, &l), &status) in columns.zip(radiance).zip(status) {
                            let lost = if status == 0 { 0.0 } else { f32::NAN };
                            out[channel * PLACES + place] += (l + lost) / paths as f32;
                        }
                    }
                }
            }
        }
        out
    }

    /// Channels that share a ray of sight. In a world each ray begins paths, whose noise would be one of colour if the
    /// channels had rays of their own, and which take long: there all channels have green's.
    fn channels_of_a_ray(&self) -> Vec<Range<usize>> {
        match self.sight.has_channels() && self.scene.world().is_none() {
            true => (0..3).map(|c| c..c + 1).collect(),
            false => std::iter::once(0..3).collect(),
        }
    }

    /// The diffraction of each channel, in the middle of its band, where the camera has any.
    fn blurs(&self) -> Option<[BlurField<'_>; 3]> {
        let field = self.camera.lens_diffraction()?;
        let pitch_mm = self.camera.sensor().pitch_mm();
        let offsets: Vec<[f64; 2]> = offsets().collect();
        Some([0, 1, 2].map(|channel| {
            let wavelength_mm = self.camera.system(channel).wavelength_nm * 1e-6;
            BlurField::new(field, wavelength_mm, pitch_mm, &offsets)
        }))
    }

    /// The target by rows that each blur into those around them.
    fn blurred(&self, blurs: &[BlurField<'_>; 3], target: &mut Image) {
        let (width, height) = (target.width(), target.height());
        let mut weights = vec![0f32; width * height * 3];
        let mut dark = vec![false; width * height * 3];
        for first in (0..height).step_by(ROWS) {
            let rows: Vec<Spread> = (first..(first + ROWS).min(height))
                .into_par_iter()
                .map(|row| self.spread(blurs, row))
                .collect();
            // In their order, so that the sums' rounding does not depend on the threads.
            for (row, spread) in (first..).zip(&rows) {
                spread.add_to(row, target.data_mut(), &mut weights);
                dark[row * width * 3..][..width * 3].copy_from_slice(&spread.dark);
            }
        }
        for ((value, weight), dark) in target.data_mut().iter_mut().zip(weights).zip(dark) {
            *value = if dark { f32::NAN } else { *value / weight };
        }
    }

    /// What a row gives to the rows that it reaches.
    fn spread(&self, blurs: &[BlurField<'_>; 3], row: usize) -> Spread {
        let width = self.camera.sensor().width();
        let samples = self.row(row);
        let mut spread = Spread::new(width);
        for start in (0..width).step_by(COLUMNS) {
            let end = (start + COLUMNS).min(width);
            let middle = (0.5 * (start + end - 1) as f64, row as f64);
            let place: DVec2 = self.camera.sensor().position_mm(middle.0, middle.1);
            for (channel, blur) in blurs.iter().enumerate() {
                let blur = blur.at(place);
                let samples_at = |at: usize| &samples[at * PLACES..][..PLACES];
                let ats = || (start..end).map(|column| column * 3 + channel);
                let are_finite = ats().all(|at| samples_at(at).iter().all(|s| s.is_finite()));
                if are_finite {
                    let first = spread.place(start, channel);
                    blur.spread_weights(end - start, spread.line, &mut spread.weight[first..]);
                }
                for (column, at) in (start..end).zip(ats()) {
                    let samples = samples_at(at);
                    spread.dark[at] = samples.iter().any(|s| s.is_nan());
                    spread.add(&blur, samples, (column, channel), !are_finite);
                }
            }
        }
        spread
    }
}

/// Light and weights from one row, for the rows from [`PixelBlur::reach`] above it to as many below, and as many
/// columns beside the picture: channels outermost.
struct Spread {
    width: usize,
    /// Values of a row, with the columns beside it.
    line: usize,
    light: Vec<f32>,
    weight: Vec<f32>,
    /// Pixels and channels of the row itself without a ray of sight.
    dark: Vec<bool>,
}

/// Rows that a row reaches, itself included.
const REACHED: usize = 2 * PixelBlur::reach() + 1;

impl Spread {
    fn new(width: usize) -> Self {
        let line = width + REACHED - 1;
        let len = REACHED * line * 3;
        Self {
            width,
            line,
            light: vec![0.0; len],
            weight: vec![0.0; len],
            dark: vec![false; width * 3],
        }
    }

    /// Where the pixels begin that a pixel of the row reaches.
    fn place(&self, column: usize, channel: usize) -> usize {
        channel * REACHED * self.line + column
    }

    /// What the samples of a pixel give; weights, too, or light alone.
    fn add(
        &mut self,
        blur: &PixelBlur,
        samples: &[f32],
        (column, channel): (usize, usize),
        has_weight: bool,
    ) {
        let first = self.place(column, channel);
        let weight = has_weight.then(|| &mut self.weight[first..]);
        blur.spread(samples, self.line, &mut self.light[first..], weight);
    }

    /// Adds what falls on rows of the picture; this is `row`'s.
    fn add_to(&self, row: usize, light: &mut [f32], weight: &mut [f32]) {
        let picture_line = self.width * 3;
        for k in 0..REACHED {
            let Some(to) = (row + k).checked_sub(PixelBlur::reach()) else {
                continue;
            };
            let Some(light) = light.get_mut(to * picture_line..(to + 1) * picture_line) else {
                continue;
            };
            let weight = &mut weight[to * picture_line..][..picture_line];
            for channel in 0..3 {
                let first = (channel * REACHED + k) * self.line + PixelBlur::reach();
                let from = [&self.light, &self.weight].map(|all| &all[first..][..self.width]);
                for (to, from) in [&mut *light, &mut *weight].into_iter().zip(from) {
                    let to = to.iter_mut().skip(channel).step_by(3);
                    to.zip(from).for_each(|(a, b)| *a += b);
                }
            }
        }
    }
}

/// The places from the middle of the pixel, px: a lattice that parts columns, rows and diagonals evenly, so that an
/// edge is found to a sixteenth of a pixel.
fn offsets() -> impl Iterator<Item = [f64; 2]> {
    let at = |k: usize| (k as f64 + 0.5) / PLACES as f64 - 0.5;
    (0..PLACES).map(move |k| [at(k), at(7 * k % PLACES)])
}
