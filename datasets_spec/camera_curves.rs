//! Disparity against blur, distance and matched shift: what only a calibration of a camera knows, or its lens and
//! response.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::blur_rays::BlurRays;
use crate::matching_curve::MatchingCurves;
use crate::ratio_field::{RatioField, bilinear};

/// What of a camera's description only a calibration knows, or its lens and response.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraCurves {
    /// See [`crate::CameraDescription::disparity_ratio`].
    pub disparity_ratio: DisparityRatio,
    /// See [`crate::CameraDescription::disparity`].
    pub disparity: DisparityCurves,
    /// See [`crate::CameraDescription::matching`].
    pub matching: MatchingCurves,
    /// See [`crate::CameraDescription::blur`].
    pub blur: Option<BlurRays>,
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
        self.is_whole() && self.coefficients.iter().flatten().all(|c| c.is_finite())
    }

    fn is_whole(&self) -> bool {
        let count = u64::from(self.columns) * u64::from(self.rows);
        self.columns > 1 && self.rows > 1 && self.coefficients.len() as u64 == count
    }

    /// The coefficients at column x and row y of a window of `size_px` (pixel centres have integer coordinates); beside
    /// the window those of its edge. `None` if the curve is not [sound](Self::is_sound) around there.
    pub fn at(&self, at: [f64; 2], size_px: [u32; 2]) -> Option<[f64; 3]> {
        if !self.is_whole() {
            return None;
        }
        let nodes = [self.columns, self.rows];
        let here = bilinear(at, size_px, nodes, |i| self.coefficients[i]);
        here.iter().all(|c| c.is_finite()).then_some(here)
    }
}
