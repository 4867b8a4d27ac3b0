use quadpixel::sampling::uniform;

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
        matching_error_px: None,
    }
}

/// A gain that rises towards the sides by a fifth.
fn risen(gain: f64, column: usize) -> f64 {
    gain * (1.0 + 0.2 * (column as f64 / 44.5 - 1.0).powi(4))
}

/// The shifts of a camera with another gain and focus, at each place, with one bad match of fifty.
fn plane(distance_m: f64, gain: f64, delta: f64) -> Vec<Option<Measured>> {
    tilted(distance_m, gain, |_| delta)
}

/// As [`plane`], of a focus that changes over the picture.
fn tilted(distance_m: f64, gain: f64, delta: impl Fn([usize; 2]) -> f64) -> Vec<Option<Measured>> {
    let curve = curve();
    let at = |i: usize| {
        let delta = delta([i % 90, i / 90]);
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

/// Pixels that err evenly within ± e px, and one of fifty by 3 px, which counts no more than another.
#[test]
fn what_matching_errs_by_at_a_pixel_of_the_planes_goes_into_the_curve() {
    let noisy = |distance_m: f64, most_px: f64| {
        let mut shifts = plane(distance_m, 1.1, 0.02);
        for (i, measured) in (0u64..).zip(shifts.iter_mut().flatten()) {
            measured.disparity_px += most_px * (2.0 * uniform(7, &[i]) - 1.0);
        }
        shifts
    };
    for most_px in [0.1, 0.2] {
        let found = found(&[0.6, 1.5].map(|z| (z, noisy(z, most_px)))).unwrap();
        let told = found.curve.matching_error_px.unwrap();
        let all = told.hypot(found.curve.offset_error_px);
        // 68 % of all are within 70 % of the others' range, as a fiftieth is beyond it.
        assert!(
            (all / (0.697 * most_px) - 1.0).abs() < 0.08,
            "{most_px}: {told}, {all}"
        );
    }
    let windows = FieldCurve {
        matched_window_px: Some(21),
        ..curve()
    };
    let planes = [0.6, 1.5].map(|distance_m| PlaneShifts {
        distance_m,
        size_px: [90, 60],
        shifts: plane(distance_m, 1.0, 0.0),
    });
    let of_windows = calibrate(&windows, &planes).unwrap().curve;
    assert_eq!(of_windows.matching_error_px, None);
}

#[test]
fn a_tilted_sensor_is_found_and_a_far_plane_is_predicted() {
    let delta = |[x, y]: [usize; 2]| {
        let (u, v) = (x as f64 / 44.5 - 1.0, y as f64 / 29.5 - 1.0);
        0.03 + 0.04 * u - 0.03 * v
    };
    let made = [0.6, 1.5].map(|z| (z, tilted(z, 0.9, delta)));
    let found = found(&made).unwrap();
    let error = (found.shift_per_m[0] - 0.03).abs();
    assert!(error < 2e-3, "{:?}", found.shift_per_m);
    let [least, largest] = found.shift_range_per_m;
    assert!(largest - least > 0.08 && found.rms_px < 5e-3);
    let far = tilted(6.0, 0.9, delta);
    for at in [[10.0, 50.0], [44.0, 30.0], [80.0, 5.0]] {
        let measured = far[at[1] as usize * 90 + at[0] as usize + 1].unwrap();
        let z = found.curve.depth(at, measured).z_m;
        // As much as a hundredth of the gain, the bound of the test above, where 1/Z is 0.83 per m from the focus. The
        // tilt is 0.05 per m in the first place and in the last.
        assert!((1.0 / z - 1.0 / 6.0).abs() < 0.0083, "{z} at {at:?}");
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
    assert!(said(&[(0.6, one()), (1.0, vec![None; 5400])]).contains("plane at 1 m has no part"));
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
