//! From a description to measurements: the files that it names.

use std::path::Path;

use quadpixel::image::{Image, raster};
use quadpixel::{file, npy};

use super::capture::{CaptureDescription, FieldsPart, SheetPart, unread};
use super::dots;
use super::error::FitError;
use super::measurements::{FieldKernels, Measurements, SheetColumn};

/// Columns that a white sheet is averaged in.
const SHEET_COLUMNS: usize = 64;
/// Part of a sheet's pixels that may be at the white level.
const SATURATED: f64 = 1e-3;
/// Sum of the sizes of a kernel's values, over the sum of the values: below zero there is noise only.
const MOST_SIZE: f64 = 2.0;

/// Place of a field, px from the middle, and the kernels of its views.
type PlacedKernels = ([f64; 2], [Vec<f64>; 2]);

impl CaptureDescription {
    /// Reads what it names, beside `folder`.
    ///
    /// # Errors
    /// A file that cannot be used, with what would do.
    pub fn measurements(&self, folder: &Path) -> Result<Measurements, FitError> {
        let planes = self.plane_shifts(folder)?;
        let mut measured = match &self.sheet {
            Some(sheet) => self.kernels_and_sheets(folder, sheet)?,
            None => Measurements::of_planes(self.views.pixel_um),
        };
        measured.planes = planes;
        measured.check()?;
        Ok(measured)
    }

    fn kernels_and_sheets(
        &self,
        folder: &Path,
        sheet: &SheetPart,
    ) -> Result<Measurements, FitError> {
        let sheets = self.pair(folder, [&sheet.left, &sheet.right], SATURATED)?;
        if let Some(dots) = &self.dots {
            return self.dot_measurements(folder, dots, &sheets);
        }
        let given = self.kernels.as_ref();
        let given = given.ok_or_else(|| FitError::capture(folder, "there is no [kernels]"))?;
        let kernels = [&given.left, &given.right].map(|name| kernels_of(given, folder, name));
        let [left, right] = kernels;
        let ((side, left), (other, right)) = (left?, right?);
        if side != other {
            let what = format!(
                "kernels of {other} px, but the left ones have {side}; allowed: the same side"
            );
            return Err(FitError::capture(folder.join(&given.right), what));
        }
        let [columns, rows] = given.grid;
        let from_middle =
            |k: usize, count: usize| (k as f64 + 0.5 - 0.5 * count as f64) * given.field_px;
        let place_px = |i: usize| {
            [
                from_middle(i % columns, columns),
                from_middle(i / columns, rows),
            ]
        };
        let views = left.into_iter().zip(right).map(|(l, r)| [l, r]);
        let fields = views.enumerate().map(|(i, views)| (place_px(i), views));
        self.measured(side, given, fields.collect(), &sheets)
    }

    /// Of pictures of dots.
    fn dot_measurements(
        &self,
        folder: &Path,
        dots: &FieldsPart,
        sheets: &[Image; 2],
    ) -> Result<Measurements, FitError> {
        // Dots tell themselves whether they are saturated.
        let pictures = self.pair(folder, [&dots.left, &dots.right], 1.0)?;
        let size = |image: &Image| [image.width(), image.height()];
        let [w, h] = size(&pictures[0]);
        if [w, h] != size(&sheets[0]) {
            let [sheet_w, sheet_h] = size(&sheets[0]);
            let what = format!(
                "{w} × {h} px, but the sheets are {sheet_w} × {sheet_h} px; allowed: the same size"
            );
            return Err(FitError::capture(folder.join(&dots.left), what));
        }
        let [left, right] = &pictures;
        let found = dots::kernels([left, right], dots.grid, dots.field_px)
            .map_err(|what| FitError::capture(folder.join(&dots.left), what))?;
        let fields = found.fields.into_iter().map(|f| (f.place_px, f.views));
        self.measured(found.side, dots, fields.collect(), sheets)
    }

    /// From kernels and their places, px from the middle.
    fn measured(
        &self,
        side: usize,
        given: &FieldsPart,
        kernels: Vec<PlacedKernels>,
        sheets: &[Image; 2],
    ) -> Result<Measurements, FitError> {
        let fields = (kernels.into_iter().enumerate())
            .map(|(i, (place_px, views))| self.field((i, place_px), given, views, sheets));
        let measured = Measurements {
            view_pixel_um: self.views.pixel_um,
            side,
            grid: given.grid,
            fields: fields.collect::<Result<_, _>>()?,
            sheet: self.columns(sheets),
            planes: Vec::new(),
        };
        Ok(measured)
    }

    /// Linear light of left and right, of the same size; `full`: part of the pixels that may be saturated.
    fn pair(&self, folder: &Path, names: [&str; 2], full: f64) -> Result<[Image; 2], FitError> {
        let [left, right] = names.map(|name| self.linear(folder, name, full));
        let (left, right) = (left?, right?);
        let size = |image: &Image| [image.width(), image.height()];
        let ([w, h], [other_w, other_h]) = (size(&left), size(&right));
        if [w, h] != [other_w, other_h] {
            let what = format!(
                "{other_w} × {other_h} px, but the left picture is {w} × {h} px; allowed: the same size"
            );
            return Err(FitError::capture(folder.join(names[1]), what));
        }
        Ok([left, right])
    }

    /// Linear light of one picture.
    pub(super) fn linear(
        &self,
        folder: &Path,
        name: &str,
        most_full: f64,
    ) -> Result<Image, FitError> {
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
                "8-bit codes, which cameras write tone-mapped; allowed: 16-bit linear codes, or srgb = true of a [[plane]]".into(),
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
        if full as f64 > most_full * count as f64 {
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

    fn field(
        &self,
        (i, place_px): (usize, [f64; 2]),
        given: &FieldsPart,
        views: [Vec<f64>; 2],
        sheets: &[Image; 2],
    ) -> Result<FieldKernels, FitError> {
        let (w, h) = (sheets[0].width(), sheets[0].height());
        let half = 0.5 * given.field_px;
        let span = |c: f64, length: usize| {
            let middle = c + 0.5 * length as f64;
            let inside = middle - half > -0.5 && middle + half < length as f64 + 0.5;
            // Dots lie in the picture, but not in the middle of their field.
            (inside || self.dots.is_some())
                .then(|| (middle - half).max(0.0) as usize..((middle + half) as usize).min(length))
        };
        let (Some(xs), Some(ys)) = (span(place_px[0], w), span(place_px[1], h)) else {
            let what = format!(
                "field {i} lies beside the sheet of {w} × {h} px; allowed: a grid within it"
            );
            return Err(FitError::capture(&given.left, what));
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

/// Side and kernels of one view, each of sum 1.
fn kernels_of(
    given: &FieldsPart,
    folder: &Path,
    name: &str,
) -> Result<(usize, Vec<Vec<f64>>), FitError> {
    let path = folder.join(name);
    let refused = |what: String| Err(FitError::capture(&path, what));
    let (shape, values) = read_npy(&path)?;
    let [columns, rows] = given.grid;
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
        let size: f64 = kernel.iter().map(|v| v.abs()).sum();
        if size > MOST_SIZE {
            return refused(format!(
                "kernel {i} has the sum 1, but its values' sizes add up to {size:.3}; allowed: {MOST_SIZE}, the light of a point \
                 with the noise of its measurement"
            ));
        }
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

/// A `.npy` of three axes, f32 or f64.
fn read_npy(path: &Path) -> Result<([usize; 3], Vec<f32>), FitError> {
    use ndarray::Ix3;
    let refused = |what: String| FitError::capture(path, what);
    let bytes = file::read(path).map_err(|e| refused(unread(&e)))?;
    let shape = |shape: &[usize]| [shape[0], shape[1], shape[2]];
    if let Ok(view) = npy::view::<f32, Ix3>(&bytes) {
        return Ok((shape(view.shape()), view.iter().copied().collect()));
    }
    let view = npy::view::<f64, Ix3>(&bytes).map_err(|e| {
        refused(format!(
            "is no array of three axes, f32 or f64 ({e}); allowed: .npy of (fields, side, side), f32 or f64"
        ))
    })?;
    Ok((
        shape(view.shape()),
        view.iter().map(|v| *v as f32).collect(),
    ))
}
