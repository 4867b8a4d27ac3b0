use super::*;
use crate::random::Lcg;

/// Numbers in −1..1.
fn noise(random: &mut Lcg) -> f64 {
    random.between(-1.0, 1.0)
}

/// A field like that of a lens: distortion and astigmatism, in px.
fn truth([x, y]: [f64; 2]) -> [f64; 2] {
    let (u, v) = (x / 300.0 - 1.0, y / 200.0 - 1.0);
    let r2 = u * u + v * v;
    [
        0.8 + 0.5 * u * r2 - 0.2 * v,
        -0.3 + 0.4 * v * r2 + 0.1 * u * v,
    ]
}

fn observations(error: f64, count: usize) -> Vec<Observation> {
    let mut random = Lcg(5);
    (0..count)
        .map(|_| {
            let at_px = [
                300.0 * (1.0 + noise(&mut random)),
                200.0 * (1.0 + noise(&mut random)),
            ];
            // The sum of three uniform numbers in −1..1 has unit variance and is nearly normal.
            let mut normal = || noise(&mut random) + noise(&mut random) + noise(&mut random);
            let d = truth(at_px);
            Observation {
                at_px,
                shift_px: [d[0] + error * normal(), d[1] + error * normal()],
                covariance_px2: [error * error, 0.0, error * error],
            }
        })
        .collect()
}

fn worst(field: &SmoothField) -> f64 {
    let mut worst = 0.0f64;
    for i in 0..=20 {
        for j in 0..=20 {
            let at = [30.0 * f64::from(i), 20.0 * f64::from(j)];
            let (found, wanted) = (field.at(at), truth(at));
            worst = worst.max((found[0] - wanted[0]).hypot(found[1] - wanted[1]));
        }
    }
    worst
}

#[test]
fn a_polynomial_of_the_degree_is_met_to_rounding() {
    for loss in [Loss::Squares, Loss::Huber, Loss::Tukey] {
        for degree in 3..=LARGEST_DEGREE {
            let fit = SmoothField::fit(&observations(0.0, 400), degree, loss).unwrap();
            assert!(worst(&fit.field) < 1e-9, "{loss:?} {degree}");
            assert!(fit.rms_px < 1e-9);
        }
    }
}

#[test]
fn a_third_of_gross_errors_is_rejected_and_changes_little() {
    let mut all = observations(0.01, 900);
    for (i, o) in all.iter_mut().enumerate().filter(|(i, _)| i % 3 == 0) {
        o.shift_px[0] += 2.0 + (i % 7) as f64;
    }
    let robust = SmoothField::fit(&all, 3, Loss::Tukey).unwrap();
    let squares = SmoothField::fit(&all, 3, Loss::Squares).unwrap();
    assert!(worst(&squares.field) > 1.0);
    assert!(worst(&robust.field) < 0.02, "{}", worst(&robust.field));
    assert!((robust.rejected_share() - 1.0 / 3.0).abs() < 0.01);
    assert!((robust.rms_px - 0.01).abs() < 0.001, "{}", robust.rms_px);
}

#[test]
fn a_match_counts_by_its_covariance() {
    // Half of the matches know only x, the other half only y: together they know both.
    let mut all = observations(0.0, 600);
    for (i, o) in all.iter_mut().enumerate() {
        let unknown = i % 2;
        o.covariance_px2 = if unknown == 0 {
            [1e6, 0.0, 1e-6]
        } else {
            [1e-6, 0.0, 1e6]
        };
        o.shift_px[unknown] += 100.0;
    }
    let fit = SmoothField::fit(&all, 3, Loss::Squares).unwrap();
    assert!(worst(&fit.field) < 1e-3, "{}", worst(&fit.field));
}

#[test]
fn the_scale_is_one_when_the_covariances_are_right() {
    let fit = SmoothField::fit(&observations(0.05, 4000), 3, Loss::Huber).unwrap();
    assert!((fit.scale - 1.0).abs() < 0.05, "{}", fit.scale);
}

#[test]
fn too_few_matches_or_matches_on_a_line_are_errors() {
    let all = observations(0.01, 100);
    assert!(matches!(
        SmoothField::fit(&all[..5], 2, Loss::Tukey),
        Err(FieldError::TooFew {
            found: 5,
            needed: 6,
            degree: 2
        })
    ));
    assert_eq!(
        SmoothField::fit(&all, 7, Loss::Tukey),
        Err(FieldError::Degree(7))
    );
    let mut line = all.clone();
    for o in &mut line {
        o.at_px[1] = 2.0 * o.at_px[0];
    }
    assert_eq!(
        SmoothField::fit(&line, 1, Loss::Tukey),
        Err(FieldError::Singular(1))
    );
    let point: Vec<_> = all
        .iter()
        .map(|o| Observation {
            at_px: [3.0, 4.0],
            ..*o
        })
        .collect();
    assert_eq!(
        SmoothField::fit(&point, 1, Loss::Tukey),
        Err(FieldError::Singular(1))
    );
    assert!(SmoothField::fit(&point, 0, Loss::Tukey).is_ok());
    let mut bad = all.clone();
    bad[7].shift_px[0] = f64::NAN;
    assert_eq!(
        SmoothField::fit(&bad, 1, Loss::Tukey),
        Err(FieldError::Observation { index: 7 })
    );
    assert!(SmoothField::fit(&[], 0, Loss::Tukey).is_err());
}

#[test]
fn stored_coefficients_give_the_same_field() {
    let field = SmoothField::fit(&observations(0.01, 300), 4, Loss::Tukey)
        .unwrap()
        .field;
    let again = SmoothField::from_parts(
        field.centre_px(),
        field.half_span_px(),
        field.coefficients().clone(),
    );
    assert_eq!(again, Some(field));
    assert_eq!(
        SmoothField::from_parts([0.0; 2], [1.0; 2], [vec![0.0; 4], vec![0.0; 4]]),
        None
    );
    assert_eq!(
        SmoothField::from_parts([0.0; 2], [0.0, 1.0], [vec![0.0], vec![0.0]]),
        None
    );
}
