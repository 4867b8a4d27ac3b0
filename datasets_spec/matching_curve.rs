//! Matched against true disparity.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
