//! What was measured of a camera: kernels of both views over the field, and how a white sheet divides between them.

use quadpixel::range::{OutOfRange, require};

use super::error::FitError;

/// Kernels of one field.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldKernels {
    /// Its place, mm on the sensor from the middle of the picture: to the right, downwards as stored.
    pub place_mm: [f64; 2],
    /// Whether it is kept out of the fit.
    pub held_out: bool,
    /// Part of the sheet's light that the left view gets there.
    pub left_part: f64,
    /// Left and right, side × side, row by row, each of sum 1.
    pub views: [Vec<f64>; 2],
}

/// Light of the white sheet in the left view over that in the right one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetColumn {
    /// Place, mm from the middle of the picture.
    pub x_mm: f64,
    /// Left over right.
    pub ratio: f64,
    /// Whether it is kept out of the fit.
    pub held_out: bool,
}

/// Shifts of a textured plane over the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneShifts {
    /// From the sensor, mm.
    pub distance_mm: f64,
    /// F-number over the camera's.
    pub stop: f64,
    /// Wavelength that its channel stands for, nm.
    pub wavelength_nm: f64,
    /// Whether it is kept out of the fit.
    pub held_out: bool,
    /// Width of the picture, mm on the sensor.
    pub width_mm: f64,
    /// Side of the windows, px of the views.
    pub window_px: f64,
    /// Row by row; those that have texture.
    pub blocks: Vec<PlaneBlock>,
}

/// A window of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneBlock {
    /// Its middle, mm on the sensor from the middle of the picture: to the right, downwards as stored.
    pub place_mm: [f64; 2],
    /// x_L − x_R, px of the views: positive for points nearer than the focus.
    pub shift_px: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
}

/// All of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    /// Pixel of the views, µm.
    pub view_pixel_um: f64,
    /// Side of the kernels, px.
    pub side: usize,
    /// Fields, columns × rows.
    pub grid: [usize; 2],
    /// Row by row.
    pub fields: Vec<FieldKernels>,
    /// From left to right.
    pub sheet: Vec<SheetColumn>,
    /// In the order of the description.
    pub planes: Vec<PlaneShifts>,
}

impl Measurements {
    /// Without kernels and sheets.
    pub fn of_planes(view_pixel_um: f64) -> Self {
        Self {
            view_pixel_um,
            side: 1,
            grid: [0, 0],
            fields: Vec::new(),
            sheet: Vec::new(),
            planes: Vec::new(),
        }
    }

    /// Checks that there is enough to fit, and nothing that no camera gives.
    ///
    /// # Errors
    /// Kernels of another size, without light or with what is no number; fewer than four fields or four columns of the
    /// sheet to fit; without these, fewer than four windows of planes.
    pub fn check(&self) -> Result<(), FitError> {
        for (i, field) in self.fields.iter().enumerate() {
            let part = field.left_part;
            require(part > 0.0 && part < 1.0, || {
                let allowed = "above 0 and below 1: light of the white sheet in both views where the field lies";
                OutOfRange::new(
                    format!("field {i}"),
                    "left part of the light",
                    part,
                    allowed,
                )
            })?;
            for (name, view) in ["left", "right"].iter().zip(&field.views) {
                let bad = |value: String, allowed: &'static str| {
                    move || OutOfRange::new(format!("{name} kernel {i}"), "values", value, allowed)
                };
                let size = view.len();
                require(
                    size == self.side * self.side,
                    bad(size.to_string(), "side × side"),
                )?;
                let sum: f64 = view.iter().sum();
                let allowed = "finite, of sum 1";
                require(
                    (sum - 1.0).abs() < 1e-3,
                    bad(format!("of sum {sum}"), allowed),
                )?;
            }
        }
        let fields = self.fields.iter().filter(|f| !f.held_out).count();
        let columns = self.sheet.iter().filter(|c| !c.held_out).count();
        let windows: usize = (self.planes.iter().filter(|p| !p.held_out))
            .map(|p| p.blocks.len())
            .sum();
        if self.fields.is_empty() && self.sheet.is_empty() {
            return match windows {
                0..4 => Err(FitError::TooLittle(format!(
                    "{windows} windows of planes with texture are to be fitted; allowed: 4 or more"
                ))),
                _ => Ok(()),
            };
        }
        if fields < 4 || columns < 4 {
            return Err(FitError::TooLittle(format!(
                "{fields} fields of kernels and {columns} columns of the white sheet are to be fitted; allowed: 4 of \
                 each or more, for lens and shift law change over the field"
            )));
        }
        let bad = self
            .sheet
            .iter()
            .find(|c| !(c.ratio > 0.0 && c.ratio.is_finite()));
        match bad {
            Some(c) => Err(OutOfRange::new("sheet", "left over right", c.ratio, "above 0").into()),
            None => Ok(()),
        }
    }

    /// With kernels under a Gaussian blur of this deviation, px.
    pub(super) fn blurred(&self, sigma_px: f64) -> Self {
        let mut all = self.clone();
        for view in all.fields.iter_mut().flat_map(|field| &mut field.views) {
            blur(view, self.side, sigma_px);
        }
        all
    }

    /// Keeps out nothing but planes of another wavelength than the camera's.
    pub fn hold_out_nothing(&mut self, wavelength_nm: f64) {
        (self.fields.iter_mut()).for_each(|field| field.held_out = false);
        (self.sheet.iter_mut()).for_each(|column| column.held_out = false);
        (self.planes.iter_mut()).for_each(|p| p.held_out = p.wavelength_nm != wavelength_nm);
    }

    /// Keeps out every other field, as the dark squares of a chessboard, and the right half of the sheet.
    pub fn hold_out_chessboard(&mut self) {
        let columns = self.grid[0];
        for (i, field) in self.fields.iter_mut().enumerate() {
            field.held_out = (i / columns + i % columns) % 2 == 1;
        }
        for column in &mut self.sheet {
            column.held_out = column.x_mm > 0.0;
        }
    }
}

/// Blurs a kernel by a Gaussian of this deviation, px, inside of its window, and makes its sum 1 again.
pub(super) fn blur(kernel: &mut [f64], side: usize, sigma_px: f64) {
    if sigma_px <= 0.0 {
        return;
    }
    let reach = (3.0 * sigma_px).ceil() as usize;
    let taps: Vec<f64> = (0..=reach)
        .map(|d| (-0.5 * (d as f64 / sigma_px).powi(2)).exp())
        .collect();
    let mut from = kernel.to_vec();
    for apart in [1, side] {
        from.copy_from_slice(kernel);
        for (i, to) in kernel.iter_mut().enumerate() {
            let place = i / apart % side;
            let first = i - place * apart;
            let near = place.saturating_sub(reach)..(place + reach + 1).min(side);
            *to = near
                .map(|k| taps[k.abs_diff(place)] * from[first + k * apart])
                .sum();
        }
    }
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|v| *v /= sum);
}

/// Σ (left + right), weighted by the sheet: what the lens alone does.
pub fn sum_of(views: &[Vec<f64>; 2], left_part: f64) -> Vec<f64> {
    let pairs = views[0].iter().zip(&views[1]);
    pairs
        .map(|(l, r)| left_part * l + (1.0 - left_part) * r)
        .collect()
}

/// Centroid of a kernel, px from its middle.
pub fn centroid_px(kernel: &[f64], side: usize) -> [f64; 2] {
    let middle = (side as f64 - 1.0) * 0.5;
    let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
    for (i, k) in kernel.iter().enumerate() {
        sum += k;
        x += k * ((i % side) as f64 - middle);
        y += k * ((i / side) as f64 - middle);
    }
    [x / sum, y / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blurs_of_gaussians_add_up_by_squares() {
        let side = 41;
        let gaussian = |sigma: f64| {
            let mut kernel: Vec<f64> = (0..side * side)
                .map(|i| {
                    let [x, y] = [i % side, i / side].map(|k| k as f64 - 20.0);
                    (-0.5 * ((x - 2.0).powi(2) + y * y) / (sigma * sigma)).exp()
                })
                .collect();
            let sum: f64 = kernel.iter().sum();
            kernel.iter_mut().for_each(|v| *v /= sum);
            kernel
        };
        let mut blurred = gaussian(3.0);
        blur(&mut blurred, side, 4.0);
        // Taps end at three deviations, the window at four.
        let most = gaussian(5.0)[20 * side + 22];
        for (b, wanted) in blurred.iter().zip(gaussian(5.0)) {
            assert!((b - wanted).abs() < 5e-3 * most, "{b} {wanted}");
        }
        let mut same = gaussian(3.0);
        blur(&mut same, side, 0.0);
        assert_eq!(same, gaussian(3.0));
    }
}
