//! The camera file: what a fit found, as TOML, and the pixel as a file of its own that `--pixel` takes.

use quadpixel::em::PixelStack;
use serde::Serialize;

use super::camera_model::CameraModel;
use super::capture::CaptureDescription;
use super::parameters::Name;
use super::{Fitted, FittedParameter};

/// The whole of `camera.toml`.
#[derive(Clone, Debug, Serialize)]
pub struct CameraFile {
    /// For people.
    pub name: String,
    /// The main lens.
    pub lens: LensPart,
    /// What charge does in the silicon.
    pub charge: ChargePart,
    /// Where microlenses stand.
    pub microlenses: MicrolensPart,
    /// The layers.
    pub pixel: PixelStack,
    /// Every parameter with its deviation.
    pub parameters: Vec<FittedParameter>,
}

/// The main lens, a stand-in by its aberrations.
#[derive(Clone, Debug, Serialize)]
pub struct LensPart {
    /// As its maker says, mm: no part of the fit.
    pub focal_length_mm: f64,
    /// Of the pupil's rim, as fitted.
    pub f_number: f64,
}

/// What charge does in the silicon.
#[derive(Clone, Debug, Serialize)]
pub struct ChargePart {
    /// How far it wanders, σ in µm.
    pub diffusion_um: f64,
    /// Part of either half's light that the other one gets.
    pub crosstalk: f64,
}

/// Where microlenses stand beside the place that centres the chief ray: constant + (k₁ x + k₃ x³ + k₅ x⁵), x in mm from
/// the axis.
#[derive(Clone, Debug, Serialize)]
pub struct MicrolensPart {
    /// Everywhere, µm.
    pub shift_um: f64,
    /// k₁, k₃, k₅ in µm per mm, mm³, mm⁵.
    pub polynomial: [f64; 3],
    /// Where the axis meets the sensor, mm from the picture's middle.
    pub axis_mm: [f64; 2],
}

impl CameraFile {
    /// Of a fit.
    pub fn new(description: &CaptureDescription, model: &CameraModel, fitted: &Fitted) -> Self {
        let v = |name: Name| fitted.values[name as usize];
        Self {
            name: description.camera.name.clone(),
            lens: LensPart {
                focal_length_mm: description.camera.focal_length_mm,
                f_number: v(Name::FNumber),
            },
            charge: ChargePart {
                diffusion_um: v(Name::DiffusionUm),
                crosstalk: v(Name::Crosstalk),
            },
            microlenses: MicrolensPart {
                shift_um: v(Name::ShiftUm),
                polynomial: [Name::Shift1, Name::Shift3, Name::Shift5].map(v),
                axis_mm: [Name::CentreXMm, Name::CentreYMm].map(v),
            },
            pixel: model.pixel(&fitted.values),
            parameters: fitted.table(),
        }
    }
}
