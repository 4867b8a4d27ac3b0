//! Focus and gain of a real camera from planes at known distances.
//!
//! A simulated curve C(x, y, 1/Z) has the right shape where the camera differs from its simulation in where it is
//! focused and in how far its pixel parts the pupil, which changes slowly over the picture:
//!
//! ```text
//! D(x, y, 1/Z) = γ(x, y) C(x, y, 1/Z + δ)          γ: gain        δ: 1/m, focus at 1/Z_f − δ in the place of 1/Z_f
//! ```
//!
//! Each plane is measured in blocks of the picture, by the median of the trusted shifts, so that no patch of bad
//! matches counts; γ and δ are those that fit them best (see `gain_field`). [`REGIONS`]² parts say how well.

use super::field_curve::FieldCurve;
use super::gain_field::{GainField, GainFit};
use super::halves::Measured;
use crate::dense::{BlurRatio, SHARP_RATIO};

/// Parts along each side of the picture that are told.
pub const REGIONS: usize = 3;
/// Blocks along x and y that are fitted.
const BLOCKS: [usize; 2] = [16, 10];
/// Nodes of a calibrated curve along x and y, at least.
const NODES: [usize; 2] = [9, 7];
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
    /// δ and its standard deviation, 1/m.
    pub shift_per_m: [f64; 2],
    /// Root mean square of what is left, px.
    pub rms_px: f64,
    /// The parts with enough trusted shifts.
    pub parts: Vec<Part>,
    /// The curve with both.
    pub curve: FieldCurve,
}

/// Planes that do not tell focus and gain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Fewer than two distances, or all alike.
    #[error(
        "the distances are {0} m; allowed: two or more whose 1/Z differ by a tenth of the largest"
    )]
    Distances(String),
    /// A distance that is none.
    #[error("a distance is {0} m; allowed: above 0 to 1000000")]
    Distance(f64),
    /// A picture of another size.
    #[error("the plane at {distance_m} m has {size} px; allowed: the curve's {curve}")]
    Size {
        /// Of the plane, m.
        distance_m: f64,
        /// Of its views.
        size: String,
        /// Of the curve.
        curve: String,
    },
    /// No part of the picture has enough matches.
    #[error(
        "the plane at {0} m has no part with 16 trusted matches; allowed: a plane with texture that fills the picture"
    )]
    NoTexture(f64),
    /// The search does not end at a gain that a pixel could have.
    #[error(
        "no gain and focus fit the planes: the search ended at a gain of {0}; allowed: 0.1 to 10 (are the distances in m, and counted as the curve counts?)"
    )]
    NoFit(f64),
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
    let GainFit { gain, delta, sigma } = GainField::fit(curve, &blocks)?;
    if !GAINS.contains(&gain.mean()) {
        return Err(CalibrateError::NoFit(gain.mean()));
    }
    for part in parts.iter_mut().chain(&mut blocks) {
        part.after_px = gain.at(part.at_px) * value(curve, part, delta)[0];
    }
    let square = |p: &Part| (p.measured_px - p.after_px).powi(2);
    let rms_px = (blocks.iter().map(square).sum::<f64>() / blocks.len() as f64).sqrt();
    let curve = calibrated(curve, (&gain, delta), sigma[0] / gain.mean(), rms_px);
    let (rows, columns) = (&curve.rows_px, &curve.columns_px);
    let nodes = rows.iter().flat_map(|y| columns.iter().map(|x| [*x, *y]));
    let gains: Vec<f64> = nodes.map(|at_px| gain.at(at_px)).collect();
    let least = gains.iter().copied().fold(f64::INFINITY, f64::min);
    if least <= 0.0 {
        return Err(CalibrateError::NoFit(least));
    }
    Ok(DepthCalibration {
        gain: [gain.mean(), sigma[0]],
        gain_range: [least, gains.iter().copied().fold(0.0, f64::max)],
        shift_per_m: [delta, sigma[1]],
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

/// C of the part at 1/Z + δ, and its slope.
pub(super) fn value(curve: &FieldCurve, part: &Part, delta: f64) -> [f64; 2] {
    let (d, inverse) = (
        curve.disparities_px(part.at_px),
        &curve.inverse_distances_per_m,
    );
    let at = 1.0 / part.distance_m + delta;
    let k = inverse.partition_point(|&i| i < at).clamp(1, d.len() - 1);
    let slope = (d[k] - d[k - 1]) / (inverse[k] - inverse[k - 1]);
    [d[k - 1] + slope * (at - inverse[k - 1]), slope]
}

/// γ C(1/Z + δ): the same samples at 1/Z − δ, times γ, at enough nodes for it.
fn calibrated(
    curve: &FieldCurve,
    (gain, delta): (&GainField, f64),
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
    let node = |at_px: [f64; 2]| -> Vec<f64> {
        let own = gain.at(at_px);
        let before = curve.disparities_px(at_px).into_iter();
        before.map(|d| own * d).collect()
    };
    let row = |y: &f64| columns_px.iter().map(|x| node([*x, *y])).collect();
    let middle = [curve.width_px, curve.height_px].map(|n| 0.5 * (n as f64 - 1.0));
    let inverse = curve.inverse_distances_per_m.iter();
    FieldCurve {
        source: format!(
            "{}; gain {:.4} (mean) and 1/Z {:+.4} per m by planes at known distances",
            curve.source,
            gain.mean(),
            -delta
        ),
        inverse_distances_per_m: inverse.map(|inverse| inverse - delta).collect(),
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// D = a(x) (1/Z − 1) + (1/Z − 1)²/5: bent, and another over the field.
    fn curve() -> FieldCurve {
        let inverse: Vec<f64> = (0..=60).map(|i| 0.05 * f64::from(i)).collect();
        let node = |a: f64| {
            let d = |i: &f64| a * (i - 1.0) + 0.2 * (i - 1.0f64).powi(2);
            inverse.iter().map(d).collect::<Vec<f64>>()
        };
        FieldCurve {
            source: "a test".into(),
            counted_from: "sensor".into(),
            width_px: 90,
            height_px: 60,
            columns_px: vec![0.0, 89.0],
            rows_px: vec![0.0],
            disparity_px: vec![vec![node(2.0), node(3.0)]],
            inverse_distances_per_m: inverse,
            relative_error: 0.05,
            offset_error_px: 0.02,
            blur_ratio: None,
            matched_window_px: None,
        }
    }

    /// A gain that rises towards the sides by a fifth.
    fn risen(gain: f64, column: usize) -> f64 {
        gain * (1.0 + 0.2 * (column as f64 / 44.5 - 1.0).powi(4))
    }

    /// The shifts of a camera with another gain and focus, at each place, with one bad match of fifty.
    fn plane(distance_m: f64, gain: f64, delta: f64) -> Vec<Option<Measured>> {
        let curve = curve();
        let at = |i: usize| {
            let part = Part {
                distance_m,
                at_px: [(i % 90) as f64, (i / 90) as f64],
                measured_px: 0.0,
                before_px: 0.0,
                after_px: 0.0,
            };
            let bad = if i.is_multiple_of(50) { 3.0 } else { 0.0 };
            Some(Measured {
                disparity_px: risen(gain, i % 90) * value(&curve, &part, delta)[0] + bad,
                sigma_px: 0.01,
            })
        };
        (0..90 * 60).map(at).collect()
    }

    fn found(shifts: &[(f64, Vec<Option<Measured>>)]) -> Result<DepthCalibration, CalibrateError> {
        let planes: Vec<PlaneShifts> = shifts
            .iter()
            .map(|(distance_m, shifts)| PlaneShifts {
                distance_m: *distance_m,
                size_px: [90, 60],
                shifts: shifts.clone(),
            })
            .collect();
        calibrate(&curve(), &planes)
    }

    #[test]
    fn two_planes_give_back_focus_and_gain_over_the_picture_and_a_third_is_predicted() {
        let (gain, delta) = (1.13, -0.045);
        let made = [0.6, 1.5].map(|z| (z, plane(z, gain, delta)));
        let found = found(&made).unwrap();
        // The mean of the fourth power is a fifth; blocks of five pixels have its mean, not its middle.
        let [mean, sides] = [gain * (1.0 + 0.2 / 5.0), gain * 1.2];
        assert!((found.gain[0] - mean).abs() < 4e-3, "{:?}", found.gain);
        let [least, largest] = found.gain_range;
        assert!((least - gain).abs() < 0.01 && (largest - sides).abs() < 0.03);
        let error = (found.shift_per_m[0] - delta).abs();
        assert!(error < 2e-3, "{:?}", found.shift_per_m);
        assert!(found.rms_px < 5e-3 && found.parts.len() == 18);
        let third = plane(0.9, gain, delta);
        for at in [[10.0, 5.0], [44.0, 30.0], [80.0, 50.0]] {
            let measured = third[at[1] as usize * 90 + at[0] as usize + 1].unwrap();
            let z = found.curve.depth(at, measured).z_m;
            assert!((z / 0.9 - 1.0).abs() < 0.01, "{z} at {at:?}");
        }
    }

    #[test]
    fn planes_are_matched_again_by_the_ratios_that_the_gain_makes() {
        let known = FieldCurve {
            blur_ratio: Some(0.1),
            ..curve()
        };
        let asked = std::cell::RefCell::new(Vec::new());
        let measured = |ratios: Option<&BlurRatio>| {
            asked.borrow_mut().push(ratios.map(BlurRatio::mean));
            let planes = [0.6, 1.5].map(|distance_m| PlaneShifts {
                distance_m,
                size_px: [90, 60],
                shifts: plane(distance_m, 1.3, 0.0),
            });
            Ok::<_, CalibrateError>(planes.to_vec())
        };
        let found = calibrate_by(&known, measured).unwrap();
        let [Some(first), Some(second)] = asked.borrow()[..] else {
            panic!("{asked:?}");
        };
        assert!(
            (second / first / found.gain[0] - 1.0).abs() < 0.02,
            "{first}, {second}"
        );
    }

    #[test]
    fn planes_that_say_nothing_are_refused_by_name() {
        let one = || plane(0.6, 1.0, 0.0);
        let said = |shifts: &[(f64, Vec<Option<Measured>>)]| found(shifts).unwrap_err().to_string();
        assert!(said(&[(0.6, one())]).contains("0.6 m; allowed: two or more"));
        assert!(said(&[(0.6, one()), (0.61, one())]).contains("0.6, 0.61"));
        assert!(said(&[(0.6, one()), (-1.0, one())]).contains("-1 m"));
        assert!(
            said(&[(0.6, one()), (1.0, vec![None; 5400])]).contains("plane at 1 m has no part")
        );
        let other = PlaneShifts {
            distance_m: 1.0,
            size_px: [60, 90],
            shifts: one(),
        };
        let planes = [
            PlaneShifts {
                distance_m: 2.0,
                ..other.clone()
            },
            other,
        ];
        let error = calibrate(&curve(), &planes).unwrap_err().to_string();
        assert!(
            error.contains("60 x 90 px; allowed: the curve's 90 x 60"),
            "{error}"
        );
    }
}
