//! The main lens of a recipe.

use quadpixel::lens::{Coating, Deviation, Misalignment, ReflectionSettings};
use serde::{Deserialize, Serialize};

/// Main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensRecipe {
    /// Name in the lens library, or a `.json`, `.zmx` or `.seq` file.
    pub name: String,
    /// Scales all its lengths to this focal length, mm; absent: as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length_mm: Option<f64>,
    /// Depth that is in focus, mm from the first lens vertex; absent (or `inf`): infinity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_mm: Option<f64>,
    /// Stops the lens down to this F-number; absent: wide open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Misplaced elements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misalignments: Vec<Misalignment>,
    /// Surfaces whose radius or glass is not as prescribed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<Deviation>,
    /// What its surfaces and the sensor reflect; absent: a usual coating, and a sensor under microlenses.
    #[serde(default, skip_serializing_if = "ReflectionSettings::is_default")]
    pub reflections: ReflectionSettings,
    /// How far the sensor stands behind (+) where `focus_mm` is in focus, µm; it comes no nearer than where infinity is
    /// in focus.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub focus_error_um: f64,
}

impl LensRecipe {
    /// Whether anything in the lens reflects by its settings.
    pub(crate) fn reflects(&self) -> bool {
        self.reflections.sensor > 0.0 || self.reflections.coating != Coating::Reflectance(0.0)
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
