//! Captures of a camera as files, and the description (TOML) that says what they are.

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::file::{self, FileError};
use quadpixel::lens::{Lens, Prescription};
use quadpixel::range;
use quadpixel::sensor::CollectedAt;
use serde::Deserialize;

use super::conjugates::Conjugates;
use super::error::FitError;

/// Farthest plane, mm.
const MOST_DISTANCE_MM: f64 = 1e7;

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
    #[serde(default)]
    pub sheet: Option<SheetPart>,
    /// Textured planes square to the axis, at known distances.
    #[serde(default, rename = "plane")]
    pub planes: Vec<PlanePart>,
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
    /// Distance that was focused on, mm, from the sensor; of planes.
    #[serde(default)]
    pub focus_mm: Option<f64>,
    /// Where the pixel collects charge, which says how far that of each colour wanders.
    #[serde(default)]
    pub collected_at: CollectedAt,
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
    #[serde(default)]
    pub black: f64,
    /// Largest code.
    #[serde(default = "sixteen_bits")]
    pub white: f64,
}

fn sixteen_bits() -> f64 {
    65535.0
}

fn usual_window_px() -> f64 {
    64.0
}

/// Pictures of a textured plane, or shifts that were measured of one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanePart {
    /// File of the left view.
    #[serde(default)]
    pub left: Option<String>,
    /// File of the right view.
    #[serde(default)]
    pub right: Option<String>,
    /// In the place of both: x and y on the sensor from the middle of the picture (mm, to the right, downwards as
    /// stored), x_L − x_R and its standard deviation (px of the views).
    #[serde(default)]
    pub shifts: Vec<[f64; 4]>,
    /// Side of the windows that `shifts` were found in, px of the views.
    #[serde(default = "usual_window_px")]
    pub window_px: f64,
    /// From the sensor, mm.
    pub distance_mm: f64,
    /// F-number; absent: the camera's.
    #[serde(default)]
    pub f_number: Option<f64>,
    /// Whether the files are 8 or 16 bits with sRGB's curve: `views.black` and `white` say nothing of them then.
    #[serde(default)]
    pub srgb: bool,
    /// Channel of a colour picture.
    #[serde(default)]
    pub channel: PlaneChannel,
    /// Wavelength that the channel stands for, nm; absent: the camera's. Of another one planes are predicted only.
    #[serde(default)]
    pub wavelength_nm: Option<f64>,
    /// Whether the plane is kept out of the fit.
    #[serde(default)]
    pub held_out: bool,
}

/// A channel of a colour picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)] // because the names say it
pub enum PlaneChannel {
    Red,
    #[default]
    Green,
    Blue,
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
        let this: Self =
            toml::from_str(&text).map_err(|e| refused(e.to_string().trim_end().to_owned()))?;
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
            // A pixel of the views is one microlens at least.
            (
                "views.pixel_um",
                this.views.pixel_um,
                this.camera.pitch_um..=200.0,
            ),
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
        let what = match (&this.kernels, &this.dots, &this.sheet) {
            (Some(fields), None, Some(_)) | (None, Some(fields), Some(_)) => {
                range::within("capture", "field_px", fields.field_px, 1.0..=1e5)?;
                for count in fields.grid {
                    range::within("capture", "grid", count as f64, 1.0..=1000.0)?;
                }
                None
            }
            (Some(_), Some(_), _) => Some("has [kernels] and [dots]; allowed: one of them"),
            (None, None, None) if !this.planes.is_empty() => None,
            (None, None, None) => Some(
                "has nothing to fit; allowed: [kernels] or [dots] with [sheet], [[plane]], or all",
            ),
            _ => Some(
                "has one of kernels (or dots) and sheets; allowed: both or neither, beside any [[plane]]",
            ),
        };
        if let Some(what) = what {
            return Err(refused(what.to_owned()));
        }
        this.check_planes(path)?;
        Ok(this)
    }

    fn check_planes(&self, path: &Path) -> Result<(), FitError> {
        let Some(focus_mm) = self.camera.focus_mm else {
            return match self.planes.is_empty() {
                true => Ok(()),
                false => {
                    let what = "has [[plane]], but camera.focus_mm is missing; allowed: the distance that was focused on";
                    Err(FitError::capture(path, what))
                }
            };
        };
        let lens = Conjugates {
            focal_length_mm: self.camera.focal_length_mm,
            hiatus_mm: 0.0,
        };
        lens.check("camera.focus_mm", focus_mm)?;
        for plane in &self.planes {
            lens.check("plane.distance_mm", plane.distance_mm)?;
            let allowed = 0.0..=MOST_DISTANCE_MM;
            range::within("capture", "plane.distance_mm", plane.distance_mm, allowed)?;
            let f_number = plane.f_number.unwrap_or(self.camera.f_number);
            // A wider pupil than the camera's would need answers beyond its table.
            let allowed = self.camera.f_number..=64.0;
            range::within("capture", "plane.f_number", f_number, allowed)?;
            let nm = plane.wavelength_nm.unwrap_or(self.camera.wavelength_nm);
            range::within("capture", "plane.wavelength_nm", nm, 350.0..=1000.0)?;
            if plane.left.is_some() != plane.right.is_some()
                || plane.left.is_some() != plane.shifts.is_empty()
            {
                let what = "a [[plane]] has neither both views nor `shifts`, or more than one; allowed: `left` and \
                            `right`, or `shifts`";
                return Err(FitError::capture(path, what));
            }
            let within = |value, allowed| range::within("capture", "plane.shifts", value, allowed);
            range::within("capture", "plane.window_px", plane.window_px, 8.0..=1e5)?;
            // As far out as a lens sees at 63° from the axis.
            let most_mm = 2.0 * self.camera.focal_length_mm;
            for [x_mm, y_mm, shift_px, sigma_px] in &plane.shifts {
                within(*x_mm, -most_mm..=most_mm)?;
                within(*y_mm, -most_mm..=most_mm)?;
                within(*shift_px, -1e3..=1e3)?;
                within(*sigma_px, 1e-6..=1e3)?;
            }
        }
        Ok(())
    }

    /// The main lens, if its prescription is named; files are looked for beside `folder`.
    ///
    /// # Errors
    /// No such lens, or a prescription that cannot be used.
    pub fn lens(&self, folder: &Path) -> Result<Option<Lens>, FitError> {
        let Some(name) = &self.camera.lens else {
            return Ok(None);
        };
        let beside = folder.join(name);
        let found = match beside.is_file() {
            true => Prescription::named(&beside.to_string_lossy()),
            false => Prescription::named(name),
        };
        let lens = found.and_then(|p| Lens::new(&p));
        lens.map(Some)
            .map_err(|e| FitError::capture(folder.join(name), e.to_string()))
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
