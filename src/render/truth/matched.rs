//! The shift that a matcher finds between two views of a flat texture, each blurred in its own way.
//!
//! Ray k of a pixel, of weight w_ik to view i, sees the texture at δ_k from the pixel:
//!
//! ```text
//! I_i(p) = Σ_k w_ik T(p + δ_k)                                O_i(f) = Σ_k w_ik exp(2πi f·δ_k)
//! D = argmax_d  Σ_f S(f) Re[ O_i(f) O_j*(f) exp(2πi f_x d) ]
//! ```
//!
//! D = x_i − x_j is what least squares over a window finds between views i and j of a texture of the power spectrum S
//! (Parseval). At low frequencies it is the difference of the centroids; where the blur is
//! as wide as the texture is fine the two views' blurs differ in shape and D is larger. S is that of natural
//! pictures, |f|^−2 (Field, J. Opt. Soc. Am. A 4, 2379 (1987)), seen through a square pixel, without what a window of w
//! px takes for an offset, (1 − sinc(w f_x) sinc(w f_y))². Where light is displaced besides, by draws d (diffraction at
//! the lens's aperture), to first order exp(2πi f·δ_k) is multiplied by their mean of exp(2πi f·d).

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::displaced::{FREQUENCIES, ROWS, each_frequency, frequency, row_frequency};

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

/// x_0 − x_1 as a matcher finds it on a texture, px, of rays with these offsets δ (px) and their weights to two views.
pub fn matched_shift_px(
    offsets_px: &[DVec2],
    weights: &[[f64; 2]],
    texture: &TextureSpectrum,
) -> f64 {
    let rays = || offsets_px.iter().copied().zip(weights.iter().copied());
    let start = centroid_shift_px(rays());
    summit(start, &cross_spectrum(rays().map(|r| (r, None)), texture))
}

/// x_0 − x_1 by the centroids of what two views see, px.
pub(super) fn centroid_shift_px(rays: impl Iterator<Item = (DVec2, [f64; 2])>) -> f64 {
    let (mut sums, mut all) = ([0.0; 2], [0.0; 2]);
    for (offset, weights) in rays {
        for ((sum, all), w) in sums.iter_mut().zip(&mut all).zip(weights) {
            *sum += w * offset.x;
            *all += w;
        }
    }
    sums[1] / all[1] - sums[0] / all[0]
}

/// Σ over f_y of S O_0 O_1*, as (real, imaginary), a f_x, of rays (δ, weights), and what displaces each, if anything
/// does.
pub(super) fn cross_spectrum<'a>(
    rays: impl Iterator<Item = ((DVec2, [f64; 2]), Option<&'a [[f64; 2]]>)>,
    texture: &TextureSpectrum,
) -> Vec<[f64; 2]> {
    let mut transfer = vec![[[0.0; 2]; 2]; FREQUENCIES * ROWS];
    for ((offset, weights), displaced) in rays {
        each_frequency(offset, |i, [re, im]| {
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

/// Where the correlation of a cross spectrum is largest, px, near `start`.
pub(super) fn summit(start: f64, cross: &[[f64; 2]]) -> f64 {
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
