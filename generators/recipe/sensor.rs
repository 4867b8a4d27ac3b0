//! The sensor of a recipe.

use quadpixel::sensor::{MicrolensLaw, ShiftRule, Subpixels};
use quadpixel_datasets::MosaicPattern;
use serde::{Deserialize, Serialize};

/// Sensor window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorRecipe {
    /// Pitch of the microlenses, µm.
    pub pitch_um: f64,
    /// Sub-pixels below each microlens.
    pub subpixels: Subpixels,
    /// Microlenses in a row of the window.
    pub width: usize,
    /// Rows of microlenses in the window.
    pub height: usize,
    /// Where on the sensor the window is.
    #[serde(default)]
    pub window: WindowRecipe,
    /// How microlenses follow the chief ray.
    #[serde(default = "chief_ray")]
    pub microlens_shift: ShiftRule,
    /// By how much all microlenses are out of place besides, (x, y) µm, sensor frame.
    #[serde(default, skip_serializing_if = "is_origin")]
    pub microlens_offset_um: [f64; 2],
    /// How far microlenses stand beside where the rule puts them.
    #[serde(default, skip_serializing_if = "is_no_law")]
    pub microlens_law: MicrolensLaw,
    /// Colours of the filters over the microlenses: what such a sensor reads, beside all channels; absent: not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mosaic: Option<MosaicPattern>,
}

fn is_origin(offset: &[f64; 2]) -> bool {
    *offset == [0.0; 2]
}

pub(crate) fn is_no_law(law: &MicrolensLaw) -> bool {
    *law == MicrolensLaw::default()
}

fn chief_ray() -> ShiftRule {
    ShiftRule::ChiefRay
}

/// Where the window is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "at")]
pub enum WindowRecipe {
    /// Around the optical axis.
    #[default]
    Centre,
    /// Around a place on the sensor.
    Position {
        /// Sensor frame, mm: grows with the stored columns.
        x_mm: f64,
        /// Sensor frame, mm: grows with the stored rows.
        y_mm: f64,
    },
    /// Around the place where the main lens's chief ray arrives at this angle.
    ChiefRayAngle {
        /// Angle to the axis, deg.
        theta_deg: f64,
        /// Azimuth in the sensor frame, deg.
        phi_deg: f64,
    },
}
