//! A spot over a pixel, from the products of its waves.
//!
//! The waves a_k of a spot at x give a half of the pixel at the origin, per light on one pixel of the period of spots,
//! ```text
//!   Q_i(x) = Σ_d g_d e^(−i κ d·x),   g_d = Σ_(k' − k = d) a_k* a_k' G_i(k, k'),   κ = 2π/(pixels · pitch)
//! ```
//! with d = (d_x, d_y). g_d is what the half sees of a grating of d lines per period along x and y: its transfer
//! function, of which g_0 is the mean over all places. The model, without phases, has in the place of G the response
//! to the mean direction times the pixel's own aperture,
//! `G_i(k, k') → P_i((k + k')/2) sinc((k'_x − k_x) pitch/2) sinc((k'_y − k_y) pitch/2)`: each direction falls on all
//! places of the pixel alike. Both have P_i(k) on the diagonal, so g_0 is the same.

use std::f64::consts::PI;

use rustfft::num_complex::Complex64;

use super::cone::Cone;

/// Transfer of the halves, coherent and by the model.
pub(super) struct Spot {
    pub coherent: [Transfer; 2],
    pub incoherent: [Transfer; 2],
}

/// What a half sees of the gratings that a spot is made of.
pub(super) struct Transfer {
    /// Pixels from spot to spot.
    pixels: usize,
    /// Largest d along each axis.
    reach: i32,
    /// g by rows of d_x, from −reach.
    g: Vec<Complex64>,
}

/// Of spots on a line along x.
pub(super) struct Line {
    pixels: usize,
    /// Σ over d_y, from −reach.
    g: Vec<Complex64>,
}

/// Amplitudes of a lens of `f_number` focused at `depth_um` below the top of the microlenses, of unit power.
fn amplitudes(cone: &Cone, f_number: f64, depth_um: f64) -> Vec<Complex64> {
    let step = cone.step();
    let k0 = 2.0 * PI / cone.wavelength_um;
    let sine = |wave: &[i32; 2]| step * f64::from(wave[0]).hypot(f64::from(wave[1]));
    let size = |sine: f64| ((0.5 / f_number - sine) / step + 0.5).clamp(0.0, 1.0);
    let power: f64 = cone.waves.iter().map(|w| size(sine(w)).powi(2)).sum();
    let of = |wave: &[i32; 2]| {
        let s = sine(wave);
        let phase = Complex64::cis(-k0 * depth_um * (1.0 - s * s).sqrt());
        phase * size(s) / power.sqrt()
    };
    cone.waves.iter().map(of).collect()
}

impl Transfer {
    /// Of amplitudes and products `of(k, k')`.
    fn new(cone: &Cone, a: &[Complex64], of: impl Fn(usize, usize) -> Complex64) -> Self {
        let side = cone.waves.iter().flatten().map(|n| n.abs()).max();
        let reach = 2 * side.unwrap_or(0);
        let width = 2 * reach + 1;
        let mut g = vec![Complex64::ZERO; (width * width) as usize];
        for (j, (from, a_j)) in cone.waves.iter().zip(a).enumerate() {
            for (l, (to, a_l)) in cone.waves.iter().zip(a).enumerate() {
                let [x, y] = [to[0] - from[0] + reach, to[1] - from[1] + reach];
                let weight = a_j.conj() * a_l;
                if weight != Complex64::ZERO {
                    g[(x * width + y) as usize] += weight * of(j, l);
                }
            }
        }
        Self {
            pixels: cone.pixels,
            reach,
            g,
        }
    }

    fn coherent(cone: &Cone, a: &[Complex64], half: usize) -> Self {
        let n = cone.waves.len();
        Self::new(cone, a, |j, l| cone.products[half][j * n + l])
    }

    fn incoherent(cone: &Cone, a: &[Complex64], half: usize) -> Self {
        // sin x / x of half the pitch times the difference in k.
        let aperture = |d: i32| {
            let x = PI * f64::from(d) / cone.pixels as f64;
            if x == 0.0 { 1.0 } else { x.sin() / x }
        };
        Self::new(cone, a, |j, l| {
            let ([x, y], [z, w]) = (cone.waves[j], cone.waves[l]);
            let mean = cone.power(half, [x + z, y + w]);
            Complex64::from(mean * aperture(z - x) * aperture(w - y))
        })
    }

    /// g of a grating; 0 beyond those that the lens passes.
    fn at(&self, x: i32, y: i32) -> Complex64 {
        if x.abs() > self.reach || y.abs() > self.reach {
            return Complex64::ZERO;
        }
        let width = 2 * self.reach + 1;
        self.g[((x + self.reach) * width + y + self.reach) as usize]
    }

    /// Mean over all places, along x and y, of what the half absorbs, per light on the pixel.
    pub fn mean(&self) -> f64 {
        self.at(0, 0).re
    }

    /// Of spots at `y_px` from the middle of the pixel at the origin.
    pub fn line(&self, y_px: f64) -> Line {
        let turn = 2.0 * PI * y_px / self.pixels as f64;
        let all = -self.reach..=self.reach;
        let phases: Vec<Complex64> = all.map(|y| Complex64::cis(-f64::from(y) * turn)).collect();
        let row = |row: &[Complex64]| row.iter().zip(&phases).map(|(g, phase)| g * phase).sum();
        Line {
            pixels: self.pixels,
            g: self.g.chunks_exact(phases.len()).map(row).collect(),
        }
    }

    /// Contrast of gratings along x at the pixels' Nyquist frequency.
    pub fn nyquist(&self) -> f64 {
        self.at(self.pixels as i32 / 2, 0).norm() / self.mean()
    }
}

impl Line {
    /// What the half absorbs of all light of a spot at `x_px` from the middle of the pixel at the origin.
    pub fn share(&self, x_px: f64) -> f64 {
        let turn = 2.0 * PI * x_px / self.pixels as f64;
        let middle = (self.g.len() / 2) as f64;
        let term =
            |(d, g): (usize, &Complex64)| (g * Complex64::cis(-(d as f64 - middle) * turn)).re;
        self.g.iter().enumerate().map(term).sum::<f64>() / (self.pixels * self.pixels) as f64
    }
}

impl Spot {
    /// Of a lens of `f_number` focused at `depth_um` below the top of the microlenses.
    pub fn new(cone: &Cone, f_number: f64, depth_um: f64) -> Self {
        let a = amplitudes(cone, f_number, depth_um);
        Self {
            coherent: [0, 1].map(|half| Transfer::coherent(cone, &a, half)),
            incoherent: [0, 1].map(|half| Transfer::incoherent(cone, &a, half)),
        }
    }

    /// RMS over places in the pixel, so many along x and along y, of the difference of the halves' shares, over their
    /// mean by the model.
    pub fn point_error(&self, places: usize) -> f64 {
        let place = |k: usize| (k as f64 + 0.5) / places as f64 - 0.5;
        let (mut squares, mut light) = (0.0, 0.0);
        for (coherent, model) in self.coherent.iter().zip(&self.incoherent) {
            for y in (0..places).map(place) {
                let (coherent, model) = (coherent.line(y), model.line(y));
                for x in (0..places).map(place) {
                    let model = model.share(x);
                    squares += (coherent.share(x) - model).powi(2);
                    light += model;
                }
            }
        }
        let count = (2 * places * places) as f64;
        (squares / count).sqrt() / (light / count)
    }

    /// RMS difference of the halves' signal of a texture of points, over the RMS of the signal about its mean.
    pub fn texture_error(&self) -> f64 {
        let (mut off, mut signal) = (0.0, 0.0);
        for (coherent, model) in self.coherent.iter().zip(&self.incoherent) {
            for (k, (c, m)) in coherent.g.iter().zip(&model.g).enumerate() {
                if k != model.g.len() / 2 {
                    off += (c - m).norm_sqr();
                    signal += m.norm_sqr();
                }
            }
        }
        (off / signal).sqrt()
    }
}

/// How far the right half sees to the right of the left one, px, by the longest grating along x.
pub(super) fn disparity_px([left, right]: &[Transfer; 2]) -> f64 {
    let phase = |half: &Transfer| half.at(1, 0).arg();
    (phase(right) - phase(left)) * left.pixels as f64 / (2.0 * PI)
}

/// Depth below the top of the microlenses at which a lens must be focused for both halves to see the same, µm.
pub(super) fn plane_um(cone: &Cone, f_number: f64) -> f64 {
    let disparity = |depth_um: f64| {
        let a = amplitudes(cone, f_number, depth_um);
        disparity_px(&[0, 1].map(|half| Transfer::coherent(cone, &a, half)))
    };
    // The disparity is all but linear in the depth.
    let (mut a, mut b) = (0.0, 2.0);
    let (mut at_a, mut at_b) = (disparity(a), disparity(b));
    for _ in 0..20 {
        if (at_b - at_a).abs() < 1e-14 || at_b.abs() < 1e-9 {
            break;
        }
        let next = b - at_b * (b - a) / (at_b - at_a);
        (a, at_a) = (b, at_b);
        (b, at_b) = (next, disparity(next));
    }
    b
}

#[cfg(test)]
mod tests;
