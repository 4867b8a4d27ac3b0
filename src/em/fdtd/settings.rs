//! How finely a run computes, and when it stops.

use serde::{Deserialize, Serialize};

use super::SolverError;
use super::error::within;

/// Numerical settings of [`super::solve`]. Presets: [`Self::draft`], [`Self::standard`], [`Self::reference`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FdtdSettings {
    /// Largest cell in x and y in nm. The pitch is divided evenly, so no pitch is off the grid.
    pub lateral_nm: f64,
    /// Layers of the grid in one wavelength in the medium, in z, the same in every medium: at equal optical thickness
    /// on both sides an interface reflects what it should.
    pub cells_per_wavelength: f64,
    /// Layers of each absorbing end.
    pub absorbing_layers: usize,
    /// The run stops when no photodiode's P has changed by more than this in [`super::CHECK_UM`], and volume integral
    /// and flux differ by no more, twice in succession.
    pub tolerance: f64,
    /// Longest simulated time in µm/c.
    pub longest_um: f64,
}

impl FdtdSettings {
    /// Ten seconds per direction at 1.6 µm, half a minute to a minute at 2.8 and 3.5 µm. P of each half, s and p apart,
    /// is within 5.5 % of the strong half (mean of both 3.6 %) of independent curves of the 1.6 µm pixel,
    /// `benches/runs/2026-11-21/fdtd_accuracy.md`.
    pub fn draft() -> Self {
        Self {
            lateral_nm: 40.0,
            cells_per_wavelength: 8.0,
            absorbing_layers: 10,
            tolerance: 4e-3,
            longest_um: 120.0,
        }
    }

    /// Half a minute per direction at 1.6 µm; likewise within 4.1 % (mean 2.5 %), 1.6 % RMS.
    pub fn standard() -> Self {
        Self {
            lateral_nm: 32.0,
            cells_per_wavelength: 11.0,
            absorbing_layers: 12,
            tolerance: 2e-3,
            longest_um: 200.0,
        }
    }

    /// To compare others with; three to five minutes per direction at 1.6 µm. Likewise within 1.3 % (mean 1.2 %), 0.7 %
    /// RMS.
    pub fn reference() -> Self {
        Self {
            lateral_nm: 25.0,
            cells_per_wavelength: 20.0,
            absorbing_layers: 16,
            tolerance: 5e-4,
            longest_um: 400.0,
        }
    }

    /// Ranges in which the solver works.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), SolverError> {
        within("lateral_nm", self.lateral_nm, 1.0, 200.0)?;
        within(
            "cells_per_wavelength",
            self.cells_per_wavelength,
            6.0,
            100.0,
        )?;
        within("absorbing_layers", self.absorbing_layers as f64, 6.0, 100.0)?;
        within("tolerance", self.tolerance, 1e-7, 0.1)?;
        within("longest_um", self.longest_um, 1.0, 1e5)
    }
}
