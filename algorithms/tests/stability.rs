//! Hard pictures in every metric: constant, of one pixel, with NaN, and at random. Sharpness of constant and single
//! pixels, and matching of blank, periodic, saturated and NaN pictures have tests beside those of their accuracy
//! (`metrics/sharpness/tests.rs`, `tests/matching.rs`).

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use proptest::prelude::*;
use quadpixel::image::Image;
use quadpixel_algorithms::autofocus::{median, peak, zero_crossing};
use quadpixel_algorithms::disparity::{MatchSettings, Verdict, match_images};
use quadpixel_algorithms::metrics::disparity_error::{AffineInvariantError, EndPointError, Pair};
use quadpixel_algorithms::metrics::sharpness::{Plane, SharpnessSettings, sharpness};

fn pairs(estimates: &[f64], truths: &[f64], weights: &[f64]) -> Vec<Pair> {
    let all = estimates.iter().zip(truths).zip(weights);
    all.map(|((&estimate, &truth), &weight)| Pair {
        estimate,
        truth,
        weight,
    })
    .collect()
}

#[test]
fn end_point_errors_of_nothing_of_nan_and_of_one_pixel() {
    assert_eq!(EndPointError::from_lengths([]), None);
    assert_eq!(
        EndPointError::from_lengths([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        None
    );
    let one = EndPointError::from_lengths([f64::NAN, -0.2]).unwrap();
    assert_eq!(
        (one.pixels, one.epe_px, one.rms_px, one.bad_01, one.bad_05),
        (1, 0.2, 0.2, 1.0, 0.0)
    );
}

/// Without a slope or an order to find, the documented values: 0 for a constant truth, its deviation for a constant
/// estimate, 1 − |ρ| = 1.
#[test]
fn affine_invariant_errors_of_constant_maps_of_one_pixel_and_of_nan() {
    let ramp: Vec<f64> = (0..9).map(f64::from).collect();
    let (flat, ones) = (vec![3.0; 9], vec![1.0; 9]);
    for (estimate, truth, deviation) in [
        (&flat, &flat, 0.0),
        (&ramp, &flat, 0.0),
        (&flat, &ramp, (60.0f64 / 9.0).sqrt()),
    ] {
        let e = AffineInvariantError::from_pairs(&pairs(estimate, truth, &ones)).unwrap();
        assert!(
            (e.aiwe_2 - deviation).abs() < 1e-12 && e.aiwe_1 <= deviation + 1e-12,
            "{e:?}"
        );
        assert_eq!(e.one_minus_spearman, 1.0);
    }
    assert_eq!(AffineInvariantError::from_pairs(&[]), None);
    assert_eq!(
        AffineInvariantError::from_pairs(&pairs(&[1.0], &[2.0], &[1.0])),
        None
    );
    let nan = pairs(&[f64::NAN, 1.0, 2.0], &[1.0, f64::INFINITY, 2.0], &[1.0; 3]);
    assert_eq!(AffineInvariantError::from_pairs(&nan), None);
    assert_eq!(
        AffineInvariantError::from_pairs(&pairs(&ramp, &ramp, &[0.0; 9])),
        None
    );
}

/// Magnitudes apart by 1e30 do not make a NaN, and a perfect line stays one to 1e-6 of its size.
#[test]
fn affine_invariant_errors_of_huge_and_tiny_numbers() {
    for (a, b) in [(1e30, 1e-30), (1e-30, 1e30), (1.0, 1e15)] {
        let x: Vec<f64> = (0..20).map(|i| f64::from(i) * a).collect();
        let y: Vec<f64> = (0..20).map(|i| f64::from(i) * b).collect();
        let e = AffineInvariantError::from_pairs(&pairs(&x, &y, &[1e-30; 20])).unwrap();
        assert!(
            e.aiwe_1 < 1e-6 * b && e.aiwe_2 < 1e-6 * b && e.one_minus_spearman.abs() < 1e-12,
            "{e:?}"
        );
    }
}

#[test]
fn curves_without_points_without_a_crossing_and_without_a_summit_say_so() {
    assert_eq!(median(vec![]), None);
    assert_eq!((zero_crossing(&[]), peak(&[])), (None, None));
    let flat = [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)];
    assert_eq!(zero_crossing(&flat), None);
    assert!(peak(&flat).is_none_or(|x| x.is_finite()));
    assert_eq!(peak(&[(0.0, 1.0)]), None);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any finite picture has finite sharpness: De in 0 to 1, Wee and gradient 0 or more.
    #[test]
    fn sharpness_of_random_pictures_is_finite(
        width in 1..12usize, height in 1..12usize, exponent in -30..30i32,
        seed in prop::collection::vec(-1.0..1.0f64, 144),
    ) {
        let data: Vec<f64> = seed[..width * height].iter().map(|x| x * 10f64.powi(exponent)).collect();
        let plane = Plane::new(width, height, data).unwrap();
        for preset in SharpnessSettings::PRESETS {
            let s = sharpness(&plane, &preset.parse().unwrap()).unwrap();
            prop_assert!((0.0..=1.0).contains(&s.de), "{:?}", s);
            prop_assert!(s.wee >= 0.0 && s.wee.is_finite() && s.gradient >= 0.0 && s.gradient.is_finite(), "{:?}", s);
        }
    }

    /// Random pictures of any size and brightness match themselves at no shift, or say why not; never a shift that is
    /// not finite.
    #[test]
    fn random_pictures_match_themselves_or_say_why_not(
        width in 29..40usize, height in 29..40usize, exponent in -20..20i32, levels in 1..5u32, seed in any::<u64>(),
    ) {
        let texel = |i: usize| {
            let noise = quadpixel::sampling::uniform(seed, &[i as u64]);
            (noise * f64::from(levels)).floor() as f32 * 10f32.powi(exponent)
        };
        let image = Image::from_vec(width, height, 1, (0..width * height).map(texel).collect()).unwrap();
        let map = match_images(&image, &image, &MatchSettings::default()).unwrap();
        for found in &map.matches {
            match found.verdict {
                // Matching ends where less than its `last_step_px` is left.
                Verdict::Valid => prop_assert!(found.dx_px.abs() < 1e-3 && found.dy_px.abs() < 1e-3, "{:?}", found),
                _ => prop_assert!(found.dx_px.is_nan()),
            }
        }
        if levels == 1 {
            prop_assert_eq!(map.count(Verdict::Textureless), map.matches.len());
        }
    }

    /// AIWE does not see an affine change and is no larger than the deviation of the truth; 1 − |ρ| lies in 0 to 1.
    #[test]
    fn affine_invariant_errors_of_random_maps(
        values in prop::collection::vec((-5.0..5.0f64, -5.0..5.0f64, 0.01..3.0f64), 2..40),
        a in 0.1..10.0f64, b in -10.0..10.0f64,
    ) {
        let columns = |f: &dyn Fn(&(f64, f64, f64)) -> f64| values.iter().map(f).collect::<Vec<f64>>();
        let (x, y, w) = (columns(&|v| v.0), columns(&|v| v.1), columns(&|v| v.2));
        let moved: Vec<f64> = x.iter().map(|x| a * x + b).collect();
        let e = AffineInvariantError::from_pairs(&pairs(&x, &y, &w)).unwrap();
        let f = AffineInvariantError::from_pairs(&pairs(&moved, &y, &w)).unwrap();
        prop_assert!((e.aiwe_1 - f.aiwe_1).abs() < 1e-6 && (e.aiwe_2 - f.aiwe_2).abs() < 1e-9, "{:?} {:?}", e, f);
        prop_assert!((-1e-12..=1.0).contains(&e.one_minus_spearman));
        prop_assert!(e.aiwe_1 <= e.aiwe_2 + 1e-6, "{:?}", e);
    }
}
