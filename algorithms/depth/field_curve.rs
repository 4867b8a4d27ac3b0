//! A camera's disparity against distance over the field, as a JSON file: what `qpalgo depth` needs of a camera that has
//! no `camera.json`.
//!
//! ```json
//! { "source": "...", "counted_from": "sensor", "width_px": 768, "height_px": 512,
//!   "inverse_distances_per_m": [0.2, 1.0, 2.0], "columns_px": [0, 767], "rows_px": [0, 511],
//!   "disparity_px": [[[-0.8, 0, 1.2], ...], ...], "relative_error": 0.05, "offset_error_px": 0.02 }
//! ```
//!
//! D(x, y, 1/Z) = x_L − x_R at the nodes, `disparity_px[row][column][distance]`, growing with 1/Z; between nodes
//! bilinear in x and y and linear in 1/Z, beyond the ends as in the last interval. Z counts along the axis from what
//! `counted_from` says. The error of a measured D is s² + (relative_error · D)² + offset_error_px², s² the matcher's
//! variance.

use serde::{Deserialize, Serialize};

use super::curve::Depth;
use super::halves::Measured;
use crate::dense::{BlurRatio, DenseSettings, SHARP_RATIO};

/// Largest side of the views of a curve.
const MOST_SIDE_PX: usize = 32_768;

/// A curve that is no curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {what}")]
pub struct FieldCurveError {
    /// The file.
    pub file: String,
    /// Field, value and what is allowed.
    pub what: String,
}

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldCurve {
    /// What it was made from, in words.
    pub source: String,
    /// Where Z is 0, in words.
    pub counted_from: String,
    /// Columns of the views.
    pub width_px: usize,
    /// Rows of the views.
    pub height_px: usize,
    /// 1/Z of the samples, 1/m, increasing.
    pub inverse_distances_per_m: Vec<f64>,
    /// Columns of the nodes, px, increasing.
    pub columns_px: Vec<f64>,
    /// Rows of the nodes, px, increasing.
    pub rows_px: Vec<f64>,
    /// D, px: `[row][column][distance]`.
    pub disparity_px: Vec<Vec<Vec<f64>>>,
    /// Part of D by which the curve may be wrong.
    pub relative_error: f64,
    /// Offset by which D may be wrong anywhere, px.
    pub offset_error_px: f64,
    /// Ratio κ of D to the blur's diameter in the middle of the picture, which dense matching takes for the kernels;
    /// absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur_ratio: Option<f64>,
    /// D is what windows of this side match; absent: the distance of the views' centroids, which dense matching finds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matched_window_px: Option<usize>,
    /// Standard deviation of a dense match at a pixel of a textured plane, px, beside `offset_error_px` (the squares of
    /// both add); absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matching_error_px: Option<f64>,
}

impl FieldCurve {
    /// Reads and checks; `file` is what errors call it.
    ///
    /// # Errors
    /// Bad JSON, axes that do not increase, a table of another size, D that does not grow with 1/Z.
    pub fn from_json(text: &str, file: &str) -> Result<Self, FieldCurveError> {
        let bad = |what: String| FieldCurveError {
            file: file.to_owned(),
            what,
        };
        let curve: Self = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        curve.check().map_err(bad)?;
        Ok(curve)
    }

    fn check(&self) -> Result<(), String> {
        for (name, axis, least) in [
            ("inverse_distances_per_m", &self.inverse_distances_per_m, 2),
            ("columns_px", &self.columns_px, 1),
            ("rows_px", &self.rows_px, 1),
        ] {
            if axis.len() < least || !increasing(axis) {
                return Err(format!(
                    "{name} is {axis:?}; allowed: at least {least} finite numbers that increase"
                ));
            }
        }
        // A focus farther than the simulated one may put the farthest sample beyond infinity.
        let last = self.inverse_distances_per_m.len() - 1;
        let nearest = self.inverse_distances_per_m[last];
        if nearest <= 0.0 {
            return Err(format!(
                "inverse_distances_per_m ends at {nearest}; allowed: 1/Z of places in front of the camera, above 0"
            ));
        }
        for (name, side) in [("width_px", self.width_px), ("height_px", self.height_px)] {
            if !(1..=MOST_SIDE_PX).contains(&side) {
                return Err(format!("{name} is {side}; allowed: 1 to {MOST_SIDE_PX}"));
            }
        }
        if self.matched_window_px == Some(0) {
            return Err("matched_window_px is 0; allowed: the side of a window, px".to_owned());
        }
        for (name, value, most) in [
            ("relative_error", self.relative_error, 1.0),
            ("offset_error_px", self.offset_error_px, MOST_SIDE_PX as f64),
            (
                "matching_error_px",
                self.matching_error_px.unwrap_or_default(),
                MOST_SIDE_PX as f64,
            ),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(format!("{name} is {value}; allowed: 0 to {most}"));
            }
        }
        if let Some(ratio) = self.blur_ratio
            && !(ratio > 0.0 && ratio <= SHARP_RATIO)
        {
            return Err(format!(
                "blur_ratio is {ratio}; allowed: above 0 to 4/(3π) = 0.424"
            ));
        }
        let (rows, columns, samples) = (
            self.rows_px.len(),
            self.columns_px.len(),
            self.inverse_distances_per_m.len(),
        );
        let fits = |row: &Vec<Vec<f64>>| {
            row.len() == columns && row.iter().all(|node| node.len() == samples)
        };
        if self.disparity_px.len() != rows || !self.disparity_px.iter().all(fits) {
            return Err(format!(
                "disparity_px; allowed: {rows} rows of {columns} columns of {samples} numbers"
            ));
        }
        match self.disparity_px.iter().flatten().find(|d| !increasing(d)) {
            Some(d) => Err(format!(
                "disparity_px has {d:?}; allowed: finite numbers that grow with 1/Z"
            )),
            None => Ok(()),
        }
    }

    /// D at each sampled distance, at a place of the picture.
    pub fn disparities_px(&self, at_px: [f64; 2]) -> Vec<f64> {
        (0..self.inverse_distances_per_m.len())
            .map(|k| self.between_nodes(at_px, |r, c| self.disparity_px[r][c][k]))
            .collect()
    }

    /// κ at each pixel: that of the middle, times how fast D grows with 1/Z about the focus, over how fast it does in
    /// the middle, as a blur is as wide beside the middle as in it. `None` where the curve does not say κ.
    pub fn blur_ratios(&self) -> Option<BlurRatio> {
        let (width, height) = (self.width_px, self.height_px);
        let slopes: Vec<Vec<f64>> = (self.disparity_px.iter())
            .map(|row| row.iter().map(|node| self.slope_in_focus(node)).collect())
            .collect();
        let slope = |at_px: [f64; 2]| self.between_nodes(at_px, |r, c| slopes[r][c]);
        let middle = [width, height].map(|n| 0.5 * (n as f64 - 1.0));
        let scale = self.blur_ratio? / slope(middle);
        let nodes = slopes.iter().flatten();
        let mean = scale * nodes.clone().sum::<f64>() / nodes.count() as f64;
        Some(BlurRatio::of_field([width, height], mean, |x, y| {
            scale * slope([x as f64, y as f64])
        }))
    }

    /// What it tells dense matching of the camera.
    pub fn dense_settings(&self) -> DenseSettings {
        DenseSettings {
            ratio: self.blur_ratios(),
            matching_error_px: self.matching_error_px,
        }
    }

    /// ∂D/∂(1/Z) where D is 0, in the middle of the picture, px m.
    pub(super) fn slope_in_the_middle(&self) -> f64 {
        let middle = [self.width_px, self.height_px].map(|n| 0.5 * (n as f64 - 1.0));
        self.slope_in_focus(&self.disparities_px(middle))
    }

    /// ∂D/∂(1/Z) of a node where D is 0, px m.
    fn slope_in_focus(&self, node: &[f64]) -> f64 {
        let k = node.partition_point(|&d| d < 0.0).clamp(1, node.len() - 1);
        let inverse = &self.inverse_distances_per_m;
        (node[k] - node[k - 1]) / (inverse[k] - inverse[k - 1])
    }

    /// Bilinear in the values of the nodes, by their row and column.
    fn between_nodes(&self, [x, y]: [f64; 2], at: impl Fn(usize, usize) -> f64) -> f64 {
        let (c, fx) = cell(&self.columns_px, x);
        let (r, fy) = cell(&self.rows_px, y);
        let (c1, r1) = (
            (c + 1).min(self.columns_px.len() - 1),
            (r + 1).min(self.rows_px.len() - 1),
        );
        let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
        mix(
            mix(at(r, c), at(r, c1), fx),
            mix(at(r1, c), at(r1, c1), fx),
            fy,
        )
    }

    /// Depth of a measured disparity at a place of the picture, px.
    pub fn depth(&self, at_px: [f64; 2], measured: Measured) -> Depth {
        let (d, inverse) = (self.disparities_px(at_px), &self.inverse_distances_per_m);
        let k = d
            .partition_point(|&v| v < measured.disparity_px)
            .clamp(1, d.len() - 1);
        // 1/m a px.
        let slope = (inverse[k] - inverse[k - 1]) / (d[k] - d[k - 1]);
        let inverse_z = inverse[k - 1] + slope * (measured.disparity_px - d[k - 1]);
        let relative = self.relative_error * measured.disparity_px;
        let sigma_px =
            (measured.sigma_px.powi(2) + relative.powi(2) + self.offset_error_px.powi(2)).sqrt();
        Depth::of_nearness(inverse_z, slope * sigma_px, 0.0)
    }
}

fn increasing(values: &[f64]) -> bool {
    values.iter().all(|v| v.is_finite()) && values.windows(2).all(|w| w[1] > w[0])
}

/// Interval of an axis, and the fraction in it; held at the ends.
fn cell(axis: &[f64], x: f64) -> (usize, f64) {
    if axis.len() < 2 {
        return (0, 0.0);
    }
    let k = axis.partition_point(|&a| a < x).clamp(1, axis.len() - 1) - 1;
    let t = (x - axis[k]) / (axis[k + 1] - axis[k]);
    (k, t.clamp(0.0, 1.0))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// D = g(x) (1/Z − 1), g from 1 at the left to 2 at the right.
    fn curve() -> FieldCurve {
        let inverse: Vec<f64> = (1..=8).map(|i| 0.25 * f64::from(i)).collect();
        let node = |g: f64| inverse.iter().map(|i| g * (i - 1.0)).collect::<Vec<_>>();
        FieldCurve {
            source: "a test".into(),
            counted_from: "sensor".into(),
            width_px: 101,
            height_px: 51,
            columns_px: vec![0.0, 100.0],
            rows_px: vec![25.0],
            disparity_px: vec![vec![node(1.0), node(2.0)]],
            inverse_distances_per_m: inverse,
            relative_error: 0.0,
            offset_error_px: 0.0,
            blur_ratio: None,
            matched_window_px: None,
            matching_error_px: None,
        }
    }

    #[test]
    fn depth_undoes_the_curve_between_its_nodes_and_beyond_its_ends() {
        let curve = curve();
        for (x, gain) in [(0.0, 1.0), (50.0, 1.5), (80.0, 1.8), (400.0, 2.0)] {
            for z in [0.3, 0.6, 1.0, 3.1, 6.0] {
                let measured = Measured {
                    disparity_px: gain * (1.0 / z - 1.0),
                    sigma_px: 0.01,
                };
                let depth = curve.depth([x, 3.0], measured);
                assert!((depth.z_m / z - 1.0).abs() < 1e-9, "{z} at {x}");
                // dZ = Z² d(1/Z)
                assert!((depth.sigma_m / (z * z * 0.01 / gain) - 1.0).abs() < 1e-9);
            }
        }
        let beyond = Measured {
            disparity_px: -3.0,
            sigma_px: 0.01,
        };
        assert_eq!(curve.depth([0.0, 0.0], beyond).z_m, f64::INFINITY);
    }

    #[test]
    fn the_curves_own_errors_add_to_the_matchers() {
        let rough = FieldCurve {
            relative_error: 0.1,
            offset_error_px: 0.03,
            ..curve()
        };
        let measured = Measured {
            disparity_px: 0.4,
            sigma_px: 0.0,
        };
        let z = 1.0 / 1.4;
        let expected = z * z * (0.04f64.powi(2) + 0.03f64.powi(2)).sqrt();
        assert!((rough.depth([0.0, 0.0], measured).sigma_m - expected).abs() < 1e-9);
    }

    #[test]
    fn files_that_are_no_curve_are_refused_by_file_and_field() {
        let text = |change: fn(&mut FieldCurve)| {
            let mut curve = curve();
            change(&mut curve);
            serde_json::to_string(&curve).unwrap()
        };
        let whole = text(|_| ());
        assert_eq!(FieldCurve::from_json(&whole, "c.json").unwrap(), curve());
        for (bad, said) in [
            (
                text(|c| c.columns_px.reverse()),
                "columns_px is [100.0, 0.0]",
            ),
            (text(|c| c.rows_px.clear()), "rows_px is []"),
            (text(|c| c.disparity_px[0][1][3] = 9.0), "grow with 1/Z"),
            (text(|c| c.disparity_px[0].truncate(1)), "rows of 2 columns"),
            (text(|c| c.relative_error = -1.0), "relative_error is -1"),
            (text(|c| c.relative_error = 1e300), "relative_error is 1"),
            (text(|c| c.offset_error_px = 1e300), "offset_error_px is 1"),
            (text(|c| c.blur_ratio = Some(0.5)), "blur_ratio is 0.5"),
            (text(|c| c.width_px = 0), "width_px is 0"),
            (text(|c| c.height_px = 1 << 40), "height_px is 10995"),
            (text(|c| c.matched_window_px = Some(0)), "matched_window_px"),
            (
                text(|c| c.inverse_distances_per_m.iter_mut().for_each(|v| *v -= 9.0)),
                "ends at -7",
            ),
            ("{}".to_owned(), "missing field"),
        ] {
            let e = FieldCurve::from_json(&bad, "c.json")
                .unwrap_err()
                .to_string();
            assert!(e.contains("c.json") && e.contains(said), "{e}");
        }
    }

    #[test]
    fn the_ratio_follows_the_slope_over_the_picture() {
        let known = FieldCurve {
            blur_ratio: Some(0.15),
            ..curve()
        };
        let Some(BlurRatio::Field(field)) = known.blur_ratios() else {
            panic!("a curve with a ratio has one at each pixel");
        };
        // g from 1 to 2, 1.5 in the middle.
        for (x, ratio) in [(0, 0.1), (50, 0.15), (100, 0.2)] {
            assert!((field.pixel(x, 7)[0] - ratio).abs() < 1e-6, "{x}");
        }
        assert_eq!(curve().blur_ratios(), None);
    }
}
