//! Focus and gain of a real camera from planes at known distances.
//!
//! A simulated curve C(x, y, 1/Z) has the right shape where the camera differs from its simulation in where it is
//! focused and in how far its pixel parts the pupil. Both change slowly over the picture:
//!
//! ```text
//! D(x, y, 1/Z) = γ(x, y) C(x, y, 1/Z + δ(x, y))    γ: gain        δ: 1/m, focus at 1/Z_f − δ in the place of 1/Z_f
//! ```
//!
//! Each plane is measured in blocks of the picture, by the median of the trusted shifts, so that no patch of bad
//! matches counts; γ and δ are those that fit them best (see `slow_fields`). [`REGIONS`]² parts say how well. What
//! single pixels err by beside that goes into the curve, too: the floor of σ of dense matching.

mod error;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use super::field_curve::FieldCurve;
use super::halves::Measured;
use super::slow_fields::{FieldFit, SlowField, fit};
use crate::dense::{BlurRatio, SHARP_RATIO};
pub use error::CalibrateError;

/// Parts along each side of the picture that are told.
pub const REGIONS: usize = 3;
/// Blocks along x and y that are fitted.
const BLOCKS: [usize; 2] = [16, 10];
/// Nodes of a calibrated curve along x and y, at least.
const NODES: [usize; 2] = [9, 7];
/// Every so many pixels along x and y tell what matching errs by at a pixel.
const STRIDE_PX: usize = 4;
/// Part of the errors that are within one deviation.
const WITHIN: f64 = 0.6827;
/// Fewest trusted shifts in a part that count.
const LEAST_SHIFTS: usize = 16;
/// Farthest plane, m.
const MOST_M: f64 = 1e6;
/// Mean gains that a pixel could have.
const GAINS: std::ops::RangeInclusive<f64> = 0.1..=10.0;
/// Planes as near to each other as this in 1/Z, as a part of the largest, say nothing of δ.
const LEAST_SPAN: f64 = 0.1;

/// The shifts of one plane: x_L − x_R at each pixel, row-major.
#[derive(Clone, Debug)]
pub struct PlaneShifts {
    /// Its distance, m, counted as the curve counts.
    pub distance_m: f64,
    /// Columns and rows, px.
    pub size_px: [usize; 2],
    /// `None` where there is no trusted match.
    pub shifts: Vec<Option<Measured>>,
}

/// One part of a plane's picture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Part {
    /// Of the plane, m.
    pub distance_m: f64,
    /// Middle of the part, px.
    pub at_px: [f64; 2],
    /// Median of its shifts, px.
    pub measured_px: f64,
    /// By the curve as it was, px.
    pub before_px: f64,
    /// By the calibrated curve, px.
    pub after_px: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCalibration {
    /// Mean of γ over the picture and its standard deviation.
    pub gain: [f64; 2],
    /// Least and largest γ.
    pub gain_range: [f64; 2],
    /// Mean of δ over the picture and its standard deviation, 1/m.
    pub shift_per_m: [f64; 2],
    /// Least and largest δ, 1/m.
    pub shift_range_per_m: [f64; 2],
    /// Root mean square of what is left, px.
    pub rms_px: f64,
    /// The parts with enough trusted shifts.
    pub parts: Vec<Part>,
    /// The curve with both.
    pub curve: FieldCurve,
}

/// Fits focus and gain, and brings the curve to them.
///
/// # Errors
/// See [`CalibrateError`].
pub fn calibrate(
    curve: &FieldCurve,
    planes: &[PlaneShifts],
) -> Result<DepthCalibration, CalibrateError> {
    check_distances(planes)?;
    let (mut parts, mut blocks) = (Vec::new(), Vec::new());
    for plane in planes {
        parts.extend(parts_of(curve, plane, [REGIONS; 2])?);
        blocks.extend(parts_of(curve, plane, BLOCKS)?);
    }
    let FieldFit { gain, focus, sigma } = fit(curve, &blocks)?;
    if !GAINS.contains(&gain.mean()) {
        return Err(CalibrateError::NoFit(gain.mean()));
    }
    for part in parts.iter_mut().chain(&mut blocks) {
        part.after_px = gain.at(part.at_px) * value(curve, part, focus.at(part.at_px))[0];
    }
    let square = |p: &Part| (p.measured_px - p.after_px).powi(2);
    let rms_px = (blocks.iter().map(square).sum::<f64>() / blocks.len() as f64).sqrt();
    let mut curve = calibrated(curve, (&gain, &focus), sigma[0] / gain.mean(), rms_px);
    curve.matching_error_px =
        (curve.matched_window_px.is_none()).then(|| matching_error_px(&curve, planes));
    let range = |field: &SlowField| {
        let (rows, columns) = (&curve.rows_px, &curve.columns_px);
        let nodes = rows.iter().flat_map(|y| columns.iter().map(|x| [*x, *y]));
        nodes
            .map(|at_px| field.at(at_px))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                [a.min(v), b.max(v)]
            })
    };
    let gain_range = range(&gain);
    if gain_range[0] <= 0.0 {
        return Err(CalibrateError::NoFit(gain_range[0]));
    }
    Ok(DepthCalibration {
        gain: [gain.mean(), sigma[0]],
        gain_range,
        shift_per_m: [focus.mean(), sigma[1]],
        shift_range_per_m: range(&focus),
        rms_px,
        curve,
        parts,
    })
}

/// As [`calibrate`], of planes that `measured` matches by kernels of the ratios of disparity to blur that it is given:
/// the curve's, and once more those that the gain makes of them, where the curve has them and is of dense shifts.
///
/// # Errors
/// As of [`calibrate`], and those of `measured`.
pub fn calibrate_by<E: From<CalibrateError>>(
    curve: &FieldCurve,
    measured: impl Fn(Option<&BlurRatio>) -> Result<Vec<PlaneShifts>, E>,
) -> Result<DepthCalibration, E> {
    let found = calibrate(curve, &measured(curve.blur_ratios().as_ref())?)?;
    match found.curve.blur_ratios() {
        Some(ratios) if curve.matched_window_px.is_none() => {
            Ok(calibrate(curve, &measured(Some(&ratios))?)?)
        }
        _ => Ok(found),
    }
}

fn check_distances(planes: &[PlaneShifts]) -> Result<(), CalibrateError> {
    let is_distance = |z: f64| z > 0.0 && z <= MOST_M;
    if let Some(plane) = planes.iter().find(|p| !is_distance(p.distance_m)) {
        return Err(CalibrateError::Distance(plane.distance_m));
    }
    let inverse = || planes.iter().map(|p| 1.0 / p.distance_m);
    let largest = inverse().fold(0.0, f64::max);
    let least = inverse().fold(f64::INFINITY, f64::min);
    match planes.len() >= 2 && largest - least >= LEAST_SPAN * largest {
        true => Ok(()),
        false => {
            let all: Vec<String> = planes.iter().map(|p| p.distance_m.to_string()).collect();
            Err(CalibrateError::Distances(all.join(", ")))
        }
    }
}

/// The parts of a plane with enough trusted shifts, of `count` along x and y.
fn parts_of(
    curve: &FieldCurve,
    plane: &PlaneShifts,
    count: [usize; 2],
) -> Result<Vec<Part>, CalibrateError> {
    let [width, height] = plane.size_px;
    if [curve.width_px, curve.height_px] != plane.size_px {
        return Err(CalibrateError::Size {
            distance_m: plane.distance_m,
            size: format!("{width} x {height}"),
            curve: format!("{} x {}", curve.width_px, curve.height_px),
        });
    }
    let [columns, rows] = count;
    let mut shifts = vec![Vec::new(); columns * rows];
    for (i, measured) in plane.shifts.iter().enumerate() {
        let (column, row) = (i % width, i / width);
        if let Some(m) = measured {
            shifts[row * rows / height * columns + column * columns / width].push(m.disparity_px);
        }
    }
    let middle = |k: usize, of: usize, px: usize| (k as f64 + 0.5) / of as f64 * px as f64 - 0.5;
    let part = |(k, mut shifts): (usize, Vec<f64>)| {
        if shifts.len() < LEAST_SHIFTS {
            return None;
        }
        shifts.sort_by(f64::total_cmp);
        let part = Part {
            distance_m: plane.distance_m,
            at_px: [
                middle(k % columns, columns, width),
                middle(k / columns, rows, height),
            ],
            measured_px: shifts[shifts.len() / 2],
            before_px: 0.0,
            after_px: 0.0,
        };
        let before_px = value(curve, &part, 0.0)[0];
        Some(Part { before_px, ..part })
    };
    let parts: Vec<Part> = shifts.into_iter().enumerate().filter_map(part).collect();
    match parts.is_empty() {
        true => Err(CalibrateError::NoTexture(plane.distance_m)),
        false => Ok(parts),
    }
}

/// √(q² − offset²), px: q, the 68 % quantile of what single pixels of the planes are off the calibrated curve; offset,
/// what its blocks are off, which the curve's own error holds.
fn matching_error_px(curve: &FieldCurve, planes: &[PlaneShifts]) -> f64 {
    let of_plane = |plane: &PlaneShifts| -> Vec<f64> {
        let [width, height] = plane.size_px;
        let rows = (0..height).step_by(STRIDE_PX);
        rows.flat_map(|y| (0..width).step_by(STRIDE_PX).map(move |x| [x, y]))
            .filter_map(|[x, y]| {
                let measured = plane.shifts[y * width + x]?;
                let samples = curve.disparities_px([x as f64, y as f64]);
                let [wanted, _] = between(curve, &samples, 1.0 / plane.distance_m);
                Some((measured.disparity_px - wanted).abs())
            })
            .collect()
    };
    let mut errors: Vec<f64> = planes.iter().flat_map(of_plane).collect();
    errors.sort_by(f64::total_cmp);
    let at = (errors.len().saturating_sub(1) as f64 * WITHIN).round() as usize;
    let all = errors.get(at).copied().unwrap_or_default();
    (all.powi(2) - curve.offset_error_px.powi(2))
        .max(0.0)
        .sqrt()
}

/// C of the part at 1/Z + δ, and its slope.
pub(super) fn value(curve: &FieldCurve, part: &Part, delta: f64) -> [f64; 2] {
    let samples = curve.disparities_px(part.at_px);
    between(curve, &samples, 1.0 / part.distance_m + delta)
}

/// Disparity and slope at a 1/Z, by a place's samples; straight on beyond them.
fn between(curve: &FieldCurve, d: &[f64], at: f64) -> [f64; 2] {
    let inverse = &curve.inverse_distances_per_m;
    let k = inverse.partition_point(|&i| i < at).clamp(1, d.len() - 1);
    let slope = (d[k] - d[k - 1]) / (inverse[k] - inverse[k - 1]);
    [d[k - 1] + slope * (at - inverse[k - 1]), slope]
}

/// γ C(1/Z + δ), with samples at 1/Z less the mean of δ, at enough nodes for both.
fn calibrated(
    curve: &FieldCurve,
    (gain, focus): (&SlowField, &SlowField),
    relative_error: f64,
    offset_error_px: f64,
) -> FieldCurve {
    let nodes = |axis: &[f64], least: usize, px: usize| -> Vec<f64> {
        if axis.len() >= least {
            return axis.to_vec();
        }
        let last = (px - 1) as f64;
        (0..least)
            .map(|k| k as f64 / (least - 1) as f64 * last)
            .collect()
    };
    let columns_px = nodes(&curve.columns_px, NODES[0], curve.width_px);
    let rows_px = nodes(&curve.rows_px, NODES[1], curve.height_px);
    let inverse = &curve.inverse_distances_per_m;
    let node = |at_px: [f64; 2]| -> Vec<f64> {
        let (own, beside) = (gain.at(at_px), focus.at(at_px) - focus.mean());
        let before = curve.disparities_px(at_px);
        let moved = inverse.iter().map(|i| between(curve, &before, i + beside));
        moved.map(|[d, _]| own * d).collect()
    };
    let row = |y: &f64| columns_px.iter().map(|x| node([*x, *y])).collect();
    let middle = [curve.width_px, curve.height_px].map(|n| 0.5 * (n as f64 - 1.0));
    FieldCurve {
        source: format!(
            "{}; gain {:.4} and 1/Z {:+.4} per m (means) by planes at known distances",
            curve.source,
            gain.mean(),
            -focus.mean()
        ),
        inverse_distances_per_m: inverse.iter().map(|i| i - focus.mean()).collect(),
        disparity_px: rows_px.iter().map(row).collect(),
        // The blur stays as it was.
        blur_ratio: (curve.blur_ratio).map(|ratio| (gain.at(middle) * ratio).min(SHARP_RATIO)),
        relative_error,
        offset_error_px,
        columns_px,
        rows_px,
        ..curve.clone()
    }
}
