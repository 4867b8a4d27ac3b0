//! What a match is worth: its variance by the scatter of the window's parts, and how much of the window may be noise.
//!
//! The matcher's own variance σ²/H takes what is left over for noise that knows nothing of its neighbours. Where two
//! depths or two blurs meet in a window, or where the views share something that is no texture of the scene, it hangs
//! together, and the parts of the window want different shifts. With the window in blocks k, r what is left over, and p
//! the slope of b along the axis less what gain and offset can do,
//!
//! ```text
//! a(x) = g b(x + d) + o + r(x)     p = g (∂b − mean − share b̃)     H = Σ p²
//! s_k = Σ_k p r                    V = K/(K − 1) Σ_k s_k² / H²
//! ```
//!
//! V is the variance of d whatever r is like within a block (the "sandwich" of generalised estimating equations: Liang
//! & Zeger, Biometrika 73, 13 (1986)); for independent noise it is σ²/H.
//!
//! # Noise taken for texture
//! The halves of a pixel share its gain, and a converter what it does to their sum and how it rounds, so the views hold
//! a picture of the sensor that does not move. Where the scene is smooth it is what matches: a shift comes out too
//! small, by up to q, the part of H that is noise. A second difference along both axes sees hardly anything of a
//! blurred scene and all of white noise, so its mean square over the window is the noise's variance, and the slope of
//! white noise has 2 Σ SLOPE² times it:
//!
//! ```text
//! q = g n 2 Σ SLOPE² √(c_a c_b) / H        c = mean (∂²∂²)² / 36 of a and of b,   ∂²: 1, −2, 1
//! ```
//! How much of it the views share is not known; all of it is feared. Texture that is nearly white is given up with it.

use quadpixel::image::Image;

use crate::warp::weights::{TAPS, weights};

/// Blocks along a side of the window.
const BLOCKS: usize = 4;
/// ∂f ≈ Σ SLOPE\[k\] (f₊ₖ₊₁ − f₋ₖ₋₁), fourth order.
const SLOPE: [f64; 2] = [2.0 / 3.0, -1.0 / 12.0];

/// A pair of single-channel pictures of one size, and the windows in which they were matched.
pub struct Windows<'a> {
    /// The picture whose windows stand still.
    pub a: &'a Image,
    /// The other one.
    pub b: &'a Image,
    /// Side of the windows, px.
    pub window_px: usize,
    /// Shifts go down, not to the right.
    pub vertical: bool,
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// V, px².
    pub variance_px2: f64,
    /// q.
    pub noise: f64,
}

impl Windows<'_> {
    /// Of the shift `d_px` that was found for the window about (x, y) of a; `None` where the samples leave a picture or
    /// hold no slope.
    pub fn worth(&self, [x, y]: [usize; 2], d_px: f64) -> Option<Worth> {
        let (side, half) = (self.window_px, self.window_px / 2);
        // Along the shift, then across it.
        let (at, sizes) = match self.vertical {
            false => ([x, y], [self.a.width(), self.a.height()]),
            true => ([y, x], [self.a.height(), self.a.width()]),
        };
        let value = |image: &Image, along: usize, across: usize| {
            let index = match self.vertical {
                false => across * self.a.width() + along,
                true => along * self.a.width() + across,
            };
            f64::from(image.data()[index])
        };
        let whole = d_px.floor();
        let taps = weights::<4>((d_px - whole) as f32);
        let reach = SLOPE.len();
        // First sample of b under the first tap of the first column, of side + 2 reach columns.
        let first = at[0] as i64 + whole as i64 - (half + reach + TAPS / 2 - 1) as i64;
        let last = first + (side + 2 * reach + TAPS) as i64 - 2;
        if first < 0 || last >= sizes[0] as i64 || at[0] < half || at[1] < half {
            return None;
        }
        if at[0] + half >= sizes[0] || at[1] + half >= sizes[1] {
            return None;
        }
        let first = first as usize;
        let mut row = vec![0.0; side + 2 * reach];
        // a, b and ∂b at each pixel.
        let mut samples = Vec::with_capacity(side * side);
        for j in 0..side {
            let across = at[1] - half + j;
            for (i, to) in row.iter_mut().enumerate() {
                let tap =
                    |(k, w): (usize, &f32)| f64::from(*w) * value(self.b, first + i + k, across);
                *to = taps.iter().enumerate().map(tap).sum();
            }
            for i in 0..side {
                let c = i + reach;
                let slope = (SLOPE.iter().enumerate())
                    .map(|(k, w)| w * (row[c + k + 1] - row[c - k - 1]))
                    .sum::<f64>();
                samples.push([value(self.a, at[0] - half + i, across), row[c], slope]);
            }
        }
        let noise = self.noise_variance([x, y]);
        scatter(&samples, side, noise)
    }

    /// √(c_a c_b) of the window about (x, y), which lies inside.
    fn noise_variance(&self, [x, y]: [usize; 2]) -> f64 {
        let half = self.window_px / 2;
        let value =
            |image: &Image, x: usize, y: usize| f64::from(image.data()[y * self.a.width() + x]);
        let second = |image: &Image, x: usize, y: usize| {
            let row = |y: usize| {
                value(image, x - 1, y) - 2.0 * value(image, x, y) + value(image, x + 1, y)
            };
            row(y - 1) - 2.0 * row(y) + row(y + 1)
        };
        let (mut of_a, mut of_b, mut count) = (0.0, 0.0, 0.0);
        for y in y + 1 - half..y + half {
            for x in x + 1 - half..x + half {
                of_a += second(self.a, x, y).powi(2);
                of_b += second(self.b, x, y).powi(2);
                count += 1.0;
            }
        }
        f64::sqrt(of_a * of_b) / (36.0 * count)
    }
}

/// Of a window's (a, b, ∂b), row by row, and c.
fn scatter(samples: &[[f64; 3]], side: usize, noise: f64) -> Option<Worth> {
    let n = samples.len() as f64;
    let mean = [0, 1, 2].map(|k| samples.iter().map(|s| s[k]).sum::<f64>() / n);
    let less = |s: &[f64; 3]| [s[0] - mean[0], s[1] - mean[1], s[2] - mean[2]];
    let (mut ab, mut bb, mut bp) = (0.0, 0.0, 0.0);
    for s in samples {
        let [a, b, slope] = less(s);
        ab += a * b;
        bb += b * b;
        bp += b * slope;
    }
    let (gain, share) = (ab / bb, bp / bb);
    let mut sums = [0.0; BLOCKS * BLOCKS];
    let mut hessian = 0.0;
    for (k, s) in samples.iter().enumerate() {
        let [a, b, slope] = less(s);
        let p = gain * (slope - share * b);
        let block = |i: usize| i * BLOCKS / side;
        sums[block(k / side) * BLOCKS + block(k % side)] += p * (a - gain * b);
        hessian += p * p;
    }
    let count = sums.len() as f64;
    let squares: f64 = sums.iter().map(|s| s * s).sum();
    let variance = count / (count - 1.0) * squares / (hessian * hessian);
    let slopes: f64 = 2.0 * SLOPE.iter().map(|w| w * w).sum::<f64>();
    let worth = Worth {
        variance_px2: variance,
        noise: gain.abs() * n * slopes * noise / hessian,
    };
    (variance.is_finite() && worth.noise.is_finite()).then_some(worth)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    const SIDE: usize = 96;
    const WINDOW: usize = 31;

    /// White noise of variance 1, the same for the same seed.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        move || {
            let mut uniform = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            // The sum of twelve.
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    fn picture(value: impl FnMut(usize) -> f64) -> Image {
        let data = (0..SIDE * SIDE).map(value).map(|v| v as f32).collect();
        Image::from_vec(SIDE, SIDE, 1, data).unwrap()
    }

    /// Waves of some pixels' length, moved to the right.
    fn waves(i: usize, dx: f64) -> f64 {
        let (x, y) = ((i % SIDE) as f64 - dx, (i / SIDE) as f64);
        (0.31 * x + 0.2 * y).sin() + (0.23 * x - 0.37 * y).sin() + (0.45 * x + 0.05 * y).sin()
    }

    fn worth(a: &Image, b: &Image, d_px: f64) -> Worth {
        let windows = Windows {
            a,
            b,
            window_px: WINDOW,
            vertical: false,
        };
        windows.worth([48, 48], d_px).unwrap()
    }

    #[test]
    fn of_independent_noise_the_scatter_is_the_variance_of_the_matcher() {
        // σ²/H with H = Σ (∂b)² of the waves, by numbers; both views' noise counts. 200 draws of 15 degrees of freedom:
        // 3 %.
        let (sigma, draws) = (0.01, 200);
        let slope = |i: usize| {
            let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
            let wave = |a: f64, b: f64| a * (a * x + b * y).cos();
            wave(0.31, 0.2) + wave(0.23, -0.37) + wave(0.45, 0.05)
        };
        let inside = |i: &usize| (i % SIDE).abs_diff(48) <= 15 && (i / SIDE).abs_diff(48) <= 15;
        let hessian: f64 = (0..SIDE * SIDE)
            .filter(inside)
            .map(|i| slope(i).powi(2))
            .sum();
        let mut mean = 0.0;
        for seed in 1..=draws {
            let (mut p, mut q) = (noise(seed), noise(1000 + seed));
            let a = picture(|i| waves(i, 0.0) + sigma * p());
            let b = picture(|i| waves(i, 0.0) + sigma * q());
            mean += worth(&a, &b, 0.0).variance_px2 / draws as f64;
        }
        let expected = 2.0 * sigma * sigma / hessian;
        assert!((mean / expected - 1.0).abs() < 0.15, "{mean} {expected}");
    }

    #[test]
    fn two_shifts_in_a_window_scatter_by_half_their_distance() {
        // The upper half of the window lies 0.4 px beside the lower one: a block's own shift is ±0.2 px from the mean
        // of all. Sixteen blocks of which eight go each way and all eight together are no independent draws: V = 16/15
        // Σ (0.2 H/16)²/H² = 0.2²/15 at least.
        let a = picture(|i| waves(i, 0.0));
        let b = picture(|i| waves(i, if i / SIDE < 48 { 0.2 } else { -0.2 }));
        let two = worth(&a, &b, 0.0).variance_px2.sqrt();
        assert!(two > 0.2 / 15f64.sqrt() * 0.9, "{two}");
        let one = worth(&a, &picture(|i| waves(i, 0.2)), 0.2)
            .variance_px2
            .sqrt();
        // What Lanczos of four lobes gets wrong, some 0.5 % of waves of mean square 3/2 and slope 0.42, held against
        // them block by block (Cauchy): √(16/15/16 · R/H) = 0.258 · 0.005 · 1.22/0.42 px.
        assert!(one < 4e-3, "{one}");
    }

    #[test]
    fn noise_is_told_from_texture() {
        let mut p = noise(7);
        let shared: Vec<f64> = (0..SIDE * SIDE).map(|_| p()).collect();
        // Nothing but white noise, the same in both views: q = 1 but for the window's finite number of pixels.
        let same = picture(|i| shared[i]);
        let q = worth(&same, &same, 0.0).noise;
        assert!((q - 1.0).abs() < 0.2, "{q}");
        // Waves of some pixels, and as much again of noise of a tenth of their slope's variance.
        let moved = [0.0, 0.3].map(|dx| picture(|i| waves(i, dx)));
        let q = worth(&moved[0], &moved[1], 0.3).noise;
        assert!(q < 0.02, "{q}");
        let slope: f64 = 0.5 * (0.31f64.powi(2) + 0.23f64.powi(2) + 0.45f64.powi(2));
        let sigma = (0.1 * slope / 0.903).sqrt();
        let noisy = picture(|i| waves(i, 0.0) + sigma * shared[i]);
        let q = worth(&noisy, &noisy, 0.0).noise;
        assert!((q - 0.1 / 1.1).abs() < 0.03, "{q}");
    }
}
