//! The diffraction pattern as weights between pixels: what blurs a picture that was sampled at a few places per pixel.
//!
//! A sample at the offset o from the middle of its pixel gives the pixel Δ further the part of its light that the
//! pattern displaces there: `w(o, Δ) = P(round(o + d) = Δ)`. Near its own pixel each offset has weights of its own,
//! further out all have their mean. Light beyond [`REACH`] is left out, and the blur is normalised.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::LensDiffraction;
use crate::sampling::SobolSet;
use crate::simd::SimdLevel;

/// Pixels to each side with weights per offset.
const NEAR: i32 = 2;
/// Pixels to each side that are blurred into.
const REACH: i32 = 8;
/// Displacements that the weights are counted from.
const SAMPLES: usize = 4096;

const NEAR_SIDE: usize = 2 * NEAR as usize + 1;
const SIDE: usize = 2 * REACH as usize + 1;
/// Rows and columns of `SIDE` that are near.
const NEAR_PLACES: Range<usize> = (REACH - NEAR) as usize..(REACH + NEAR + 1) as usize;
/// Number of what is not within reach.
const BEYOND: usize = SIDE * SIDE;

/// Weights of one channel at one place.
#[derive(Clone, Debug)]
pub(in crate::render) struct PixelBlur {
    /// `[offset][row][column]`.
    near: Vec<f32>,
    /// `[row][column]`, 0 where `near` serves.
    far: Vec<f32>,
}

/// Weights at the nodes of the window.
#[derive(Clone, Debug)]
pub(in crate::render) struct BlurField<'a> {
    field: &'a LensDiffraction,
    /// `[node]`.
    nodes: Vec<PixelBlur>,
    offsets: usize,
}

impl<'a> BlurField<'a> {
    /// For samples at `offsets_px` (column, row) in pixels of `pitch_mm` at a wavelength in mm.
    pub fn new(
        field: &'a LensDiffraction,
        wavelength_mm: f64,
        pitch_mm: f64,
        offsets_px: &[[f64; 2]],
    ) -> Self {
        let set = SobolSet::new(SAMPLES);
        let (mut s, mut t) = (vec![0.0; SAMPLES], vec![0.0; SAMPLES]);
        set.fill(0, 0, 0, &mut s);
        set.fill(1, 0, 0, &mut t);
        // Columns grow with x of the sensor frame, against that of the camera frame.
        let to_px = wavelength_mm / pitch_mm / std::f64::consts::TAU * DVec2::new(-1.0, 1.0);
        let nodes = (0..field.nodes.data().len()).into_par_iter().map(|node| {
            let (_, to_disk) = field.ellipse(field.nodes.place_mm(node));
            let scale = to_disk.transpose();
            let displacement =
                |(&s, &t)| to_px * (scale * field.kernel(node).displacement_at(s, t));
            let displacements: Vec<DVec2> = s.iter().zip(&t).map(displacement).collect();
            PixelBlur::new(&displacements, offsets_px)
        });
        Self {
            field,
            nodes: nodes.collect(),
            offsets: offsets_px.len(),
        }
    }

    /// The weights at a place (sensor frame, mm).
    pub fn at(&self, place_mm: DVec2) -> PixelBlur {
        let mut blur = PixelBlur {
            near: vec![0.0; self.offsets * NEAR_SIDE * NEAR_SIDE],
            far: vec![0.0; SIDE * SIDE],
        };
        for (node, weight) in self.field.nodes.around(place_mm) {
            let add = |to: &mut [f32], from: &[f32]| {
                to.iter_mut()
                    .zip(from)
                    .for_each(|(t, f)| *t += weight as f32 * f);
            };
            add(&mut blur.near, &self.nodes[node].near);
            add(&mut blur.far, &self.nodes[node].far);
        }
        blur
    }
}

impl PixelBlur {
    fn new(displacements_px: &[DVec2], offsets_px: &[[f64; 2]]) -> Self {
        let mut near = Vec::with_capacity(offsets_px.len() * NEAR_SIDE * NEAR_SIDE);
        let mut all = [0u32; BEYOND + 1];
        let one = 1.0 / displacements_px.len() as f32;
        for &offset in offsets_px {
            let counts = counts(displacements_px, DVec2::from(offset));
            let rows = counts[..BEYOND].chunks_exact(SIDE);
            for row in rows.skip(NEAR_PLACES.start).take(NEAR_SIDE) {
                near.extend(row[NEAR_PLACES].iter().map(|count| *count as f32 * one));
            }
            (all.iter_mut().zip(&counts)).for_each(|(all, count)| *all += count);
        }
        let mut far: Vec<f32> = all[..BEYOND]
            .iter()
            .map(|count| *count as f32 * (one / offsets_px.len() as f32))
            .collect();
        let rows = far.chunks_exact_mut(SIDE);
        for row in rows.skip(NEAR_PLACES.start).take(NEAR_SIDE) {
            row[NEAR_PLACES].fill(0.0);
        }
        Self { near, far }
    }

    /// Adds what a pixel's samples give the pixels around it, to `light` with their values and to `weight`, if it is
    /// given, without. `samples`: one per offset; those that are not finite count for nothing. Both begin
    /// [`Self::reach`] rows above and columns beside the pixel, and hold rows of `line` values.
    pub fn spread(
        &self,
        samples: &[f32],
        line: usize,
        light: &mut [f32],
        weight: Option<&mut [f32]>,
    ) {
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe {
                self.spread_avx2(samples, line, light, weight);
            },
            _ => self.spread_by(samples, line, light, weight),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn spread_avx2(
        &self,
        samples: &[f32],
        line: usize,
        light: &mut [f32],
        weight: Option<&mut [f32]>,
    ) {
        self.spread_by(samples, line, light, weight);
    }

    /// The same bits at every level.
    #[inline(always)]
    fn spread_by(
        &self,
        samples: &[f32],
        line: usize,
        light: &mut [f32],
        weight: Option<&mut [f32]>,
    ) {
        let values = |sample: &f32| if sample.is_finite() { *sample } else { 0.0 };
        self.spread_values(samples.iter().map(values), line, light);
        if let Some(weight) = weight {
            let ones = |sample: &f32| if sample.is_finite() { 1.0 } else { 0.0 };
            self.spread_values(samples.iter().map(ones), line, weight);
        }
    }

    #[inline(always)]
    fn spread_values(&self, values: impl Iterator<Item = f32>, line: usize, to: &mut [f32]) {
        let (mut near, mut mean) = ([0f32; NEAR_SIDE * NEAR_SIDE], 0.0);
        for (value, weights) in values.zip(self.near.chunks_exact(NEAR_SIDE * NEAR_SIDE)) {
            mean += value;
            (near.iter_mut().zip(weights)).for_each(|(sum, w)| *sum += w * value);
        }
        let first = NEAR_PLACES.start;
        for (row, far) in self.far.chunks_exact(SIDE).enumerate() {
            let to = &mut to[row * line..][..SIDE];
            (to.iter_mut().zip(far)).for_each(|(to, w)| *to += w * mean);
        }
        for (row, near) in near.chunks_exact(NEAR_SIDE).enumerate() {
            let to = &mut to[(first + row) * line + first..][..NEAR_SIDE];
            (to.iter_mut().zip(near)).for_each(|(to, light)| *to += light);
        }
    }

    /// Adds to `weight` what [`Self::spread`] does for `columns` pixels side by side whose samples are all finite.
    pub fn spread_weights(&self, columns: usize, line: usize, weight: &mut [f32]) {
        let mut kernel = vec![0.0; SIDE * SIDE];
        let samples = self.near.len() / (NEAR_SIDE * NEAR_SIDE);
        self.spread_values(std::iter::repeat_n(1.0, samples), SIDE, &mut kernel);
        for (row, kernel) in kernel.chunks_exact(SIDE).enumerate() {
            // Sums of the kernel up to each column.
            let mut sums = [0.0; SIDE + 1];
            for (i, w) in kernel.iter().enumerate() {
                sums[i + 1] = sums[i] + w;
            }
            let to = &mut weight[row * line..][..SIDE + columns - 1];
            for (column, to) in to.iter_mut().enumerate() {
                let first = (column + 1).saturating_sub(columns);
                *to += sums[SIDE.min(column + 1)] - sums[first];
            }
        }
    }

    /// Rows above and below a pixel that its samples reach.
    pub const fn reach() -> usize {
        REACH as usize
    }
}

/// How many displacements take a sample at an offset to each pixel around its own, row by row, and beyond them.
fn counts(displacements_px: &[DVec2], offset: DVec2) -> [u32; BEYOND + 1] {
    let mut counts = [0; BEYOND + 1];
    let from = offset + (f64::from(REACH) + 0.5);
    for displacement in displacements_px {
        let to = from + *displacement;
        // Also false where it is not finite.
        let is_within = to.cmpge(DVec2::ZERO).all() && to.cmplt(DVec2::splat(SIDE as f64)).all();
        let place = match is_within {
            true => to.y as i32 as usize * SIDE + to.x as i32 as usize,
            false => BEYOND,
        };
        counts[place] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;

    #[test]
    fn weights_are_counts_of_rounded_places_and_spread_samples_by_them() {
        let random = |k: u64, d: u64| uniform(3, &[k, d]) - 0.5;
        let displacements: Vec<DVec2> = (0..512)
            .map(|k| 9.0 * random(k, 0).signum() * DVec2::new(random(k, 1), random(k, 2)).powf(3.0))
            .chain([DVec2::new(30.0, 0.0), DVec2::NAN])
            .collect();
        let offsets = [[0.4, -0.3], [-0.2, 0.1], [0.0, 0.45]];
        let blur = PixelBlur::new(&displacements, &offsets);
        let all = displacements.len() as f32;
        let share = |offset: [f64; 2], [x, y]: [i32; 2]| {
            let lands = |d: &&DVec2| {
                let to = (DVec2::from(offset) + **d).round();
                to == DVec2::new(f64::from(x), f64::from(y))
            };
            displacements.iter().filter(lands).count() as f32 / all
        };
        let (line, rows) = (SIDE, SIDE);
        for samples in [[0.5, 2.0, 1.0], [0.5, f32::NAN, 1.0]] {
            let [mut light, mut weight] = [(); 2].map(|()| vec![0.0; line * rows]);
            blur.spread(&samples, line, &mut light, Some(&mut weight));
            let [mut plain_light, mut plain_weight] = [(); 2].map(|()| vec![0.0; line * rows]);
            blur.spread_by(&samples, line, &mut plain_light, Some(&mut plain_weight));
            assert_eq!((&light, &weight), (&plain_light, &plain_weight));
            for i in 0..line * rows {
                let [x, y] = [i % SIDE, i / SIDE].map(|k| k as i32 - REACH);
                let finite = || samples.iter().zip(offsets).filter(|(s, _)| s.is_finite());
                // Far out each sample has the mean of all offsets.
                let of = |offset| match x.abs().max(y.abs()) <= NEAR {
                    true => share(offset, [x, y]),
                    false => offsets.map(|o| share(o, [x, y])).iter().sum::<f32>() / 3.0,
                };
                let wanted: f32 = finite().map(|(s, o)| s * of(o)).sum();
                assert!((light[i] - wanted).abs() < 1e-6, "{x} {y}");
                let wanted: f32 = finite().map(|(_, o)| of(o)).sum();
                assert!((weight[i] - wanted).abs() < 1e-6, "{x} {y}");
            }
        }
    }

    #[test]
    fn weights_of_pixels_side_by_side_are_those_of_each() {
        let random = |k: u64, d: u64| 12.0 * (uniform(4, &[k, d]) - 0.5);
        let displacements: Vec<DVec2> = (0..256)
            .map(|k| DVec2::new(random(k, 0), random(k, 1)))
            .collect();
        let blur = PixelBlur::new(&displacements, &[[0.3, 0.1], [-0.4, 0.2]]);
        for columns in [1, 5, 40] {
            let line = SIDE + columns + 2;
            let [mut together, mut each] = [(); 2].map(|()| vec![0.0; line * SIDE]);
            blur.spread_weights(columns, line, &mut together[1..]);
            let mut light = vec![0.0; line * SIDE];
            for column in 0..columns {
                let from = 1 + column;
                blur.spread(&[1.0; 2], line, &mut light[from..], Some(&mut each[from..]));
            }
            for (together, each) in together.iter().zip(&each) {
                assert!((together - each).abs() < 1e-5, "{together} {each}");
            }
        }
    }
}
