//! Antialiased drawing: exact edges, band-limited stripes, and a canvas painted in bands of rows.
//!
//! Positions are in texels, x right, y down, texel (i, j) covering [i, i+1] × [j, j+1].

use super::error::ChartError;
use quadpixel::scene::texture::Texture;
use rayon::prelude::*;
use std::f32::consts::{FRAC_2_PI, PI, TAU};

/// Share of a texel that lies inside the half-plane whose edge is `d` texels from its centre (d > 0: centre inside),
/// with the edge's unit normal `n`. Exact: the box integral of a step is quadratic where the edge cuts a corner, linear
/// between.
#[inline]
pub(super) fn edge_coverage(d: f32, n: [f32; 2]) -> f32 {
    let (a, b) = (n[0].abs().max(n[1].abs()), n[0].abs().min(n[1].abs()));
    let half = 0.5 * (a + b);
    if d >= half {
        1.0
    } else if d <= -half {
        0.0
    } else if d.abs() <= 0.5 * (a - b) {
        0.5 + d / a
    } else if d > 0.0 {
        1.0 - (half - d) * (half - d) / (2.0 * a * b)
    } else {
        (half + d) * (half + d) / (2.0 * a * b)
    }
}

/// A square wave as a raster can hold it: 1 where cos(2π phase) > 0, else 0, averaged over a texel.
///
/// `frequency` in cycles per texel along the unit vector `n`. Wide stripes have exact edges. From 24 to 12 texels per
/// period they pass over to the Fourier series of the box-filtered wave, Σ (2/π) (−1)^k/(2k+1) sinc(q) cos(2π (2k+1)
/// phase) at q = (2k+1) frequency, each harmonic faded out from q = 0.35 to Nyquist's 0.5: beyond Nyquist there is
/// grey, never an alias.
#[inline]
pub(super) fn square_wave(phase: f32, frequency: f32, n: [f32; 2]) -> f32 {
    let phase = phase - phase.round();
    let exact = || edge_coverage((0.25 - phase.abs()) / frequency.max(1e-6), n);
    let mix = 24.0 * frequency - 1.0;
    if mix <= 0.0 {
        exact()
    } else if mix < 1.0 {
        let exact = exact();
        exact + (harmonics(phase, frequency) - exact) * mix
    } else {
        harmonics(phase, frequency)
    }
}

/// The band-limited series of [`square_wave`].
fn harmonics(phase: f32, frequency: f32) -> f32 {
    let base = (TAU * phase).cos();
    let twice = 2.0 * (2.0 * base * base - 1.0);
    // cos((2k+1)a) = 2 cos(2a) cos((2k−1)a) − cos((2k−3)a), from cos(−a) = cos(a).
    let (mut before, mut now) = (base, base);
    let (mut sum, mut sign, mut odd) = (0.0, 1.0, 1.0);
    loop {
        let q = odd * frequency;
        if q >= 0.5 {
            return (0.5 + FRAC_2_PI * sum).clamp(0.0, 1.0);
        }
        sum += sign * now * fade(q) * (PI * q).sin() / (PI * q * odd);
        (before, now) = (now, twice * now - before);
        sign = -sign;
        odd += 2.0;
    }
}

/// 1 up to 0.35 cycles per texel, smoothly to 0 at 0.5.
#[inline]
fn fade(q: f32) -> f32 {
    let x = ((0.5 - q) / 0.15).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Rows painted as one unit of work; what is painted does not depend on it.
pub(super) const BAND_ROWS: usize = 64;

/// Some rows of a canvas of C channels.
pub(super) struct Band<'a, const C: usize> {
    size: usize,
    first_row: usize,
    texels: &'a mut [[f32; C]],
}

/// A square canvas filled with `background`, painted by `paint` band by band (in parallel), as a texture. `paint` must
/// draw the same shapes on each band.
pub(super) fn canvas<const C: usize>(
    size: usize,
    background: [f32; C],
    paint: impl Fn(&mut Band<C>) + Sync,
) -> Result<Texture, ChartError> {
    super::error::side(size)?;
    let mut texels = vec![background; size * size];
    texels
        .par_chunks_mut(size * BAND_ROWS)
        .enumerate()
        .for_each(|(k, texels)| {
            paint(&mut Band {
                size,
                first_row: k * BAND_ROWS,
                texels,
            });
        });
    Ok(Texture::from_fn(size, size, |x, y| texels[y * size + x])?)
}

impl<const C: usize> Band<'_, C> {
    /// The canvas row at which the band begins, a multiple of [`BAND_ROWS`].
    pub(super) fn first_row(&self) -> usize {
        self.first_row
    }

    /// Blends `colour` into the texels of the box [x0, x1] × [y0, y1] (texels) by `coverage` (0..1) at their centres.
    #[inline]
    pub(super) fn fill(
        &mut self,
        bounds: [f32; 4],
        colour: [f32; C],
        coverage: impl Fn(f32, f32) -> f32,
    ) {
        let [x0, y0, x1, y1] = bounds;
        // Casts from f32 saturate: what lies left of or above the canvas becomes 0.
        let (x0, x1) = (x0.floor() as usize, (x1.ceil() as usize).min(self.size));
        let rows = self.texels.len() / self.size;
        let y0 = (y0.floor() as usize).max(self.first_row);
        let y1 = (y1.ceil() as usize).min(self.first_row + rows);
        if x0 >= x1 {
            return;
        }
        for y in y0..y1 {
            let start = (y - self.first_row) * self.size;
            let row = &mut self.texels[start + x0..start + x1];
            for (x, texel) in (x0..x1).zip(row) {
                let share = coverage(x as f32 + 0.5, y as f32 + 0.5);
                if share > 0.0 {
                    for (value, &colour) in texel.iter_mut().zip(&colour) {
                        *value += (colour - *value) * share;
                    }
                }
            }
        }
    }

    /// Fills the disk of `radius` around (x, y).
    pub(super) fn disk(&mut self, [x, y]: [f32; 2], radius: f32, colour: [f32; C]) {
        let reach = radius + 0.5;
        let inner = (radius - 0.5).max(0.0);
        // A disk smaller than a texel keeps its area.
        let weight = (4.0 * radius * radius).min(1.0);
        self.fill(
            [x - reach, y - reach, x + reach, y + reach],
            colour,
            |px, py| {
                let square = (px - x) * (px - x) + (py - y) * (py - y);
                if square <= inner * inner {
                    weight
                } else {
                    weight * (reach - square.sqrt()).clamp(0.0, 1.0)
                }
            },
        );
    }

    /// Fills the rectangle of half sides `half` around `centre`, turned by `angle` (radians, from x towards y).
    pub(super) fn rectangle(
        &mut self,
        centre: [f32; 2],
        half: [f32; 2],
        angle: f32,
        colour: [f32; C],
    ) {
        let (sin, cos) = angle.sin_cos();
        let [x, y] = centre;
        let reach_x = (half[0] * cos).abs() + (half[1] * sin).abs() + 1.0;
        let reach_y = (half[0] * sin).abs() + (half[1] * cos).abs() + 1.0;
        let (n, m) = ([cos, sin], [-sin, cos]);
        self.fill(
            [x - reach_x, y - reach_y, x + reach_x, y + reach_y],
            colour,
            |px, py| {
                let (dx, dy) = (px - x, py - y);
                let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
                strip(u, half[0], n) * strip(v, half[1], m)
            },
        );
    }
}

/// Share of a texel inside the strip |u| < half, its normal `n`.
#[inline]
pub(super) fn strip(u: f32, half: f32, n: [f32; 2]) -> f32 {
    edge_coverage(half - u, n) + edge_coverage(half + u, n) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edge_coverage_is_the_area_under_the_edge() {
        for angle in [0.0f32, 0.1, 0.7, PI / 4.0, 1.3, PI / 2.0, 2.5] {
            let n = [angle.cos(), angle.sin()];
            for d in [-0.8f32, -0.6, -0.3, -0.05, 0.0, 0.2, 0.55, 0.69, 0.9] {
                let m = 400;
                let mut inside = 0;
                for j in 0..m {
                    for i in 0..m {
                        let x = (i as f32 + 0.5) / m as f32 - 0.5;
                        let y = (j as f32 + 0.5) / m as f32 - 0.5;
                        inside += usize::from(x * n[0] + y * n[1] + d > 0.0);
                    }
                }
                let want = inside as f32 / (m * m) as f32;
                // The count is good to about one row of 400.
                assert!(
                    (edge_coverage(d, n) - want).abs() < 3e-3,
                    "angle {angle}, d {d}"
                );
            }
        }
    }

    #[test]
    fn square_wave_is_grey_beyond_nyquist_and_has_mean_one_half() {
        for k in 0..100 {
            assert_eq!(square_wave(k as f32 * 0.137, 0.51, [1.0, 0.0]), 0.5);
        }
        for frequency in [0.01f32, 0.05, 0.0625, 0.1, 0.2, 0.4] {
            let n = 1000;
            let mean: f32 = (0..n)
                .map(|k| square_wave(k as f32 / n as f32, frequency, [1.0, 0.0]))
                .sum::<f32>()
                / n as f32;
            assert!((mean - 0.5).abs() < 1e-3, "{frequency}: {mean}");
        }
    }
}
