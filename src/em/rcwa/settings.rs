//! How finely the Fourier modal level computes.

use serde::{Deserialize, Serialize};

use super::SolverError;
use crate::range::within;

/// Numerical settings of [`super::RcwaModel`]. Presets: [`Self::draft`], [`Self::standard`], [`Self::reference`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RcwaSettings {
    /// Thickness of a slice of the lens in nm (at most).
    pub slice_nm: f64,
    /// Largest transverse wavenumber followed above the silicon, in k0. What travels in resin of 1.56 needs 1.56.
    pub lens_cutoff: f64,
    /// Largest transverse wavenumber in a layer with metal walls, in k0.
    pub wall_cutoff: f64,
    /// Orders followed in silicon beyond all that travel in it, along an axis. The error of the trenches' fields
    /// depends on it, whatever the pitch.
    pub silicon_margin: f64,
}

impl RcwaSettings {
    /// Quick looks: P of a half within 1 % of the strong half of [`Self::reference`], s and p each, where it was
    /// measured (`benches/runs/2026-11-21/rcwa.md`).
    pub fn draft() -> Self {
        Self {
            slice_nm: 60.0,
            lens_cutoff: 1.8,
            wall_cutoff: 3.0,
            silicon_margin: 2.5,
        }
    }

    /// The default: within 0.4 %. With metal walls s beyond 20° still moves by some per cent with `wall_cutoff`.
    pub fn standard() -> Self {
        Self {
            slice_nm: 45.0,
            lens_cutoff: 2.1,
            wall_cutoff: 4.0,
            silicon_margin: 5.0,
        }
    }

    /// To compare others with: more orders and slices change P by 0.3 % of the strong half.
    pub fn reference() -> Self {
        Self {
            slice_nm: 25.0,
            lens_cutoff: 3.0,
            wall_cutoff: 6.0,
            silicon_margin: 9.0,
        }
    }

    /// Ranges in which the solver works.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), SolverError> {
        within("rcwa", "slice_nm", self.slice_nm, 2.0..=100.0)?;
        within("rcwa", "lens_cutoff", self.lens_cutoff, 1.2..=12.0)?;
        within("rcwa", "wall_cutoff", self.wall_cutoff, 1.2..=24.0)?;
        Ok(within(
            "rcwa",
            "silicon_margin",
            self.silicon_margin,
            0.0..=50.0,
        )?)
    }
}
