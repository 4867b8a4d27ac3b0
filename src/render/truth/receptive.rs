//! What one pixel sees of a flat texture at a depth, and the shift that a matcher finds between two of its views.
//!
//! Ray k of pixel p, of weight w_ik to sub-pixel i, sees the texture (its picture in the sum of all views, T) at p +
//! δ_k, so
//!
//! ```text
//! I_i(p) = Σ_k w_ik T(p + δ_k)       δ_k = J⁻¹ (q_k − q̄)      O_i(f) = Σ_k w_ik exp(2πi f·δ_k)
//! D = argmax_d  Σ_f S(f) Re[ O_i(f) O_j*(f) exp(2πi f_x d) ]
//! ```
//!
//! D = x_i − x_j is what least squares over a window finds between views i and j of a texture of the power spectrum S
//! (Parseval). At low frequencies it is the difference of the centroids of [`super::DisparityField`]; where the blur is
//! as wide as the texture is fine the two views' blurs differ in shape and D is larger. S is that of natural
//! pictures, |f|^−2 (Field, J. Opt. Soc. Am. A 4, 2379 (1987)), seen through a square pixel, without what a window of w
//! px takes for an offset, (1 − sinc(w f_x) sinc(w f_y))². Where the camera has diffraction at its lens's aperture, it
//! displaces ray k by draws d: to first order exp(2πi f·δ_k) is multiplied by their mean of exp(2πi f·d).
//! A ray from the rim has the wider ones, so that fine texture is seen by the middle of the pupil and shifts less.

use std::f64::consts::{PI, TAU};

use glam::{DMat2, DVec2, Vec2Swizzles};

use super::bundle::Bundle;
use super::disparity::jacobian_at;
use super::displaced::{Displaced, FREQUENCIES, ROWS, each_frequency, frequency, row_frequency};
use crate::render::Camera;
use crate::sampling::SobolSet;

/// Shifts tried on each side of the centroids' difference, px, and their distance.
const SEARCH_PX: f64 = 3.0;
const STEP_PX: f64 = 0.05;

/// The power spectrum of the texture that is matched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSpectrum {
    /// S falls as |f| to minus this.
    pub exponent: f64,
    /// Side of the matcher's window, px.
    pub window_px: f64,
}

impl Default for TextureSpectrum {
    fn default() -> Self {
        Self {
            exponent: 2.0,
            window_px: 21.0,
        }
    }
}

/// One pixel's rays; see the module.
#[derive(Clone, Debug)]
pub struct ReceptiveField {
    bundle: Bundle,
    /// By diffraction at the lens's aperture, where the camera has any.
    displaced: Option<Displaced>,
    jacobian: [DMat2; 2],
}

impl ReceptiveField {
    /// Of the pixel at `xy_mm` on the sensor, at a channel's wavelength, with `rays` rays; `None` where no light
    /// passes.
    pub fn new(camera: &Camera, channel: usize, xy_mm: DVec2, rays: usize) -> Option<Self> {
        let bundle = Bundle::new(camera, channel, xy_mm, &SobolSet::new(rays))?;
        let lit = bundle.weights.iter().sum::<f64>() > 0.0;
        let jacobian = jacobian_at(camera, channel, xy_mm)?;
        let displaced = Displaced::new(camera, xy_mm, &bundle);
        lit.then_some(Self {
            bundle,
            displaced,
            jacobian,
        })
    }

    /// Two groups of sub-pixels as the two views of a pixel; `vertical`: with rows in the place of columns, so that
    /// shifts along y are found as those along x are.
    pub fn of_groups(&self, groups: [&[usize]; 2], vertical: bool) -> Self {
        let turned = |v: DVec2| if vertical { v.yx() } else { v };
        let weights = (0..self.bundle.q0.len()).flat_map(|k| {
            groups.map(|group| group.iter().map(|&s| self.weights(k)[s]).sum::<f64>())
        });
        let all = |list: &[DVec2]| list.iter().map(|&v| turned(v)).collect();
        let b = &self.bundle;
        Self {
            bundle: Bundle {
                weights: weights.collect(),
                q0: all(&b.q0),
                q1_mm: all(&b.q1_mm),
                slopes: all(&b.slopes),
                directions: b.directions.clone(),
                wavelengths_mm: b.wavelengths_mm.clone(),
                measure: b.measure.clone(),
                scale: b.scale,
                subpixels: 2,
            },
            displaced: (self.displaced.as_ref()).map(|d| d.turned(turned)),
            jacobian: (self.jacobian).map(|j| match vertical {
                true => DMat2::from_cols(j.y_axis.yx(), j.x_axis.yx()),
                false => j,
            }),
        }
    }

    /// δ of each ray at `depth_mm` (+∞ allowed), px: where it looks, from where all together look, x right, y down as
    /// stored.
    pub fn offsets_px(&self, depth_mm: f64) -> Vec<DVec2> {
        let inverse = 1.0 / depth_mm;
        let [j0, j1] = self.jacobian;
        let solve = (j0 + inverse * j1).inverse();
        let b = &self.bundle;
        let mut offsets: Vec<DVec2> = (b.q0.iter().zip(&b.q1_mm))
            .map(|(&q0, &q1)| solve * (q0 + inverse * q1))
            .collect();
        let weight = |k: usize| self.weights(k).iter().sum::<f64>();
        let all: f64 = (0..offsets.len()).map(weight).sum();
        let sum: DVec2 = (0..offsets.len()).map(|k| weight(k) * offsets[k]).sum();
        offsets.iter_mut().for_each(|o| *o -= sum / all);
        offsets
    }

    /// Weights of ray k, one per sub-pixel.
    pub fn weights(&self, k: usize) -> &[f64] {
        let n = self.bundle.subpixels;
        &self.bundle.weights[k * n..(k + 1) * n]
    }

    /// x_i − x_j by the centroids of what sub-pixels i and j see, px.
    pub fn centroid_shift_px(&self, depth_mm: f64, [i, j]: [usize; 2]) -> f64 {
        let offsets = self.offsets_px(depth_mm);
        let mean = |s: usize| {
            let (mut sum, mut all) = (0.0, 0.0);
            for (k, o) in offsets.iter().enumerate() {
                let w = self.weights(k)[s];
                sum += w * o.x;
                all += w;
            }
            sum / all
        };
        mean(j) - mean(i)
    }

    /// x_i − x_j as a matcher finds it on a texture, px.
    pub fn matched_shift_px(
        &self,
        depth_mm: f64,
        [i, j]: [usize; 2],
        texture: &TextureSpectrum,
    ) -> f64 {
        let start = self.centroid_shift_px(depth_mm, [i, j]);
        let cross = self.cross_spectrum(depth_mm, [i, j], texture);
        // Columns of equal f_x have been summed over f_y.
        let correlation = |d: f64| {
            let terms = cross.iter().enumerate().map(|(k, [re, im])| {
                let (sin, cos) = (TAU * frequency(k) * d).sin_cos();
                re * cos - im * sin
            });
            terms.sum::<f64>()
        };
        let tries = (SEARCH_PX / STEP_PX).round() as i64;
        let mut best = (start, f64::NEG_INFINITY);
        for n in -tries..=tries {
            let d = start + n as f64 * STEP_PX;
            let c = correlation(d);
            if c > best.1 {
                best = (d, c);
            }
        }
        // The summit of the parabola through the best and its neighbours; the correlation is smooth on this scale.
        let [before, after] = [-STEP_PX, STEP_PX].map(|s| correlation(best.0 + s));
        let curvature = before - 2.0 * best.1 + after;
        if curvature < 0.0 {
            best.0 + 0.5 * STEP_PX * (before - after) / curvature
        } else {
            best.0
        }
    }

    /// Σ over f_y of S O_i O_j*, as (real, imaginary), a f_x.
    fn cross_spectrum(
        &self,
        depth_mm: f64,
        [i, j]: [usize; 2],
        texture: &TextureSpectrum,
    ) -> Vec<[f64; 2]> {
        let offsets = self.offsets_px(depth_mm);
        let mut transfer = vec![[[0.0; 2]; 2]; FREQUENCIES * ROWS];
        for (k, o) in offsets.iter().enumerate() {
            let weights = [self.weights(k)[i], self.weights(k)[j]];
            let displaced = self.displaced.as_ref().map(|d| d.of_ray(k));
            each_frequency(*o, |i, [re, im]| {
                let [re, im] = match displaced {
                    Some(d) => [re * d[i][0] - im * d[i][1], re * d[i][1] + im * d[i][0]],
                    None => [re, im],
                };
                for (to, w) in transfer[i].iter_mut().zip(weights) {
                    to[0] += w * re;
                    to[1] += w * im;
                }
            });
        }
        let column = |c: usize| {
            let mut sum = [0.0; 2];
            for r in 0..ROWS {
                let [a, b] = transfer[c * ROWS + r];
                let s = texture.power(DVec2::new(frequency(c), row_frequency(r)));
                sum[0] += s * (a[0] * b[0] + a[1] * b[1]);
                sum[1] += s * (a[1] * b[0] - a[0] * b[1]);
            }
            sum
        };
        (0..FREQUENCIES).map(column).collect()
    }
}

impl TextureSpectrum {
    fn power(&self, f: DVec2) -> f64 {
        let sinc = |x: f64| {
            if x == 0.0 {
                1.0
            } else {
                (PI * x).sin() / (PI * x)
            }
        };
        let pixel = sinc(f.x) * sinc(f.y);
        let passed = 1.0 - sinc(self.window_px * f.x) * sinc(self.window_px * f.y);
        (pixel * passed).powi(2) / f.length_squared().powf(0.5 * self.exponent)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// A pupil of `n`² points on a square of half width 1, seen with weights 1 ± s x, its rays `blur` px apart at the
    /// rim.
    fn field(slope: f64, n: usize) -> ReceptiveField {
        let place = |i: usize| (2.0 * i as f64 + 1.0) / n as f64 - 1.0;
        let points = (0..n * n).map(|k| DVec2::new(place(k % n), place(k / n)));
        let q1_mm: Vec<DVec2> = points.collect();
        let weights = |p: &DVec2| [1.0 - slope * p.x, 1.0 + slope * p.x];
        ReceptiveField {
            bundle: Bundle {
                q0: vec![DVec2::ZERO; n * n],
                slopes: q1_mm.clone(),
                directions: q1_mm.clone(),
                wavelengths_mm: vec![5.5e-4; n * n],
                weights: q1_mm.iter().flat_map(weights).collect(),
                measure: vec![1.0; n * n],
                q1_mm,
                scale: 1.0,
                subpixels: 2,
            },
            displaced: None,
            jacobian: [DMat2::IDENTITY, DMat2::ZERO],
        }
    }

    #[test]
    fn a_sliver_of_blur_shifts_as_its_centroids_do() {
        // ⟨x²⟩ of a square of half width a is a²/3 (1 − 1/n²): centroids at ± s a/3. Depth 1/a makes the half width a
        // px.
        let f = field(0.5, 16);
        for a in [0.05, 0.3] {
            let expected = 2.0 * 0.5 * a / 3.0 * (1.0 - 1.0 / 256.0);
            let centroid = f.centroid_shift_px(1.0 / a, [0, 1]);
            assert!((centroid - expected).abs() < 1e-12, "{centroid} {expected}");
            let matched = f.matched_shift_px(1.0 / a, [0, 1], &TextureSpectrum::default());
            // The next term of the odd over the even part of the spectrum is (2π f a)²/30 at most.
            assert!((matched / expected - 1.0).abs() < 0.03, "{a}: {matched}");
        }
    }

    #[test]
    fn mirrored_blurs_of_fine_texture_match_farther_apart_than_centroids() {
        let f = field(0.5, 16);
        let (blur, both) = (4.0, [0, 1]);
        let centroid = f.centroid_shift_px(1.0 / blur, both);
        let matched = f.matched_shift_px(1.0 / blur, both, &TextureSpectrum::default());
        assert!(matched > 1.02 * centroid, "{matched} {centroid}");
        // Exchanged views shift the other way.
        let back = f.matched_shift_px(1.0 / blur, [1, 0], &TextureSpectrum::default());
        assert!((matched + back).abs() < 1e-9);
    }
}
