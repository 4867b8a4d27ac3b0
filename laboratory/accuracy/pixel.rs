//! P of the small pixel's left and right half from stated directions by one model after the other: what the knobs
//! `levels` and `mesh` share. Halves, because light at φ = 0 lies on the border of the ideal pixel's boxes, which give
//! it all to one sub-pixel of a half.

use crate::error::LaboratoryError;
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::light::{PixelSolver, direction_cosines};
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::sensor::Subpixels;

use super::clock::best_of;
use super::row::rms;
use super::work::PIXEL;

/// Wavelength, nm.
pub const WAVELENGTH_NM: f64 = 550.0;

/// Directions (θ, φ), deg, and P of both halves there by the reference.
pub struct Exact {
    /// The pixel.
    pub stack: PixelStack,
    directions: Vec<[f64; 2]>,
    p: Vec<f64>,
}

impl Exact {
    /// Fourier modes, preset `reference`: by itself within 0.3 % of the strong half, of independent curves within 1 %
    /// (`benches/runs/2026-11-21/rcwa.md`).
    pub fn new(directions: &[[f64; 2]], settings: RcwaSettings) -> Result<Self, LaboratoryError> {
        let stack = PixelStack::builtin(PIXEL)?;
        let model = PixelModel::Rcwa(settings);
        let lit = model.solver(&stack, WAVELENGTH_NM)?;
        let (_, p) = all(lit.as_ref(), stack.subpixels, directions)?;
        Ok(Self {
            stack,
            directions: directions.to_vec(),
            p,
        })
    }

    /// Seconds a direction of another model, and its error: RMS in % of the largest P of a half.
    pub fn judge(&self, model: &PixelModel) -> Result<(f64, f64), LaboratoryError> {
        let lit = model.solver(&self.stack, WAVELENGTH_NM)?;
        let (seconds, p) = all(lit.as_ref(), self.stack.subpixels, &self.directions)?;
        let peak = self.p.iter().copied().fold(0.0, f64::max);
        Ok((seconds, 100.0 * rms(&p, &self.p) / peak))
    }
}

/// Seconds a direction, and P of the left and the right half of each.
fn all(
    lit: &dyn PixelSolver,
    subpixels: Subpixels,
    directions: &[[f64; 2]],
) -> Result<(f64, Vec<f64>), LaboratoryError> {
    let (mut seconds, mut p) = (0.0, Vec::new());
    for &[theta_deg, phi_deg] in directions {
        let [u, v] = direction_cosines(theta_deg, phi_deg);
        let (time, answer) = best_of(1, || lit.on_microlens(u, v));
        seconds += time / directions.len() as f64;
        let absorbed = answer?.mean.absorbed;
        let half = |side: f64| -> f64 {
            let own = absorbed.iter().enumerate();
            let own = own.filter(|(i, _)| subpixels.centre(*i).0 * side > 0.0);
            own.map(|(_, p)| p).sum()
        };
        p.extend([-1.0, 1.0].map(half));
    }
    Ok((seconds, p))
}
