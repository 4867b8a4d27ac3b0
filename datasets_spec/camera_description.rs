//! `camera.json`: what the camera of a sample knows of itself. A real camera that was measured in its laboratory would
//! come with the same file: nothing in it depends on the scene, and no truth is in it. What estimates anything from a
//! capture reads this file and not `meta.json`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::blur_rays::BlurRays;
use crate::camera::{Focus, Intrinsics, Response};
use crate::camera_curves::{CameraCurves, DisparityCurves, DisparityRatio};
use crate::matching_curve::MatchingCurves;
use crate::subpixels::Subpixels;

/// The whole of `camera.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraDescription {
    /// Version of the layout, [`crate::SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Side of a pixel (a microlens), µm.
    pub pitch_um: f64,
    /// Sub-pixels behind each microlens.
    pub subpixels: Subpixels,
    /// Width of the window, px.
    pub width_px: u32,
    /// Height of the window, px.
    pub height_px: u32,
    /// Centre of the window from the optical axis, mm, as stored: to the right, downwards.
    pub centre_mm: [f64; 2],
    /// Names of the colour channels, in the order of raw and views.
    pub channels: Vec<String>,
    /// How the codes of the raw mosaic become linear values.
    pub raw: RawLevels,
    /// Name of the main lens.
    pub lens: String,
    /// Effective focal length, mm.
    pub efl_mm: f64,
    /// F-number at infinity, stopped down as exposed.
    pub f_number: f64,
    /// Where it is focused.
    pub focus: Focus,
    /// The paraxial pinhole of the stored images, with the entrance and the exit pupil.
    pub intrinsics: Intrinsics,
    /// What an angle of incidence does to each sub-pixel.
    pub response: Response,
    /// Disparity that a pixel of defocus gives: a constant of lens and response.
    pub disparity_ratio: DisparityRatio,
    /// Disparity against distance with the lens's aberrations, as a chart at several distances would show it.
    pub disparity: DisparityCurves,
    /// What a matcher finds in the place of the centroids' disparity.
    pub matching: MatchingCurves,
    /// The blurs of opposite halves, ray by ray; absent where nobody knows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur: Option<BlurRays>,
}

impl CameraDescription {
    /// Its curves.
    pub fn curves(&self) -> CameraCurves {
        CameraCurves {
            disparity_ratio: self.disparity_ratio.clone(),
            disparity: self.disparity.clone(),
            matching: self.matching.clone(),
            blur: self.blur.clone(),
        }
    }
}

/// How the codes of the raw mosaic become linear values: linear = (code − black) / (white − black) × `linear_at_white`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLevels {
    /// Of `raw.png` or `raw.exr`.
    pub format: RawFormat,
    /// PNG code of the linear value 0; `null` for EXR, which is linear as it is.
    pub black_level: Option<u16>,
    /// PNG code of `linear_at_white`; `null` for EXR.
    pub white_level: Option<u16>,
    /// Linear value at the white level; `null` for EXR.
    pub linear_at_white: Option<f64>,
}

/// File format of the raw mosaic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RawFormat {
    /// 16-bit integers.
    Png,
    /// Half floats.
    Exr,
}
