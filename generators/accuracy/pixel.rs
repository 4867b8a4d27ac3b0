//! P of the small pixel from stated directions by one model after the other: what the knobs `levels` and `mesh` share.

use quadpixel::command::CommandError;
use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::response::{LitPixel, PixelModel, direction_cosines};

use super::clock::best_of;
use super::row::rms;
use super::work::{PIXEL, failed};

/// Wavelength, nm.
pub const WAVELENGTH_NM: f64 = 550.0;

/// Directions (θ, φ), deg, and P of each sub-pixel there by the reference.
pub struct Exact {
    /// The pixel.
    pub stack: PixelStack,
    directions: Vec<[f64; 2]>,
    p: Vec<f64>,
}

impl Exact {
    /// Fourier modes, preset `reference`: by itself within 0.3 % of the strong half, of independent curves within 1 % (`benches/runs/2026-11-21/rcwa.md`).
    pub fn new(directions: &[[f64; 2]], settings: RcwaSettings) -> Result<Self, CommandError> {
        let stack = PixelStack::builtin(PIXEL).map_err(failed)?;
        let model = PixelModel::Rcwa(settings);
        let (_, p) = all(
            &LitPixel::new(&stack, &model, WAVELENGTH_NM).map_err(failed)?,
            directions,
        )?;
        Ok(Self {
            stack,
            directions: directions.to_vec(),
            p,
        })
    }

    /// Seconds a direction of another model, and its error: RMS in % of the largest P.
    pub fn judge(&self, model: &PixelModel) -> Result<(f64, f64), CommandError> {
        let lit = LitPixel::new(&self.stack, model, WAVELENGTH_NM).map_err(failed)?;
        let (seconds, p) = all(&lit, &self.directions)?;
        let peak = self.p.iter().copied().fold(0.0, f64::max);
        Ok((seconds, 100.0 * rms(&p, &self.p) / peak))
    }
}

/// Seconds a direction, and P of each sub-pixel.
fn all(lit: &LitPixel, directions: &[[f64; 2]]) -> Result<(f64, Vec<f64>), CommandError> {
    let (mut seconds, mut p) = (0.0, Vec::new());
    for &[theta_deg, phi_deg] in directions {
        let [u, v] = direction_cosines(theta_deg, phi_deg);
        let (time, answer) = best_of(1, || lit.light(u, v));
        seconds += time / directions.len() as f64;
        p.extend(answer.map_err(failed)?.mean.absorbed);
    }
    Ok((seconds, p))
}
