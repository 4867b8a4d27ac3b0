//! A spot over a pixel, from the products of its waves.
//!
//! The waves a_k of a spot at x give a half of the pixel at the origin, per light on one pixel of the period of spots,
//! ```text
//!   Q_i(x) = Σ_d g_d e^(−i d κ x),   g_d = Σ_(k' − k = d) a_k* a_k' G_i(k, k'),   κ = 2π/(pixels · pitch)
//! ```
//! g_d is what the half sees of a grating of d lines a period: its transfer function, of which g_0 is the mean over all
//! places. The model, without phases, has in the place of G the response to the mean direction times the pixel's own
//! aperture, `G_i(k, k') → P_i((k + k')/2) sinc((k' − k) pitch/2)`: each direction falls on all places of the pixel
//! alike. Both have P_i(k) on the diagonal, so g_0 is the same.

use std::f64::consts::PI;

use rustfft::num_complex::Complex64;

use super::fan::Fan;

/// Transfer of the halves, coherent and by the model.
pub(super) struct Spot {
    pitch_um: f64,
    pixels: usize,
    /// `[half][d]`, d from −2 side.
    pub coherent: [Vec<Complex64>; 2],
    pub incoherent: [Vec<Complex64>; 2],
}

/// Amplitudes of a lens of `f_number` focused at `depth_um` below the top of the microlenses, of unit power.
fn amplitudes(fan: &Fan, f_number: f64, depth_um: f64) -> Vec<Complex64> {
    let step = fan.u(fan.side + 1);
    let edge = 0.5 / f_number;
    let k0 = 2.0 * PI / fan.wavelength_um;
    let size = |u: f64| ((edge - u.abs()) / step + 0.5).clamp(0.0, 1.0);
    let u: Vec<f64> = (0..fan.count()).map(|j| fan.u(j)).collect();
    let power: f64 = u.iter().map(|u| size(*u).powi(2)).sum();
    let phase = |u: f64| Complex64::cis(-k0 * depth_um * (1.0 - u * u).sqrt());
    u.iter()
        .map(|u| phase(*u) * size(*u) / power.sqrt())
        .collect()
}

/// g_d of products `of(k, k')`.
fn transfer(a: &[Complex64], of: impl Fn(usize, usize) -> Complex64) -> Vec<Complex64> {
    let n = a.len();
    let mut g = vec![Complex64::ZERO; 2 * n - 1];
    for (j, a_j) in a.iter().enumerate() {
        for (l, a_l) in a.iter().enumerate() {
            g[l + n - 1 - j] += a_j.conj() * a_l * of(j, l);
        }
    }
    g
}

impl Spot {
    /// Of a lens of `f_number` focused at `depth_um` below the top of the microlenses; mean of both polarizations.
    pub fn new(fan: &Fan, f_number: f64, depth_um: f64) -> Self {
        let a = amplitudes(fan, f_number, depth_um);
        let n = fan.count();
        let both =
            |half: usize, at: usize| 0.5 * (fan.products[0][half][at] + fan.products[1][half][at]);
        let coherent = |half: usize| transfer(&a, |j, l| both(half, j * n + l));
        // sin x / x of half the pitch times the difference in k.
        let aperture = |d: f64| {
            let x = PI * d / fan.pixels as f64;
            if x == 0.0 { 1.0 } else { x.sin() / x }
        };
        let incoherent = |half: usize| {
            let p = |k: usize| both(half, k * n + k).re;
            let of = |j: usize, l: usize| {
                let mean = 0.5 * (p((j + l) / 2) + p((j + l).div_ceil(2)));
                Complex64::from(mean * aperture(l as f64 - j as f64))
            };
            transfer(&a, of)
        };
        Self {
            pitch_um: fan.pitch_um,
            pixels: fan.pixels,
            coherent: [0, 1].map(coherent),
            incoherent: [0, 1].map(incoherent),
        }
    }

    /// What a half of the pixel at the origin absorbs of all light of a spot at `x_um`.
    pub fn share(&self, g: &[Complex64], x_um: f64) -> f64 {
        let turn = 2.0 * PI * x_um / (self.pixels as f64 * self.pitch_um);
        let middle = (g.len() / 2) as f64;
        let term =
            |(d, g): (usize, &Complex64)| (g * Complex64::cis(-(d as f64 - middle) * turn)).re;
        g.iter().enumerate().map(term).sum::<f64>() / self.pixels as f64
    }

    /// Mean over all places of what a half absorbs, per light on the pixel.
    pub fn mean(g: &[Complex64]) -> f64 {
        g[g.len() / 2].re
    }

    /// RMS over places in the pixel of the difference of the halves' shares, over their mean by the model.
    pub fn point_error(&self, places: usize) -> f64 {
        let x = |k: usize| ((k as f64 + 0.5) / places as f64 - 0.5) * self.pitch_um;
        let (mut squares, mut light) = (0.0, 0.0);
        for half in [0, 1] {
            for k in 0..places {
                let model = self.share(&self.incoherent[half], x(k));
                squares += (self.share(&self.coherent[half], x(k)) - model).powi(2);
                light += model;
            }
        }
        let count = (2 * places) as f64;
        (squares / count).sqrt() / (light / count)
    }

    /// RMS difference of the halves' signal of a texture of points, over the RMS of the signal about its mean.
    pub fn texture_error(&self) -> f64 {
        let (mut off, mut signal) = (0.0, 0.0);
        for half in [0, 1] {
            let (c, m) = (&self.coherent[half], &self.incoherent[half]);
            for d in (0..c.len()).filter(|d| *d != c.len() / 2) {
                off += (c[d] - m[d]).norm_sqr();
                signal += m[d].norm_sqr();
            }
        }
        (off / signal).sqrt()
    }

    /// Contrast of a half at the pixels' Nyquist frequency.
    pub fn nyquist(&self, g: &[Complex64]) -> f64 {
        let at = g.len() / 2 + self.pixels / 2;
        g.get(at).map_or(0.0, |g| g.norm()) / Self::mean(g)
    }

    /// How far the right half sees to the right of the left one, px, by the longest grating.
    pub fn disparity_px(&self, of: &[Vec<Complex64>; 2]) -> f64 {
        let phase = |g: &[Complex64]| g[g.len() / 2 + 1].arg();
        (phase(&of[1]) - phase(&of[0])) * self.pixels as f64 / (2.0 * PI)
    }
}

/// Depth below the top of the microlenses at which a lens must be focused for both halves to see the same, µm.
pub(super) fn plane_um(fan: &Fan, f_number: f64) -> f64 {
    let disparity = |depth_um: f64| {
        let spot = Spot::new(fan, f_number, depth_um);
        spot.disparity_px(&spot.coherent)
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
mod tests {
    use super::*;

    /// A fan of a pixel whose halves have these P over u, without fields: what the model itself says.
    fn fan(pixels: usize, side: usize) -> Fan {
        let n = 2 * side + 1;
        let halves = |sign: f64| {
            let at = |k: usize| {
                let (a, b) = (k / n, k % n);
                // Waves that fall on a half by a prism: products of any Hermitian form will do.
                let u = 0.5 * (a + b) as f64 - side as f64;
                let p = 0.3 + sign * 0.2 * u / side as f64;
                let d = a as f64 - b as f64;
                Complex64::from_polar(p * (-0.1 * d * d).exp(), 0.07 * sign * d)
            };
            (0..n * n).map(at).collect::<Vec<_>>()
        };
        Fan {
            pitch_um: 2.0,
            wavelength_um: 0.55,
            pixels,
            side,
            products: [0, 1].map(|_| [halves(-1.0), halves(1.0)]),
        }
    }

    /// The mean over all places of what all pixels' halves absorb is the mean of P over the cone: Parseval.
    #[test]
    fn the_mean_over_the_places_is_the_incoherent_mean() {
        let fan = fan(8, 9);
        for (f_number, depth_um) in [(1.7, 0.0), (1.7, 3.0), (2.8, -1.0), (8.0, 0.5)] {
            let spot = Spot::new(&fan, f_number, depth_um);
            let a = amplitudes(&fan, f_number, depth_um);
            assert!((a.iter().map(|a| a.norm_sqr()).sum::<f64>() - 1.0).abs() < 1e-12);
            for half in [0, 1] {
                let n = fan.count();
                let cone = |k: usize| a[k].norm_sqr() * fan.products[0][half][k * n + k].re;
                let cone: f64 = (0..n).map(cone).sum();
                // Places in one pixel, and the pixels to which the light of each goes.
                let places = 16;
                let mut sum = 0.0;
                for k in 0..places {
                    for pixel in 0..fan.pixels {
                        let x_um = fan.pitch_um * (k as f64 / f64::from(places) - pixel as f64);
                        sum += spot.share(&spot.coherent[half], x_um) / f64::from(places);
                    }
                }
                assert!((sum - cone).abs() < 1e-12, "{sum} {cone}");
                for g in [&spot.coherent[half], &spot.incoherent[half]] {
                    assert!((Spot::mean(g) - cone).abs() < 1e-12);
                }
            }
        }
    }

    /// Without phases between them, waves make the box of the pixel that the diffraction of the lens blurs: of a point
    /// source in the middle, the light between the pixel's borders.
    #[test]
    fn the_model_is_the_light_of_the_diffraction_pattern_on_the_pixel() {
        let mut fan = fan(8, 9);
        let n = fan.count();
        for half in fan.products.iter_mut().flatten() {
            for k in 0..n {
                half[k * n + k] = Complex64::from(0.4);
            }
        }
        let spot = Spot::new(&fan, 2.0, 0.0);
        let a = amplitudes(&fan, 2.0, 0.0);
        let light = |x: f64| {
            let turn = 2.0 * PI * x / fan.period_um();
            let e: Complex64 = (0..n).map(|j| a[j] * Complex64::cis(j as f64 * turn)).sum();
            e.norm_sqr() / fan.period_um()
        };
        for x0 in [0.0, 0.7, 1.9] {
            let steps = 4000;
            let x = |k: usize| ((k as f64 + 0.5) / f64::from(steps) - 0.5) * fan.pitch_um - x0;
            let on_pixel: f64 = (0..steps as usize).map(|k| light(x(k))).sum::<f64>()
                * fan.pitch_um
                / f64::from(steps);
            let found = spot.share(&spot.incoherent[0], x0);
            assert!(
                (found - 0.4 * on_pixel).abs() < 1e-6,
                "{x0}: {found} {on_pixel}"
            );
        }
        // Out of focus each direction lands elsewhere: with P alike the halves still agree.
        let blurred = Spot::new(&fan, 2.0, 5.0);
        assert!(blurred.disparity_px(&blurred.incoherent).abs() < 1e-9);
    }
}
