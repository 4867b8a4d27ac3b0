//! `camera.json`: what the camera of a sample knows of itself. A real camera that was measured in its laboratory would
//! come with the same file: nothing in it depends on the scene, and no truth is in it. What estimates anything from a
//! capture reads this file and not `meta.json`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::blur_rays::BlurRays;
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
    /// Disparity against distance with the lens's aberrations, as a chart at several distances would show it.
    pub disparity: DisparityCurves,
    /// What a matcher finds in the place of the centroids' disparity.
    pub matching: MatchingCurves,
    /// The blurs of opposite halves, ray by ray; absent where nobody knows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur: Option<BlurRays>,
}

/// What of a camera's description only a calibration knows, or its lens and response.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraCurves {
    /// See [`CameraDescription::disparity_ratio`].
    pub disparity_ratio: DisparityRatio,
    /// See [`CameraDescription::disparity`].
    pub disparity: DisparityCurves,
    /// See [`CameraDescription::matching`].
    pub matching: MatchingCurves,
    /// See [`CameraDescription::blur`].
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

/// Disparity of opposite halves of the pixel against distance, over the window: of lens, aberrations and response,
/// without a scene. With t = 1/(Z + `intrinsics.pinhole_behind_vertex_m`), per metre,
///
/// ```text
/// disparity = c₀ + c₁ t + c₂ t²    px,
/// ```
///
/// the coefficients at the nodes of a regular grid that spans the window, bilinear between them. A half's is the mean
/// over its sub-pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisparityCurves {
    /// x_L − x_R of each colour channel (where they differ) and of `grey`, the luminance of a scene without colour
    /// (ITU-R BT.709); none for a pixel of one column.
    pub left_right: Vec<DisparityCurve>,
    /// y_T − y_B, as `left_right`; none for a pixel of one row.
    pub top_bottom: Vec<DisparityCurve>,
}

impl DisparityCurves {
    /// Of the curves in a direction that of a channel, or the only one.
    pub fn of_channel<'a>(
        curves: &'a [DisparityCurve],
        channel: &str,
    ) -> Option<&'a DisparityCurve> {
        let named = curves.iter().find(|curve| curve.channel == channel);
        named.or(curves.first().filter(|_| curves.len() == 1))
    }
}

/// One channel's curve; see [`DisparityCurves`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisparityCurve {
    /// `R`, `G`, `B` or `grey`.
    pub channel: String,
    /// Nodes along x: the first on the outer edge of column 0, the last on that of the last column.
    pub columns: u32,
    /// Nodes along y: the first on the outer edge of row 0, the last on that of the last row.
    pub rows: u32,
    /// c₀ (px), c₁ (px·m), c₂ (px·m²) at the nodes, row by row. Where a half gets no light their means stand.
    pub coefficients: Vec<[f64; 3]>,
    /// Largest difference, px, of curve and traced centroids at the nodes, up to circles of confusion of 64 px.
    pub fit_error_px: f64,
}

impl DisparityCurve {
    /// A curve from its coefficients at columns × rows nodes, row by row, `None` where there is none. `None` if no node
    /// has one, or their number does not fit.
    pub fn new(
        channel: &str,
        [columns, rows]: [u32; 2],
        nodes: &[Option<[f64; 3]>],
        fit_error_px: f64,
    ) -> Option<Self> {
        let known: Vec<[f64; 3]> = nodes.iter().flatten().copied().collect();
        let fits = nodes.len() as u64 == u64::from(columns) * u64::from(rows);
        if known.is_empty() || !fits {
            return None;
        }
        let mean = |k: usize| known.iter().map(|c| c[k]).sum::<f64>() / known.len() as f64;
        let means = [mean(0), mean(1), mean(2)];
        Some(Self {
            channel: channel.to_owned(),
            columns,
            rows,
            coefficients: nodes.iter().map(|c| c.unwrap_or(means)).collect(),
            fit_error_px,
        })
    }

    /// Whether there are two nodes or more in each direction and finite coefficients at each.
    pub fn is_sound(&self) -> bool {
        let count = u64::from(self.columns) * u64::from(self.rows);
        let finite = self.coefficients.iter().flatten().all(|c| c.is_finite());
        self.columns > 1 && self.rows > 1 && self.coefficients.len() as u64 == count && finite
    }

    /// The coefficients at column x and row y of a window of `size_px` (pixel centres have integer coordinates); beside
    /// the window those of its edge. `None` if the curve is not [sound](Self::is_sound).
    pub fn at(&self, at: [f64; 2], size_px: [u32; 2]) -> Option<[f64; 3]> {
        self.is_sound().then(|| {
            bilinear(at, size_px, [self.columns, self.rows], |i| {
                self.coefficients[i]
            })
        })
    }
}

/// What a matcher of the two halves' pictures finds, in the middle of the window, reference channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatchingCurves {
    /// Of x_L − x_R; `null` for a pixel of one column.
    pub left_right: Option<MatchingCurve>,
    /// Of y_T − y_B; `null` for a pixel of one row.
    pub top_bottom: Option<MatchingCurve>,
}

/// Matched against true disparity: the halves' blurs are not copies of each other, so that least squares over a window
/// of texture finds another shift than the distance of their centroids. Both grow together; linear between the samples,
/// and beyond them in the ratio of the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatchingCurve {
    /// The texture's power spectrum falls with frequency to minus this.
    pub texture_exponent: f64,
    /// Side of the matcher's window, px.
    pub window_px: f64,
    /// Distance of the centroids, px, increasing.
    pub centroid_px: Vec<f64>,
    /// What is matched, px, increasing.
    pub matched_px: Vec<f64>,
}

impl MatchingCurve {
    /// From samples of (centroid, matched), px, of which those are left out that do not grow with the centroid. `None`
    /// with fewer than two.
    pub fn new(texture_exponent: f64, window_px: f64, samples: &[[f64; 2]]) -> Option<Self> {
        let mut sorted: Vec<[f64; 2]> = (samples.iter().copied())
            .filter(|s| s.iter().all(|v| v.is_finite()))
            .collect();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut grown: Vec<[f64; 2]> = Vec::with_capacity(sorted.len());
        for s in sorted {
            if grown
                .last()
                .is_none_or(|last| s[0] > last[0] && s[1] > last[1])
            {
                grown.push(s);
            }
        }
        (grown.len() > 1).then(|| Self {
            texture_exponent,
            window_px,
            centroid_px: grown.iter().map(|s| s[0]).collect(),
            matched_px: grown.iter().map(|s| s[1]).collect(),
        })
    }

    /// Whether both lists are as long, at least two, finite and increasing.
    pub fn is_sound(&self) -> bool {
        let sound = |list: &[f64]| {
            list.len() > 1
                && list.iter().all(|v| v.is_finite())
                && list.windows(2).all(|w| w[1] > w[0])
        };
        self.centroid_px.len() == self.matched_px.len()
            && sound(&self.centroid_px)
            && sound(&self.matched_px)
    }

    /// The centroids' distance, px, where a matcher finds `matched_px`. As it is if the curve is not
    /// [sound](Self::is_sound).
    pub fn centroid_of(&self, matched_px: f64) -> f64 {
        if !self.is_sound() {
            return matched_px;
        }
        let last = self.matched_px.len() - 1;
        let k = (self.matched_px.partition_point(|&m| m < matched_px)).clamp(1, last);
        let (m, c) = (
            [self.matched_px[k - 1], self.matched_px[k]],
            [self.centroid_px[k - 1], self.centroid_px[k]],
        );
        for (end, beyond) in [
            (0, matched_px < self.matched_px[0]),
            (last, matched_px > self.matched_px[last]),
        ] {
            if beyond {
                return matched_px * self.centroid_px[end] / self.matched_px[end];
            }
        }
        c[0] + (c[1] - c[0]) * (matched_px - m[0]) / (m[1] - m[0])
    }
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
        let size_px = [width_px, height_px];
        let [value] = bilinear([x, y], size_px, [self.columns, self.rows], |i| {
            [self.values[i]]
        });
        value
    }
}

/// Values at column x and row y of a window, from `nodes` columns × rows (two or more each) that span it.
fn bilinear<const N: usize>(
    at: [f64; 2],
    size_px: [u32; 2],
    nodes: [u32; 2],
    value: impl Fn(usize) -> [f64; N],
) -> [f64; N] {
    let [(i, fx), (j, fy)] = [0, 1].map(|axis| {
        let last = f64::from(nodes[axis] - 1);
        let place = ((at[axis] + 0.5) / f64::from(size_px[axis]) * last).clamp(0.0, last);
        let node = (place as usize).min(nodes[axis] as usize - 2);
        (node, place - node as f64)
    });
    let columns = nodes[0] as usize;
    let corner = |di: usize, dj: usize| value((j + dj) * columns + i + di);
    let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
    std::array::from_fn(|k| {
        let top = a[k] + fx * (b[k] - a[k]);
        let bottom = c[k] + fx * (d[k] - c[k]);
        top + fy * (bottom - top)
    })
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
