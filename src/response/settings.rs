//! What to tabulate, and how finely.

use serde::{Deserialize, Serialize};

use super::ResponseError;
use crate::em::PixelStack;
use crate::em::fdtd::{self, FdtdSettings};
use crate::em::rcwa::{self, RcwaSettings};
use crate::em::wave::{self, WaveSettings};

/// A pixel model that is simulated, with its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelModel {
    /// The ideal box of eq. 2 ([`super::GeometricResponse`]), which a table blurs by one step: for programs that read tables.
    Geometric {
        /// Focal length of the microlens in air, µm.
        focal_length_um: f64,
    },
    /// Scalar waves ([`crate::em::wave`]).
    Wave(WaveSettings),
    /// Maxwell's equations in time ([`crate::em::fdtd`]).
    Fdtd(FdtdSettings),
    /// Maxwell's equations by Fourier modes ([`crate::em::rcwa`]).
    Rcwa(RcwaSettings),
}

impl PixelModel {
    /// Name and version, part of every table's key.
    pub fn version(&self) -> &'static str {
        match self {
            Self::Geometric { .. } => "geometric-1",
            Self::Wave(_) => wave::MODEL,
            Self::Fdtd(_) => fdtd::MODEL,
            Self::Rcwa(_) => rcwa::MODEL,
        }
    }

    /// Ranges in which the model works.
    pub fn check(&self) -> Result<(), ResponseError> {
        match self {
            Self::Geometric { focal_length_um } => {
                if *focal_length_um > 0.0 && focal_length_um.is_finite() {
                    Ok(())
                } else {
                    let allowed = "finite and > 0";
                    Err(ResponseError::value(
                        "focal_length_um",
                        focal_length_um,
                        allowed,
                    ))
                }
            }
            Self::Wave(settings) => Ok(settings.check()?),
            Self::Fdtd(settings) => Ok(settings.check()?),
            Self::Rcwa(settings) => Ok(settings.check()?),
        }
    }

    /// Whether one run answers for many wavelengths at one transverse wavevector k∥.
    pub(super) fn is_pulsed(&self) -> bool {
        match self {
            Self::Geometric { .. } | Self::Wave(_) | Self::Rcwa(_) => false,
            Self::Fdtd(_) => true,
        }
    }
}

/// What to tabulate. Presets are named constructors.
///
/// Directions are simulated on a regular grid of u and v from 0 to ±`cosine_max` in `steps` steps, up to sin θ = 0.94; table nodes
/// further out repeat it along their meridian. A model that is pulsed is run on a grid of k∥ instead, that one of the shortest
/// wavelength, and every wavelength reads its own (u, v) from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSettings {
    /// The pixel model.
    pub model: PixelModel,
    /// Wavelengths in nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Largest |u| and |v| of the table.
    pub cosine_max: f64,
    /// Simulated steps from u = 0 to `cosine_max`.
    pub steps: usize,
    /// Table steps in a simulated step.
    pub refine: usize,
}

impl TableSettings {
    /// The geometric model, its boxes' edges blurred over 0.0125 in u and v.
    pub fn geometric(focal_length_um: f64) -> Self {
        Self {
            model: PixelModel::Geometric { focal_length_um },
            steps: 64,
            refine: 1,
            ..Self::wave_draft()
        }
    }
    /// Wave model, quick looks, at 550 nm.
    pub fn wave_draft() -> Self {
        Self {
            model: PixelModel::Wave(WaveSettings::draft()),
            wavelengths_nm: vec![550.0],
            cosine_max: 0.8,
            steps: 12,
            refine: 3,
        }
    }
    /// Wave model, the default for a 3.5 µm pixel, at 550 nm. Between simulated directions the table is off by 0.5 % of its peak
    /// (rms).
    pub fn wave_standard() -> Self {
        Self {
            model: PixelModel::Wave(WaveSettings::standard()),
            steps: 16,
            refine: 4,
            ..Self::wave_draft()
        }
    }
    /// Wave model, the default for a pixel: [`Self::wave_standard`] with more directions the smaller the pixel is. Resonances in the
    /// lossless layers of small pixels are narrow in angle (a real band of wavelengths evens them out), and its directions cost
    /// less.
    pub fn wave_standard_for(stack: &PixelStack) -> Self {
        let steps = (16.0 * 3.5 / stack.pitch_um).round().clamp(12.0, 36.0);
        Self {
            steps: steps as usize,
            ..Self::wave_standard()
        }
    }
    /// Wave model, converged, at 550 nm; minutes.
    pub fn wave_reference() -> Self {
        Self {
            model: PixelModel::Wave(WaveSettings::reference()),
            steps: 40,
            refine: 3,
            ..Self::wave_draft()
        }
    }

    /// FDTD, quick looks, at 550 nm; the directions of [`Self::wave_draft`].
    pub fn fdtd_draft() -> Self {
        Self {
            model: PixelModel::Fdtd(FdtdSettings::draft()),
            ..Self::wave_draft()
        }
    }
    /// FDTD, the default, at 550 nm; the directions of [`Self::wave_standard`]. Hours.
    pub fn fdtd_standard() -> Self {
        Self {
            model: PixelModel::Fdtd(FdtdSettings::standard()),
            ..Self::wave_standard()
        }
    }
    /// FDTD, converged, at 550 nm; the directions of [`Self::wave_standard_for`]. Days.
    pub fn fdtd_reference(stack: &PixelStack) -> Self {
        Self {
            model: PixelModel::Fdtd(FdtdSettings::reference()),
            ..Self::wave_standard_for(stack)
        }
    }

    /// Fourier modes, quick looks, at 550 nm; the directions of [`Self::wave_draft`].
    pub fn rcwa_draft() -> Self {
        Self {
            model: PixelModel::Rcwa(RcwaSettings::draft()),
            ..Self::wave_draft()
        }
    }
    /// Fourier modes, the default, at 550 nm; the directions of [`Self::wave_standard_for`]. Minutes for a small pixel, hours for a large
    /// one.
    pub fn rcwa_standard_for(stack: &PixelStack) -> Self {
        Self {
            model: PixelModel::Rcwa(RcwaSettings::standard()),
            ..Self::wave_standard_for(stack)
        }
    }
    /// Fourier modes, converged, at 550 nm; the directions of [`Self::wave_reference`].
    pub fn rcwa_reference() -> Self {
        Self {
            model: PixelModel::Rcwa(RcwaSettings::reference()),
            ..Self::wave_reference()
        }
    }

    /// Ranges in which tables are made.
    pub fn check(&self) -> Result<(), ResponseError> {
        self.model.check()?;
        if !(self.cosine_max > 0.0 && self.cosine_max <= 0.99) {
            return Err(ResponseError::value(
                "cosine_max",
                self.cosine_max,
                "above 0, at most 0.99",
            ));
        }
        if !(2..=200).contains(&self.steps) {
            return Err(ResponseError::value("steps", self.steps, "2 to 200"));
        }
        if !(1..=16).contains(&self.refine) {
            return Err(ResponseError::value("refine", self.refine, "1 to 16"));
        }
        let w = &self.wavelengths_nm;
        let increasing = w.windows(2).all(|w| w[1] > w[0]);
        if w.is_empty() || !increasing || w.iter().any(|w| !(w.is_finite() && *w > 0.0)) {
            return Err(ResponseError::value(
                "wavelengths_nm",
                format!("{w:?}"),
                "at least one, positive, increasing",
            ));
        }
        Ok(())
    }

    /// Hash of model, pixel and settings: the same key means the same table.
    pub fn key(&self, stack: &PixelStack) -> String {
        let mut hash = blake3::Hasher::new();
        hash.update(self.model.version().as_bytes());
        // Debug prints every field, and f64 shortest and unambiguously.
        hash.update(format!("{stack:?}{self:?}").as_bytes());
        hash.finalize().to_hex().to_string()
    }
}
