//! The diffraction pattern as weights between pixels: what blurs a picture that was sampled at a few places per pixel.
//!
//! A sample at the offset o from the middle of its pixel gives the pixel Δ further the part of its light that the
//! pattern displaces there: `w(o, Δ) = P(round(o + d) = Δ)`. Near its own pixel each offset has weights of its own,
//! further out all have their mean. Light beyond [`REACH`] is left out, and the blur is normalised.

use glam::DVec2;
use rayon::prelude::*;

use super::LensDiffraction;
use crate::sampling::SobolSet;

/// Pixels to each side with weights per offset.
const NEAR: i32 = 2;
/// Pixels to each side that are blurred into.
const REACH: i32 = 8;
/// Displacements that the weights are counted from.
const SAMPLES: usize = 4096;

const NEAR_SIDE: usize = 2 * NEAR as usize + 1;
const SIDE: usize = 2 * REACH as usize + 1;

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
        let mut near = vec![0.0; offsets_px.len() * NEAR_SIDE * NEAR_SIDE];
        let mut far = vec![0.0; SIDE * SIDE];
        let one = 1.0 / displacements_px.len() as f32;
        for (k, &offset) in offsets_px.iter().enumerate() {
            for d in displacements_px {
                let to = (DVec2::from(offset) + *d).round();
                // Also false where it is not finite.
                if to.abs().max_element() <= f64::from(NEAR) {
                    let (x, y) = (to.x as i32 + NEAR, to.y as i32 + NEAR);
                    near[(k * NEAR_SIDE + y as usize) * NEAR_SIDE + x as usize] += one;
                } else if to.abs().max_element() <= f64::from(REACH) {
                    let (x, y) = (to.x as i32 + REACH, to.y as i32 + REACH);
                    far[y as usize * SIDE + x as usize] += one / offsets_px.len() as f32;
                }
            }
        }
        Self { near, far }
    }

    /// Adds what a pixel's samples give the pixels around it, to `light` with their values and to `weight` without.
    /// `samples`: one per offset; those that are not finite count for nothing. Both begin [`Self::reach`] rows above
    /// and columns beside the pixel, and hold rows of `line` values.
    pub fn spread(&self, samples: &[f32], line: usize, light: &mut [f32], weight: &mut [f32]) {
        let mut near = [[0f32; NEAR_SIDE * NEAR_SIDE]; 2];
        let mut mean = [0f32; 2];
        let each = self.near.chunks_exact(NEAR_SIDE * NEAR_SIDE);
        for (&sample, weights) in samples.iter().zip(each) {
            if !sample.is_finite() {
                continue;
            }
            mean = [mean[0] + sample, mean[1] + 1.0];
            for (i, &w) in weights.iter().enumerate() {
                near[0][i] += w * sample;
                near[1][i] += w;
            }
        }
        let first = (REACH - NEAR) as usize;
        for (to, (mean, near)) in [light, weight].into_iter().zip(mean.into_iter().zip(&near)) {
            for (row, far) in self.far.chunks_exact(SIDE).enumerate() {
                let to = &mut to[row * line..][..SIDE];
                (to.iter_mut().zip(far)).for_each(|(to, w)| *to += w * mean);
            }
            for (row, near) in near.chunks_exact(NEAR_SIDE).enumerate() {
                let to = &mut to[(first + row) * line + first..][..NEAR_SIDE];
                (to.iter_mut().zip(near)).for_each(|(to, light)| *to += light);
            }
        }
    }

    /// Rows above and below a pixel that its samples reach.
    pub const fn reach() -> usize {
        REACH as usize
    }
}
