//! Gaussian noise, white or with a power spectrum 1/f^β.
//!
//! A field of standard deviation 1 is Re or Im of Σ_k A(k) z(k) exp(2πi k·x/N), with z(k) complex white normal numbers
//! keyed by (seed, k), and A(k) = |k|^(−β/2) for 0 < |k|/N ≤ 1/cutoff, else 0. Re and Im are independent, so two
//! transforms give R, G and B. The measured mean is exactly 0 and the measured variance is scaled to 1. White noise
//! without a cutoff is drawn texel by texel. The reflectance is mean + contrast × field, clipped to 0.02..=0.98.
//!
//! β = 2 is what natural images have (Field, JOSA A 4, 2379 (1987)).

use super::error::{ChartError, side, within};
use super::keyed::Key;
use quadpixel::scene::texture::Texture;
use rayon::prelude::*;
use rustfft::{FftPlannerScalar, num_complex::Complex32};
use serde::{Deserialize, Serialize};

const NAME: &str = "noise";

/// Parameters of the `noise` chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Noise {
    /// Exponent β of the power spectrum 1/f^β, 0 (white) ..=4; default 0.
    pub exponent: f64,
    /// Independent R, G and B instead of grey; default false.
    pub color: bool,
    /// Mean reflectance, 0.1..=0.9; default 0.45.
    pub mean: f64,
    /// Standard deviation of the reflectance before clipping, 0..=0.5; default 0.15.
    pub contrast: f64,
    /// Shortest period left in the noise, texels: 0 (no limit) or 2..=1024; default 0.
    pub cutoff_texels: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            exponent: 0.0,
            color: false,
            mean: 0.45,
            contrast: 0.15,
            cutoff_texels: 0.0,
        }
    }
}

impl Noise {
    pub(super) fn random(key: Key) -> Self {
        Self {
            exponent: [0.0, key.range(1, 0.5, 2.5)][key.whole(0, 0, 1) as usize],
            color: key.uniform(2) < 0.5,
            mean: key.range(3, 0.3, 0.6),
            contrast: key.range(4, 0.08, 0.22),
            cutoff_texels: [0.0, key.range(6, 2.0, 8.0)][key.whole(5, 0, 1) as usize],
        }
    }

    fn check(&self) -> Result<(), ChartError> {
        within(NAME, "exponent", self.exponent, 0.0, 4.0)?;
        within(NAME, "mean", self.mean, 0.1, 0.9)?;
        within(NAME, "contrast", self.contrast, 0.0, 0.5)?;
        if self.cutoff_texels == 0.0 {
            return Ok(());
        }
        within(NAME, "cutoff_texels", self.cutoff_texels, 2.0, 1024.0)
    }

    pub(super) fn draw(&self, seed: u64, size_px: usize) -> Result<Texture, ChartError> {
        self.check()?;
        side(size_px)?;
        let key = Key::new(seed, NAME);
        let reflectance = |z: f32| (self.mean as f32 + self.contrast as f32 * z).clamp(0.02, 0.98);
        if self.exponent == 0.0 && self.cutoff_texels == 0.0 {
            let at = |x: usize, y: usize| key.with(x as u64).with(y as u64);
            return Ok(if self.color {
                Texture::from_fn(size_px, size_px, |x, y| {
                    let ([r, g], [b, _]) = (at(x, y).normal_pair(), at(x, y).with(1).normal_pair());
                    [r, g, b].map(reflectance)
                })?
            } else {
                Texture::from_fn(size_px, size_px, |x, y| {
                    [reflectance(at(x, y).normal_pair()[0])]
                })?
            });
        }
        let first = self.fields(key.with(0), size_px);
        Ok(if self.color {
            let second = self.fields(key.with(1), size_px);
            Texture::from_fn(size_px, size_px, |x, y| {
                let (a, b) = (first[y * size_px + x], second[y * size_px + x]);
                [a.re, a.im, b.re].map(reflectance)
            })?
        } else {
            Texture::from_fn(size_px, size_px, |x, y| {
                [reflectance(first[y * size_px + x].re)]
            })?
        })
    }

    /// Two independent fields of mean 0 and standard deviation 1, as real and imaginary part.
    fn fields(&self, key: Key, n: usize) -> Vec<Complex32> {
        let mut field = self.spectrum(key, n);
        // The scalar planner: the others choose instructions, and with them the last bits, by the machine.
        let fft = FftPlannerScalar::new().plan_fft_inverse(n);
        let rows = |field: &mut [Complex32]| {
            field.par_chunks_mut(n).for_each_init(
                || vec![Complex32::default(); fft.get_inplace_scratch_len()],
                |scratch, row| fft.process_with_scratch(row, scratch),
            );
        };
        rows(&mut field);
        let mut turned = transposed(&field, n);
        drop(field);
        rows(&mut turned);
        let sums: Vec<[f64; 2]> = turned
            .par_chunks(n)
            .map(|row| {
                row.iter().fold([0.0; 2], |[re, im], v| {
                    [re + f64::from(v.re).powi(2), im + f64::from(v.im).powi(2)]
                })
            })
            .collect();
        // Summed in order, so that the thread count cannot change the bits.
        let scale = [0, 1].map(|c| {
            let mean_square = sums.iter().map(|s| s[c]).sum::<f64>() / (n * n) as f64;
            if mean_square > 0.0 {
                mean_square.sqrt().recip() as f32
            } else {
                0.0
            }
        });
        turned.par_iter_mut().for_each(|v| {
            *v = Complex32::new(v.re * scale[0], v.im * scale[1]);
        });
        turned
    }

    /// A(k) z(k) for all frequencies k in the transform's order.
    fn spectrum(&self, key: Key, n: usize) -> Vec<Complex32> {
        let signed = |i: usize| i as i64 - if 2 * i > n { n as i64 } else { 0 };
        // |k| in cycles per side.
        let highest = if self.cutoff_texels == 0.0 {
            f64::INFINITY
        } else {
            n as f64 / self.cutoff_texels
        };
        let mut spectrum = vec![Complex32::default(); n * n];
        spectrum.par_chunks_mut(n).enumerate().for_each(|(j, row)| {
            let ky = signed(j);
            let key = key.with(ky as u64);
            for (i, value) in row.iter_mut().enumerate() {
                let kx = signed(i);
                let square = (kx * kx + ky * ky) as f64;
                if square > 0.0 && square <= highest * highest {
                    let amplitude = (square as f32).powf(-0.25 * self.exponent as f32);
                    let [re, im] = key.with(kx as u64).normal_pair();
                    *value = Complex32::new(amplitude * re, amplitude * im);
                }
            }
        });
        spectrum
    }
}

/// The transpose of an n×n matrix, in blocks that stay in the cache.
fn transposed(a: &[Complex32], n: usize) -> Vec<Complex32> {
    const BLOCK: usize = 32;
    let mut out = vec![Complex32::default(); n * n];
    out.par_chunks_mut(n * BLOCK)
        .enumerate()
        .for_each(|(k, rows)| {
            let first = k * BLOCK;
            for column in (0..n).step_by(BLOCK) {
                for (r, row) in rows.chunks_mut(n).enumerate() {
                    for c in column..(column + BLOCK).min(n) {
                        row[c] = a[c * n + first + r];
                    }
                }
            }
        });
    out
}
