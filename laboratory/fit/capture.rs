//! Captures of a camera as files, and the description (TOML) that says what they are.

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::file::{self, FileError};
use quadpixel::range;
use serde::Deserialize;

use super::error::FitError;

/// An example of the description, with every field.
pub const EXAMPLE_TOML: &str = include_str!("capture.toml");

/// What captures of a camera are, and what is known of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureDescription {
    /// The camera.
    pub camera: CameraPart,
    /// The pictures.
    pub views: ViewsPart,
    /// Measured kernels.
    #[serde(default)]
    pub kernels: Option<FieldsPart>,
    /// Pictures of a grid of bright dots in their place ([`super::dots`]).
    #[serde(default)]
    pub dots: Option<FieldsPart>,
    /// White sheets.
    pub sheet: SheetPart,
}

/// What the maker says of the camera.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPart {
    /// A name for people.
    pub name: String,
    /// The main lens for the camera file: a built-in name, or a file beside that one; absent: a built-in one stands in.
    #[serde(default)]
    pub lens: Option<String>,
    /// Focal length, mm.
    pub focal_length_mm: f64,
    /// F-number.
    pub f_number: f64,
    /// Pitch of the microlenses, µm.
    pub pitch_um: f64,
    /// Wavelength that the channel stands for, nm.
    pub wavelength_nm: f64,
}

/// The pictures of both views.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewsPart {
    /// One pixel of them on the sensor, µm: more than the pitch where microlenses were summed.
    pub pixel_um: f64,
    /// Code of no light.
    pub black: f64,
    /// Largest code.
    pub white: f64,
}

/// Files over fields: measured kernels, `.npy` of (fields, side, side), the fields row by row; or pictures of dots,
/// 16-bit PNG or TIFF.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldsPart {
    /// File of the left view's.
    pub left: String,
    /// File of the right view's.
    pub right: String,
    /// Columns and rows of fields about the middle of the picture.
    pub grid: [usize; 2],
    /// Side of a field, px of the views.
    pub field_px: f64,
}

/// Pictures of a white sheet.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetPart {
    /// File of the left view.
    pub left: String,
    /// File of the right view.
    pub right: String,
}

impl CaptureDescription {
    /// Reads a description.
    ///
    /// # Errors
    /// A file that cannot be read or understood, or a value out of its range.
    pub fn read(path: &Path) -> Result<Self, FitError> {
        let refused = |what: String| FitError::capture(path, what);
        let text = file::read_text(path).map_err(|e| refused(unread(&e)))?;
        let this: Self = toml::from_str(&text).map_err(|e| refused(e.message().to_owned()))?;
        let checks = [
            (
                "camera.focal_length_mm",
                this.camera.focal_length_mm,
                0.5..=2000.0,
            ),
            ("camera.f_number", this.camera.f_number, 0.7..=32.0),
            ("camera.pitch_um", this.camera.pitch_um, 0.4..=20.0),
            (
                "camera.wavelength_nm",
                this.camera.wavelength_nm,
                350.0..=1000.0,
            ),
            ("views.pixel_um", this.views.pixel_um, 0.4..=200.0),
            ("views.black", this.views.black, 0.0..=65534.0),
            (
                "views.white",
                this.views.white,
                this.views.black + 1.0..=65535.0,
            ),
        ];
        for (field, value, allowed) in checks {
            range::within("capture", field, value, allowed)?;
        }
        let fields = match (&this.kernels, &this.dots) {
            (Some(fields), None) | (None, Some(fields)) => fields,
            _ => {
                let what = "has [kernels] and [dots], or neither; allowed: one of them";
                return Err(refused(what.to_owned()));
            }
        };
        range::within("capture", "field_px", fields.field_px, 1.0..=1e5)?;
        for count in fields.grid {
            range::within("capture", "grid", count as f64, 1.0..=1000.0)?;
        }
        Ok(this)
    }

    /// The pixel that the fit begins with: the paper's layers under this pitch, thinner, without walls.
    pub fn pixel(&self) -> PixelStack {
        let pitch = self.camera.pitch_um;
        let mut stack = PixelStack::paper(pitch, 0.85 * pitch, pitch, 0.6);
        stack.name.clone_from(&self.camera.name);
        stack.subpixels = quadpixel::sensor::Subpixels::DUAL_X;
        stack.trench_um = 0.0;
        if let Some(layer) = stack.layer_mut("planarization") {
            layer.thickness_um = 0.2;
        }
        stack
    }
}

/// Why a file, which is named elsewhere, cannot be read.
pub(super) fn unread(error: &FileError) -> String {
    format!("cannot {}: {}", error.action, error.cause)
}
