//! How finely the wave model computes.

use serde::{Deserialize, Serialize};

use crate::em::StackError;
use crate::range;

/// Numerical settings of [`super::WaveModel`]. Presets: [`Self::draft`], [`Self::standard`], [`Self::reference`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveSettings {
    /// Thickness of a slice of the lens in nm, at most; never more than a quarter of the wavelength in the lens.
    pub slice_nm: f64,
    /// Largest transverse wavenumber followed above the silicon, in k0. 1.6 holds all that travels in the layers.
    pub order_cutoff: f64,
    /// Largest transverse wavenumber of the trench modes' Fourier series, in n_silicon k0.
    pub silicon_cutoff: f64,
    /// Planes in the counted silicon at which the absorption is summed.
    pub absorption_planes: usize,
    /// Residual at which the lens field is accepted.
    pub tolerance: f64,
    /// How often the light that the trenches scatter back up is sent through the lens again.
    pub bounces: usize,
}

impl WaveSettings {
    /// Quick looks: within 0.05 of the reference curves.
    pub fn draft() -> Self {
        Self {
            slice_nm: 100.0,
            order_cutoff: 1.6,
            silicon_cutoff: 1.0,
            absorption_planes: 20,
            tolerance: 4e-2,
            bounces: 0,
        }
    }
    /// The default: the accuracy of the model itself.
    pub fn standard() -> Self {
        Self {
            slice_nm: 65.0,
            order_cutoff: 1.7,
            silicon_cutoff: 1.0,
            absorption_planes: 24,
            tolerance: 3e-2,
            bounces: 1,
        }
    }
    /// Converged to a few parts in a thousand.
    pub fn reference() -> Self {
        Self {
            slice_nm: 40.0,
            order_cutoff: 1.9,
            silicon_cutoff: 1.4,
            absorption_planes: 60,
            tolerance: 2e-3,
            bounces: 2,
        }
    }

    /// Ranges in which the model works.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), StackError> {
        let within = |field, value, allowed| range::within("pixel", field, value, allowed);
        within("slice_nm", self.slice_nm, 5.0..=150.0)?;
        within("order_cutoff", self.order_cutoff, 1.5..=6.0)?;
        within("silicon_cutoff", self.silicon_cutoff, 0.8..=4.0)?;
        within("tolerance", self.tolerance, 1e-8..=0.1)?;
        let planes = self.absorption_planes as f64;
        within("absorption_planes", planes, 8.0..=1000.0)?;
        Ok(within("bounces", self.bounces as f64, 0.0..=20.0)?)
    }
}
