//! The waveform: a Gaussian pulse whose spectrum covers the wavelengths, w(t) = exp(−(t − t0)²/2τ²) sin(ω0 (t − t0)).

use std::f64::consts::PI;
use std::sync::Arc;

use super::Waveform;
use crate::units::um_from_nm;

/// Width 1/τ of the spectrum of a run at one wavelength, in ω0: short enough to cost no time, and nothing at 0 or 2 ω0.
const RELATIVE_WIDTH: f64 = 0.15;
/// t0 in τ: the pulse starts from e^(−t0²/2τ²) = 4e-5 of its peak.
const START: f64 = 4.5;

/// A pulse and how often fields under it must be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pulse {
    /// ω0 in 1/µm.
    pub omega: f64,
    /// τ in µm/c.
    pub tau_um: f64,
    highest: f64,
}

impl Pulse {
    /// For wavelengths in nm (at least one).
    pub fn new(wavelengths_nm: &[f64]) -> Self {
        let omegas = wavelengths_nm.iter().map(|w| 2.0 * PI / um_from_nm(*w));
        let (low, high) = omegas.fold((f64::INFINITY, 0.0f64), |(a, b), w| (a.min(w), b.max(w)));
        let omega = 0.5 * (low + high);
        // At the ends of the band the spectrum is at e^(−1/2) or more.
        let width = (0.5 * (high - low))
            .max(RELATIVE_WIDTH * omega)
            .min(0.25 * omega);
        Self {
            omega,
            tau_um: 1.0 / width,
            highest: high,
        }
    }

    /// When the pulse is over, in µm/c.
    pub fn end_um(&self) -> f64 {
        2.0 * START * self.tau_um
    }

    /// Longest sampling interval in µm/c at which what folds onto the wavelengths is below the pulse's 5τ⁻¹ tail.
    pub fn sampling_um(&self) -> f64 {
        2.0 * PI / (self.highest + self.omega + 5.0 / self.tau_um)
    }

    /// w(t).
    pub fn waveform(self) -> Waveform {
        Arc::new(move |t| self.at(t))
    }

    fn at(&self, t_um: f64) -> f64 {
        let t = t_um - START * self.tau_um;
        (-0.5 * (t / self.tau_um).powi(2)).exp() * (self.omega * t).sin()
    }

    /// Σ w(t) e^(iωt) dt over the steps of a run, w taken in the middle of each.
    pub fn spectrum(&self, omega: f64, dt_um: f64) -> rustfft::num_complex::Complex64 {
        let steps = (self.end_um() / dt_um).ceil() as usize;
        (0..steps)
            .map(|n| {
                let t = (n as f64 + 0.5) * dt_um;
                rustfft::num_complex::Complex64::from_polar(self.at(t) * dt_um, omega * t)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectrum_is_the_gaussian_of_the_closed_form() {
        let p = Pulse::new(&[550.0]);
        for offset in [-1.0, 0.0, 1.0] {
            let omega = p.omega + offset / p.tau_um;
            let exact = 0.5 * p.tau_um * (2.0 * PI).sqrt() * (-0.5 * offset * offset).exp();
            assert!((p.spectrum(omega, 0.01).norm() / exact - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn sampling_leaves_the_band_alone() {
        let p = Pulse::new(&[400.0, 550.0, 700.0]);
        let dt = p.sampling_um();
        let (fine, coarse) = (
            p.spectrum(2.0 * PI / 0.55, 0.005),
            p.spectrum(2.0 * PI / 0.55, dt),
        );
        assert!((fine.norm() / coarse.norm() - 1.0).abs() < 2e-3);
    }
}
