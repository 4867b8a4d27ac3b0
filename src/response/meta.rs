//! What a table says of itself: its pixel, and how P was found.

use serde::{Deserialize, Serialize};

use super::{ChiefRayShifts, ShiftSettings, TableSettings};
use crate::em::light::CorrectionFit;
use crate::em::{PixelStack, ShiftGrid};
use crate::sensor::{Charge, MovingFrame, Subpixels};

/// How P of a table was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, from = "StoredProvenance")]
pub enum Provenance {
    /// Simulated by this program.
    Simulated(TableSettings),
    /// Read from a file of another program.
    Imported {
        /// The file's name.
        file: String,
        /// Whether the pixel's symmetry gave the directions that it did not hold.
        symmetric: bool,
    },
}

/// As it stands in files, those of earlier versions among them.
#[derive(Deserialize)]
#[serde(untagged)]
enum StoredProvenance {
    Simulated(TableSettings),
    /// Lens shifts once stood beside the table's settings.
    ShiftsBeside {
        table: TableSettings,
        per_pitch: usize,
        cone_f_number: f64,
    },
    Imported {
        file: String,
        symmetric: bool,
    },
}

impl From<StoredProvenance> for Provenance {
    fn from(stored: StoredProvenance) -> Self {
        match stored {
            StoredProvenance::Simulated(settings) => Self::Simulated(settings),
            StoredProvenance::ShiftsBeside {
                table,
                per_pitch,
                cone_f_number,
            } => Self::Simulated(TableSettings {
                shifts: Some(ShiftSettings {
                    per_pitch,
                    cone_f_number,
                }),
                ..table
            }),
            StoredProvenance::Imported { file, symmetric } => Self::Imported { file, symmetric },
        }
    }
}

impl Provenance {
    /// The settings of a simulated table.
    pub fn simulated(&self) -> Option<&TableSettings> {
        match self {
            Self::Simulated(settings) => Some(settings),
            Self::Imported { .. } => None,
        }
    }

    /// The same of another set of wavelengths.
    pub(super) fn at_wavelengths(&self, wavelengths_nm: &[f64]) -> Self {
        match self {
            Self::Simulated(settings) => Self::Simulated(TableSettings {
                wavelengths_nm: wavelengths_nm.to_vec(),
                ..settings.clone()
            }),
            imported @ Self::Imported { .. } => imported.clone(),
        }
    }
}

/// What a table says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponseMeta {
    /// Pixel model and its version, e.g. `wave-2`.
    pub model: String,
    /// How P was found.
    pub settings: Provenance,
    /// The pixel, as the model was given it.
    pub pixel: PixelStack,
    /// Pitch of the pixel in µm.
    pub pitch_um: f64,
    /// Sub-pixels (m, n).
    pub subpixels: Subpixels,
    /// How a lens shift moves the response.
    pub frame: MovingFrame,
    /// Hash (blake3, hex) of model, settings and pixel: the same key means the same table.
    pub key: String,
    /// The grid that the shifts are the octant of, of a table of shifted lenses ([`super::ShiftSettings`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift_grid: Option<ShiftGrid>,
    /// Which shift each chief ray needs, where it was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chief_ray_shifts: Option<ChiefRayShifts>,
    /// Of the corrected level, how well its fit is known at each wavelength.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub corrections: Vec<CorrectionFit>,
    /// What charge does before it is collected, which lookups add to the table's light.
    #[serde(default, skip_serializing_if = "Charge::is_none")]
    pub charge: Charge,
}
