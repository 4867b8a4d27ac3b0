//! Captures of a camera as files, and the description (TOML) that says what they are.

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::file::{self, FileError};
use quadpixel::image::{Image, raster};
use quadpixel::range;
use serde::Deserialize;

use super::error::FitError;
use super::measurements::{FieldKernels, Measurements, SheetColumn};

/// An example of the description, with every field.
pub const EXAMPLE_TOML: &str = include_str!("capture.toml");
/// Columns that a white sheet is averaged in.
const SHEET_COLUMNS: usize = 64;
/// Part of a sheet's pixels that may be at the white level.
const SATURATED: f64 = 1e-3;

/// What captures of a camera are, and what is known of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureDescription {
    /// The camera.
    pub camera: CameraPart,
    /// The pictures.
    pub views: ViewsPart,
    /// Measured kernels.
    pub kernels: KernelsPart,
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

/// Measured kernels: `.npy` of (fields, side, side), the fields row by row.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KernelsPart {
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
            ("kernels.field_px", this.kernels.field_px, 1.0..=1e5),
        ];
        for (field, value, allowed) in checks {
            range::within("capture", field, value, allowed)?;
        }
        for count in this.kernels.grid {
            range::within("capture", "kernels.grid", count as f64, 1.0..=1000.0)?;
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

    /// Reads what it names, beside `folder`.
    ///
    /// # Errors
    /// A file that cannot be used, with what would do.
    pub fn measurements(&self, folder: &Path) -> Result<Measurements, FitError> {
        let sheets = [&self.sheet.left, &self.sheet.right].map(|name| self.sheet_of(folder, name));
        let [left, right] = sheets;
        let sheets = [left?, right?];
        let size = |image: &Image| [image.width(), image.height()];
        if size(&sheets[0]) != size(&sheets[1]) {
            let [w, h] = size(&sheets[0]);
            let [other_w, other_h] = size(&sheets[1]);
            let what = format!(
                "{other_w} × {other_h} px, but the left sheet is {w} × {h} px; allowed: the same size"
            );
            return Err(FitError::capture(folder.join(&self.sheet.right), what));
        }
        let kernels =
            [&self.kernels.left, &self.kernels.right].map(|name| self.kernels_of(folder, name));
        let [left, right] = kernels;
        let ((side, left), (other, right)) = (left?, right?);
        if side != other {
            let what = format!(
                "kernels of {other} px, but the left ones have {side}; allowed: the same side"
            );
            return Err(FitError::capture(folder.join(&self.kernels.right), what));
        }
        let views = left.into_iter().zip(right).map(|(l, r)| [l, r]);
        let fields = views
            .enumerate()
            .map(|(i, views)| self.field(i, views, &sheets));
        let measured = Measurements {
            view_pixel_um: self.views.pixel_um,
            side,
            grid: self.kernels.grid,
            fields: fields.collect::<Result<_, _>>()?,
            sheet: self.columns(&sheets),
        };
        measured.check()?;
        Ok(measured)
    }

    /// Linear light of one sheet.
    fn sheet_of(&self, folder: &Path, name: &str) -> Result<Image, FitError> {
        let path = folder.join(name);
        let refused = |what: String| Err(FitError::capture(&path, what));
        let mut image = raster::read(&path)?;
        if image.channels() != 1 {
            let channels = image.channels();
            return refused(format!(
                "{channels} channels; allowed: one linear channel, such as green of the raw"
            ));
        }
        let is_8_bit = |v: &f32| (v * 255.0 - (v * 255.0).round()).abs() < 1e-4;
        if image.data().iter().all(is_8_bit) {
            return refused(
                "8-bit codes, which cameras write tone-mapped; allowed: 16-bit linear codes".into(),
            );
        }
        let (black, white) = (self.views.black, self.views.white);
        let mut full = 0usize;
        for v in image.data_mut() {
            let code = f64::from(*v) * 65535.0;
            full += usize::from(code >= white - 0.5);
            *v = ((code - black).max(0.0) / (white - black)) as f32;
        }
        let count = image.data().len();
        if full as f64 > SATURATED * count as f64 {
            let part = 100.0 * full as f64 / count as f64;
            return refused(format!(
                "{part:.1} % of the pixels are saturated (code {white} or more); allowed: 0.1 %"
            ));
        }
        if image.data().iter().all(|v| *v <= 0.0) {
            return refused(format!(
                "no code is above the black level {black}; allowed: a sheet that is lit"
            ));
        }
        Ok(image)
    }

    /// Side and kernels of one view, each of sum 1.
    fn kernels_of(&self, folder: &Path, name: &str) -> Result<(usize, Vec<Vec<f64>>), FitError> {
        let path = folder.join(name);
        let refused = |what: String| Err(FitError::capture(&path, what));
        let (shape, values) = read_npy(&path)?;
        let [columns, rows] = self.kernels.grid;
        let [count, side, other] = shape;
        if side != other || side < 5 {
            return refused(format!(
                "kernels of {side} × {other} px; allowed: squares of 5 px or more"
            ));
        }
        if count != columns * rows {
            return refused(format!(
                "{count} kernels; allowed: {columns} × {rows}, as kernels.grid says"
            ));
        }
        let mut kernels = Vec::with_capacity(count);
        for (i, k) in values.chunks_exact(side * side).enumerate() {
            let sum: f64 = k.iter().map(|v| f64::from(*v)).sum();
            if !(sum > 0.0 && sum.is_finite()) {
                return refused(format!(
                    "kernel {i} has the sum {sum}; allowed: light in every field"
                ));
            }
            let kernel: Vec<f64> = k.iter().map(|v| f64::from(*v) / sum).collect();
            let border = (0..side * side).filter(|at| {
                let (x, y) = (at % side, at / side);
                x == 0 || y == 0 || x == side - 1 || y == side - 1
            });
            let cut: f64 = border.map(|at| kernel[at].abs()).sum();
            if cut > 0.02 {
                let part = 100.0 * cut;
                return refused(format!(
                    "kernel {i} has {part:.1} % of its light on its border: it is cut off; allowed: 2 %"
                ));
            }
            kernels.push(kernel);
        }
        Ok((side, kernels))
    }

    fn field(
        &self,
        i: usize,
        views: [Vec<f64>; 2],
        sheets: &[Image; 2],
    ) -> Result<FieldKernels, FitError> {
        let [columns, rows] = self.kernels.grid;
        let from_middle =
            |k: usize, count: usize| (k as f64 + 0.5 - 0.5 * count as f64) * self.kernels.field_px;
        let place_px = [
            from_middle(i % columns, columns),
            from_middle(i / columns, rows),
        ];
        let (w, h) = (sheets[0].width(), sheets[0].height());
        let half = 0.5 * self.kernels.field_px;
        let span = |c: f64, length: usize| {
            let middle = c + 0.5 * length as f64;
            let inside = middle - half > -0.5 && middle + half < length as f64 + 0.5;
            inside
                .then(|| (middle - half).max(0.0) as usize..((middle + half) as usize).min(length))
        };
        let (Some(xs), Some(ys)) = (span(place_px[0], w), span(place_px[1], h)) else {
            let what = format!(
                "field {i} lies beside the sheet of {w} × {h} px; allowed: a grid within it"
            );
            return Err(FitError::capture(&self.kernels.left, what));
        };
        let [left, right] = [0, 1].map(|k| {
            let rows = ys.clone().map(|y| {
                xs.clone()
                    .map(|x| f64::from(sheets[k].pixel(x, y)[0]))
                    .sum::<f64>()
            });
            rows.sum::<f64>()
        });
        Ok(FieldKernels {
            place_mm: place_px.map(|c| 1e-3 * c * self.views.pixel_um),
            held_out: false,
            left_part: left / (left + right),
            views,
        })
    }

    fn columns(&self, sheets: &[Image; 2]) -> Vec<SheetColumn> {
        let (w, h) = (sheets[0].width(), sheets[0].height());
        let count = SHEET_COLUMNS.min(w);
        let light = |image: &Image, xs: std::ops::Range<usize>| {
            let column = |x: usize| (0..h).map(|y| f64::from(image.pixel(x, y)[0])).sum::<f64>();
            xs.map(column).sum::<f64>()
        };
        let column = |k: usize| {
            let xs = k * w / count..(k + 1) * w / count;
            let middle = 0.5 * (xs.start + xs.end) as f64 - 0.5 * w as f64;
            SheetColumn {
                x_mm: 1e-3 * middle * self.views.pixel_um,
                ratio: light(&sheets[0], xs.clone()) / light(&sheets[1], xs),
                held_out: false,
            }
        };
        (0..count).map(column).collect()
    }
}

/// Why a file, which is named elsewhere, cannot be read.
fn unread(error: &FileError) -> String {
    format!("cannot {}: {}", error.action, error.cause)
}

/// A `.npy` of three axes, f32 or f64.
fn read_npy(path: &Path) -> Result<([usize; 3], Vec<f32>), FitError> {
    use ndarray::ArrayView3;
    use ndarray_npy::ViewNpyExt;
    let refused = |what: String| FitError::capture(path, what);
    let bytes = file::read(path).map_err(|e| refused(unread(&e)))?;
    let shape = |shape: &[usize]| [shape[0], shape[1], shape[2]];
    if let Ok(view) = ArrayView3::<f32>::view_npy(&bytes) {
        return Ok((shape(view.shape()), view.iter().copied().collect()));
    }
    let view = ArrayView3::<f64>::view_npy(&bytes).map_err(|e| {
        refused(format!(
            "{e}; allowed: .npy of (fields, side, side), f32 or f64"
        ))
    })?;
    Ok((
        shape(view.shape()),
        view.iter().map(|v| *v as f32).collect(),
    ))
}
