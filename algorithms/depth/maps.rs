//! Depth over the picture, with how far it is to be believed.

use quadpixel::image::Image;

use super::camera_curve::CameraCurve;
use super::halves::combine;
use super::shifts::Shifts;

/// Depth and what it is worth at each pixel of the sum; NaN where there is no trusted match.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMaps {
    /// Z, m.
    pub depth_m: Image,
    /// Confidence (0 to 1), standard deviation of Z (m), disparity (px).
    pub confidence: Image,
    /// Part of the pixels that have a trusted match.
    pub measured_share: f64,
}

impl DepthMaps {
    /// Names of the channels of [`Self::confidence`].
    pub const CONFIDENCE_CHANNELS: [&str; 3] = ["confidence", "sigma_m", "disparity_px"];

    /// Converts shifts by the camera's curve. The confidence is 1 − s/`deviation_limit_px`, at least 0, and 0
    /// where no point could be ([`Depth::is_possible`](super::Depth)).
    pub fn new(shifts: &Shifts, curve: &CameraCurve, deviation_limit_px: f64) -> Self {
        let [width, height] = shifts.size_px;
        let mut depth_m = Image::zeros(width, height, 1);
        let mut confidence = Image::zeros(width, height, 3);
        let mut measured = 0usize;
        let pixels = confidence.data_mut().chunks_exact_mut(3);
        for (i, (to, beside)) in depth_m.data_mut().iter_mut().zip(pixels).enumerate() {
            let at = [i % width, i / width];
            let [left_right, top_bottom] =
                [&shifts.left_right, &shifts.top_bottom].map(|s| s.as_ref().and_then(|s| s[i]));
            let shift = combine(left_right, top_bottom);
            measured += usize::from(shift.is_some());
            let depth = curve.depth(at, left_right, top_bottom);
            let depth = shift.and_then(|shift| Some((shift, depth?)));
            let Some((shift, depth)) = depth else {
                *to = f32::NAN;
                beside.copy_from_slice(&[0.0, f32::NAN, f32::NAN]);
                continue;
            };
            *to = depth.z_m as f32;
            let trust = match depth.is_possible {
                true => (1.0 - shift.sigma_px / deviation_limit_px).max(0.0),
                false => 0.0,
            };
            beside.copy_from_slice(&[
                trust as f32,
                depth.sigma_m as f32,
                shift.disparity_px as f32,
            ]);
        }
        Self {
            depth_m,
            confidence,
            measured_share: measured as f64 / (width * height) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth::{FieldCurve, Measured};

    #[test]
    fn a_shift_of_no_distance_is_given_no_confidence() {
        let curve = FieldCurve {
            source: "a test".into(),
            counted_from: "sensor".into(),
            width_px: 4,
            height_px: 1,
            inverse_distances_per_m: vec![0.5, 1.0, 2.0],
            columns_px: vec![0.0, 3.0],
            rows_px: vec![0.0],
            disparity_px: vec![vec![vec![-0.5, 0.0, 1.0]; 2]],
            relative_error: 0.0,
            offset_error_px: 0.0,
            blur_ratio: None,
            matched_window_px: None,
            matching_error_px: None,
        };
        // Infinity is at −1 px.
        let measured = [Some(0.0), Some(-1.02), Some(-1.2), None].map(|disparity| {
            disparity.map(|disparity_px| Measured {
                disparity_px,
                sigma_px: 0.02,
            })
        });
        let shifts = Shifts {
            size_px: [4, 1],
            left_right: Some(measured.to_vec()),
            top_bottom: None,
        };
        let maps = DepthMaps::new(&shifts, &CameraCurve::Field(curve), 0.1);
        let inf = f32::INFINITY;
        assert_eq!(maps.depth_m.data()[..3], [1.0, inf, inf]);
        assert!(maps.depth_m.data()[3].is_nan());
        let confidence: Vec<f32> = maps.confidence.data().iter().step_by(3).copied().collect();
        let wanted = [0.8, 0.8, 0.0, 0.0];
        let is_near = |(a, b): (&f32, f32)| (a - b).abs() < 1e-6;
        assert!(confidence.iter().zip(wanted).all(is_near), "{confidence:?}");
    }
}
