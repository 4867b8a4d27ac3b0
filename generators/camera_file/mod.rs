//! A camera file: what `qpgen fit` found of a real camera, as TOML, and how a dataset or a recipe takes it.
//!
//! ```text
//! camera.toml ─┬ lens: a prescription or a stand-in, scaled to the focal length, stopped to the F-number
//!              ├ pixel: layers ─▶ table of all lens shifts
//!              ├ charge: diffusion, crosstalk ─▶ added by the table's lookup
//!              ├ left_over_right ─▶ gains of the read-out, where there is one
//!              └ microlenses: where they stand beside the place that parts the light of the chief ray's cone equally
//! ```
//! What the file says replaces lens, sub-pixels, pitch, microlenses and response; all else stays.

mod error;
mod fitted;
#[cfg(test)]
mod tests;

pub use error::CameraFileError;
pub use fitted::FittedCamera;

use quadpixel::em::PixelStack;
use quadpixel::range::OutOfRange;
use quadpixel::sensor::{Charge, MicrolensLaw};
use serde::{Deserialize, Serialize};

use crate::recipe::check::F_NUMBERS;

/// The whole of `camera.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// For people.
    pub name: String,
    /// The main lens.
    pub lens: LensPart,
    /// What charge does in the silicon.
    #[serde(default)]
    pub charge: Charge,
    /// What the left half of a pixel's columns gives over the right half of the same light, 0.5 to 2.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub left_over_right: f64,
    /// Where microlenses stand beside the place at which the sub-pixels share the light equally.
    #[serde(default)]
    pub microlenses: MicrolensLaw,
    /// The layers.
    pub pixel: PixelStack,
    /// What was fitted, with deviations: for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<FittedParameter>,
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// The main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensPart {
    /// A name of `qpgen lens list`, or a .json, .zmx or .seq file beside the camera file; absent: a built-in lens
    /// stands in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The lens is scaled to this focal length, mm.
    pub focal_length_mm: f64,
    /// And stopped down to this F-number, where it opens as far.
    pub f_number: f64,
}

/// One parameter after a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedParameter {
    /// Its name, with its unit.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation, the priors included.
    pub sigma: f64,
    /// Value and deviation before.
    pub prior: [f64; 2],
    /// Whether the data hold it; if not, it is where its prior was.
    pub held_by_data: bool,
    /// Whether it lies at a bound, where its deviation says little.
    pub at_bound: bool,
}

impl CameraFile {
    fn check(&self) -> Result<(), OutOfRange> {
        self.charge.check()?;
        quadpixel::range::within("camera", "left_over_right", self.left_over_right, 0.5..=2.0)?;
        let refused = |field: &'static str, value: f64| {
            OutOfRange::new("camera", field, value, "finite and > 0")
        };
        quadpixel::range::within("camera", "lens.f_number", self.lens.f_number, F_NUMBERS)?;
        for (field, value) in [
            ("lens.focal_length_mm", self.lens.focal_length_mm),
            ("pixel.pitch_um", self.pixel.pitch_um),
        ] {
            quadpixel::range::require(value > 0.0 && value.is_finite(), || refused(field, value))?;
        }
        let (law, pitch_um) = (self.microlenses, self.pixel.pitch_um);
        for (field, value, most) in [
            ("microlenses.um", law.um, pitch_um),
            ("microlenses.um_per_mm", law.um_per_mm, 100.0),
            ("microlenses.um_per_mm3", law.um_per_mm3, 100.0),
            ("microlenses.um_per_mm5", law.um_per_mm5, 100.0),
            ("microlenses.axis_x_mm", law.axis_x_mm, 100.0),
            (
                "charge.diffusion_um",
                self.charge.diffusion_um,
                10.0 * pitch_um,
            ),
        ] {
            quadpixel::range::within("camera", field, value, -most..=most)?;
        }
        // With more of it than this a sub-pixel would have less of its own charge than of its neighbours'.
        let count = self.pixel.subpixels.count() as f64;
        let most = (count - 1.0) / count;
        quadpixel::range::within(
            "camera",
            "charge.crosstalk",
            self.charge.crosstalk,
            0.0..=most,
        )
    }
}
