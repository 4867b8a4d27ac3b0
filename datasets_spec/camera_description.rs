//! `camera.json`: what the camera of a sample knows of itself. A real camera that was measured in its laboratory would
//! come with the same file: nothing in it depends on the scene, and no truth is in it. What estimates anything from a
//! capture reads this file and not `meta.json`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Focus, Intrinsics, Response};
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

/// κ, the ratio of the disparity of two opposite halves of the pixel to the circle of confusion `coc` (px, signed,
/// positive behind the focus; SPEC.md, "Circle of confusion"), in the two directions. Without unit, and positive where
/// the halves see the sides of the pupil that their place says.
///
/// It is the distance of the response-weighted centroids of the two halves over the exit pupil, as seen from a place on
/// the sensor, over the pupil's diameter: 4/(3π) for ideal half disks. No scene goes into it, and it does not depend on
/// the amount of defocus. The lens's aberrations are not in it: they are what the traced disparity has besides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisparityRatio {
    /// Of left and right: x_L − x_R = −κ · coc (px, x to the right). `null` for a pixel of one column.
    pub left_right: Option<RatioField>,
    /// Of top and bottom: y_T − y_B = −κ · coc (px, y downwards). `null` for a pixel of one row.
    pub top_bottom: Option<RatioField>,
}

/// κ over the window: values at the nodes of a regular grid that spans it, bilinear between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RatioField {
    /// Mean over the nodes: the one number for those that need one.
    pub mean: f64,
    /// Nodes along x: the first on the outer edge of column 0, the last on that of the last column.
    pub columns: u32,
    /// Nodes along y: the first on the outer edge of row 0, the last on that of the last row.
    pub rows: u32,
    /// Values at the nodes, row by row. Where one of the halves gets no light the mean stands.
    pub values: Vec<f64>,
}

impl RatioField {
    /// A field of `columns` × `rows` nodes from its values, row by row, `None` where there is none. `None` if no node
    /// has a value, or their number does not fit.
    pub fn new(columns: u32, rows: u32, values: &[Option<f64>]) -> Option<Self> {
        let known: Vec<f64> = values.iter().flatten().copied().collect();
        let fits = values.len() as u64 == u64::from(columns) * u64::from(rows);
        if known.is_empty() || !fits {
            return None;
        }
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        let values = values.iter().map(|value| value.unwrap_or(mean)).collect();
        Some(Self {
            mean,
            columns,
            rows,
            values,
        })
    }

    /// Whether there are two nodes or more in each direction and a value at each.
    pub fn is_sound(&self) -> bool {
        let count = u64::from(self.columns) * u64::from(self.rows);
        self.columns > 1 && self.rows > 1 && self.values.len() as u64 == count
    }

    /// κ at column x and row y of a window of `width_px` × `height_px` (pixel centres have integer coordinates); beside
    /// the window that of its edge. The mean if the field is not [sound](Self::is_sound).
    pub fn at(&self, [x, y]: [f64; 2], [width_px, height_px]: [u32; 2]) -> f64 {
        if !self.is_sound() {
            return self.mean;
        }
        let cell = |at: f64, pixels: u32, nodes: u32| {
            let last = f64::from(nodes - 1);
            let place = ((at + 0.5) / f64::from(pixels) * last).clamp(0.0, last);
            let node = (place as usize).min(nodes as usize - 2);
            (node, place - node as f64)
        };
        let (i, fx) = cell(x, width_px, self.columns);
        let (j, fy) = cell(y, height_px, self.rows);
        let value = |i: usize, j: usize| self.values[j * self.columns as usize + i];
        let along = |j: usize| value(i, j) + fx * (value(i + 1, j) - value(i, j));
        along(j) + fy * (along(j + 1) - along(j))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_field_is_met_everywhere_and_held_at_the_edge() {
        let plane = |x: f64, y: f64| 0.4 + 0.01 * x - 0.02 * y + 0.003 * x * y;
        let (width, height) = (8.0, 4.0);
        // Nodes on the outer edges: x from −0.5 to 7.5, y from −0.5 to 3.5.
        let node = |k: usize| {
            let (x, y) = ((k % 3) as f64 / 2.0 * width, (k / 3) as f64 * height);
            Some(plane(x - 0.5, y - 0.5))
        };
        let field = RatioField::new(3, 2, &(0..6).map(node).collect::<Vec<_>>()).unwrap();
        for [x, y] in [[0.0, 0.0], [3.25, 1.5], [7.0, 3.0], [7.5, -0.5]] {
            let at = field.at([x, y], [8, 4]);
            assert!((at - plane(x, y)).abs() < 1e-12, "{x} {y}: {at}");
        }
        assert_eq!(
            field.at([90.0, 90.0], [8, 4]),
            *field.values.last().unwrap()
        );
    }

    #[test]
    fn a_dark_node_takes_the_mean_and_a_field_without_light_is_none() {
        let field = RatioField::new(2, 2, &[Some(0.2), None, Some(0.4), Some(0.6)]).unwrap();
        assert!((field.mean - 0.4).abs() < 1e-15 && field.values[1] == field.mean);
        assert!(RatioField::new(2, 2, &[None; 4]).is_none());
        assert!(RatioField::new(2, 2, &[Some(0.1); 3]).is_none());
        // A file may say anything: no panic.
        let broken = RatioField {
            columns: 7,
            ..field
        };
        assert_eq!(broken.at([0.0, 0.0], [4, 4]), broken.mean);
    }
}
