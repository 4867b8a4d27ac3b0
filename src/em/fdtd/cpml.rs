//! Absorbing layers at both ends of z: convolutional PML (J. A. Roden, S. D. Gedney, Microw. Opt. Technol. Lett. 27,
//! 334 (2000)).
//!
//! ∂z becomes ∂z/s with s = κ + σ/(α − iω). In a layer of depth fraction ρ (0 at the inner face, 1 at the outer wall):
//! σ = σ_max ρ^m, κ = 1 + (κ_max − 1) ρ^m, α = α_max (1 − ρ). In time ∂z/s is ∂z/κ + ψ, with
//! ψ ← b ψ + c ∂z, b = e^(−(σ/κ + α) dt), c = σ (b − 1) / (κ (σ + κ α)).
//! σ_max is what a wave straight on, in the index n of that end, needs: |r| = e^(−2 n σ_max L / (m+1)) after L and
//! back.

use super::error::{refused, within};
use super::{SolverError, YeeGrid};

/// Depth and profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CpmlSettings {
    /// Layers at the bottom (silicon's end).
    pub below: usize,
    /// Layers at the top (air's end).
    pub above: usize,
    /// Refractive index of what fills the bottom and the top layers.
    pub index: [f64; 2],
    /// |r| of the field at normal incidence in the continuum.
    pub reflection: f64,
    /// Order m of the profile.
    pub order: f64,
    /// κ at the outer wall.
    pub kappa_max: f64,
    /// α at the inner face in 1/µm.
    pub alpha_max: f64,
}

impl CpmlSettings {
    /// `below` and `above` layers, filled with media of these indices, with a profile that suits 0 to 70° in the
    /// visible.
    pub fn new(below: usize, above: usize, index: [f64; 2]) -> Self {
        Self {
            below,
            above,
            index,
            reflection: 1e-8,
            order: 3.0,
            kappa_max: 3.0,
            alpha_max: 0.4,
        }
    }

    pub(super) fn check(&self, grid: &YeeGrid) -> Result<(), SolverError> {
        if self.below + self.above + 2 > grid.nz() {
            return Err(refused(
                "absorbing layers",
                self.below + self.above,
                format!("at most nz - 2 = {}", grid.nz() - 2),
            ));
        }
        for n in self.index {
            within("index of absorbing layers", n, 0.1, 20.0)?;
        }
        within("reflection", self.reflection, 1e-30, 1.0)?;
        within("order", self.order, 1.0, 6.0)?;
        within("kappa_max", self.kappa_max, 1.0, 100.0)?;
        within("alpha_max", self.alpha_max, 0.0, 1e3)
    }
}

/// 1/κ, b and c of one plane or layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub inverse_kappa: f64,
    pub b: f64,
    pub c: f64,
}

/// The profile at height `z_um`; `None` outside the layers.
pub(super) fn stretch(
    settings: &CpmlSettings,
    grid: &YeeGrid,
    dt_um: f64,
    z_um: f64,
) -> Option<Stretch> {
    let z = grid.z_um();
    let (bottom, top) = (z[settings.below], z[grid.nz() - settings.above]);
    let [n_bottom, n_top] = settings.index;
    let (depth, length, n) = if z_um < bottom {
        (bottom - z_um, bottom - z[0], n_bottom)
    } else if z_um > top {
        (z_um - top, z[grid.nz()] - top, n_top)
    } else {
        return None;
    };
    let rho = depth / length;
    let m = settings.order;
    let sigma_max = -(m + 1.0) * settings.reflection.ln() / (2.0 * n * length);
    let sigma = sigma_max * rho.powf(m);
    let kappa = 1.0 + (settings.kappa_max - 1.0) * rho.powf(m);
    let alpha = settings.alpha_max * (1.0 - rho);
    let b = (-(sigma / kappa + alpha) * dt_um).exp();
    let c = if sigma > 0.0 {
        sigma * (b - 1.0) / (kappa * (sigma + kappa * alpha))
    } else {
        0.0
    };
    Some(Stretch {
        inverse_kappa: 1.0 / kappa,
        b,
        c,
    })
}
