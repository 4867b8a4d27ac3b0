//! The photon-transfer curve and its parts. Bounds are four standard errors of the estimate, from the number of values
//! alone.

use super::*;

const SIDE: usize = 192;
/// Values a flat field has: a mosaic of one channel.
const COUNT: f64 = (SIDE * SIDE) as f64;

fn ideal() -> ReadoutSettings {
    ReadoutSettings {
        photons_um2: 1000.0,
        exposure_s: 0.02,
        dark_current_e_s: 0.0,
        full_well_e: 1e6,
        prnu: 0.0,
        read_noise_e: 4.0,
        gain_dn_per_e: Some(0.8),
        black_level: 64,
        bits: 16,
        subpixel_gains: vec![1.0; 4],
        sensor_seed: 11,
        shot_seed: 1,
    }
}

/// A flat field of `electrons` a sub-pixel; N is 1e5, so that the light is a small number.
fn flat(settings: &ReadoutSettings, electrons: f64) -> Exposed {
    let light = Image::from_vec(SIDE, SIDE, 1, vec![(electrons / 1e5) as f32; SIDE * SIDE]);
    readout(settings).expose(&light.unwrap())
}

fn readout(settings: &ReadoutSettings) -> Readout {
    Readout::new(settings, Subpixels::QUAD, 1e5, 0.25).unwrap()
}

fn mean_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

fn of(exposed: &Exposed) -> impl Iterator<Item = f64> + Clone + '_ {
    exposed.codes.data().iter().map(|&v| f64::from(v))
}

#[test]
fn variance_over_mean_has_the_gain_as_slope_and_the_read_noise_as_intercept() {
    let settings = ideal();
    let (k, sigma) = (readout(&settings).gain_dn_per_e(), settings.read_noise_e);
    // Weighted line through eight levels; a variance V of n values has the standard error V √(2/n).
    let mut sums = [0.0; 5];
    for step in 0..8 {
        let settings = ReadoutSettings {
            shot_seed: step,
            ..settings.clone()
        };
        let (mean, variance) =
            mean_variance(of(&flat(&settings, 3.0 * 4f64.powf(step as f64 / 1.5))));
        let (x, w) = (mean - 64.0, COUNT / (2.0 * variance * variance));
        for (sum, term) in sums.iter_mut().zip([1.0, x, x * x, variance, x * variance]) {
            *sum += w * term;
        }
    }
    let [s, sx, sxx, sy, sxy] = sums;
    let determinant = s * sxx - sx * sx;
    let (slope, intercept) = (
        (s * sxy - sx * sy) / determinant,
        (sxx * sy - sx * sxy) / determinant,
    );
    let (slope_error, intercept_error) = ((s / determinant).sqrt(), (sxx / determinant).sqrt());
    assert!(slope_error < 0.01 * k, "the test is too coarse");
    assert!(
        (slope - k).abs() < 4.0 * slope_error,
        "{slope} ± {slope_error}"
    );
    let expected = k * k * sigma * sigma + 1.0 / 12.0;
    assert!(
        (intercept - expected).abs() < 4.0 * intercept_error,
        "{intercept} ± {intercept_error}, expected {expected}"
    );
}

#[test]
fn prnu_adds_its_square_and_falls_out_of_the_difference_of_two_shots() {
    let first = ReadoutSettings {
        prnu: 0.02,
        ..ideal()
    };
    let second = ReadoutSettings {
        shot_seed: 2,
        ..first.clone()
    };
    let k = readout(&first).gain_dn_per_e();
    for electrons in [500.0, 5000.0, 50_000.0] {
        let (a, b) = (flat(&first, electrons), flat(&second, electrons));
        let (mean, variance) = mean_variance(of(&a));
        let x = mean - 64.0;
        let temporal = k * x + (k * first.read_noise_e).powi(2) + 1.0 / 12.0;
        let expected = temporal + (first.prnu * x).powi(2);
        let bound = 4.0 * (2.0 / COUNT).sqrt();
        assert!(
            (variance / expected - 1.0).abs() < bound,
            "{electrons} e⁻: {variance} for {expected}"
        );
        let difference = of(&a).zip(of(&b).collect::<Vec<_>>()).map(|(a, b)| a - b);
        let difference = mean_variance(difference.collect::<Vec<_>>().into_iter()).1 / 2.0;
        assert!(
            (difference / temporal - 1.0).abs() < bound,
            "{electrons} e⁻: {difference} for {temporal}"
        );
    }
}

#[test]
fn a_full_well_keeps_the_read_noise_only_and_a_full_converter_nothing() {
    let settings = ReadoutSettings {
        full_well_e: 6000.0,
        ..ideal()
    };
    let full = flat(&settings, 12_000.0);
    assert_eq!(full.saturated, COUNT as u64);
    let (mean, variance) = mean_variance(of(&full));
    let noise = (0.8f64 * 4.0).powi(2) + 1.0 / 12.0;
    assert!((mean - (64.0 + 0.8 * 6000.0)).abs() < 4.0 * (noise / COUNT).sqrt());
    assert!((variance / noise - 1.0).abs() < 4.0 * (2.0 / COUNT).sqrt());
    let settings = ReadoutSettings {
        bits: 10,
        ..ideal()
    };
    let full = flat(&settings, 12_000.0);
    assert!(of(&full).all(|code| code == 1023.0));
    assert_eq!(flat(&settings, 500.0).saturated, 0);
}

#[test]
fn dark_current_adds_its_noise_and_is_taken_off_in_the_mean() {
    let settings = ReadoutSettings {
        dark_current_e_s: 5000.0,
        ..ideal()
    };
    let dark = flat(&settings, 0.0);
    let (mean, variance) = mean_variance(of(&dark));
    let expected = 0.8 * 0.8 * (100.0 + 16.0) + 1.0 / 12.0;
    assert!((mean - (64.0 + 80.0)).abs() < 4.0 * (expected / COUNT).sqrt());
    // The fourth moment of a Poisson number is a little above a normal one's: 1/μ = 0.01.
    assert!((variance / expected - 1.0).abs() < 4.0 * (2.01 / COUNT).sqrt());
    let linear = readout(&settings).linear(&dark.codes);
    let (mean, _) = mean_variance(linear.data().iter().map(|&v| f64::from(v)));
    assert!(mean.abs() < 4.0 * (expected / COUNT).sqrt() / (0.8 * 1e5));
}

#[test]
fn gains_of_sub_pixels_scale_their_own_codes_in_stored_order() {
    let gains = [1.02, 0.99, 1.0, 0.97];
    let settings = ReadoutSettings {
        subpixel_gains: gains.to_vec(),
        ..ideal()
    };
    let exposed = flat(&settings, 1e4);
    for (index, gain) in gains.into_iter().enumerate() {
        let (i, j) = (index % 2, index / 2);
        let own = (0..SIDE * SIDE / 4).map(|p| {
            let (x, y) = (p % (SIDE / 2), p / (SIDE / 2));
            f64::from(exposed.codes.pixel(2 * x + i, 2 * y + j)[0])
        });
        let (mean, variance) = mean_variance(own);
        let error = (variance / (COUNT / 4.0)).sqrt();
        assert!(
            (mean - 64.0 - 0.8 * gain * 1e4).abs() < 4.0 * error,
            "{index}"
        );
    }
}

#[test]
fn codes_are_a_function_of_seeds_and_place_whatever_the_threads() {
    let settings = ideal();
    let runs: Vec<Exposed> = [1, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| flat(&settings, 300.0))
        })
        .collect();
    assert_eq!(runs[0], runs[1]);
    let other = ReadoutSettings {
        shot_seed: 2,
        ..settings
    };
    assert_ne!(flat(&other, 300.0), runs[0]);
}

#[test]
fn settings_out_of_range_are_named() {
    let bad = [
        (
            "photons_um2",
            ReadoutSettings {
                photons_um2: f64::NAN,
                ..ideal()
            },
        ),
        (
            "full_well_e",
            ReadoutSettings {
                full_well_e: 0.0,
                ..ideal()
            },
        ),
        (
            "read_noise_e",
            ReadoutSettings {
                read_noise_e: -1.0,
                ..ideal()
            },
        ),
        (
            "prnu",
            ReadoutSettings {
                prnu: 0.6,
                ..ideal()
            },
        ),
        (
            "bits",
            ReadoutSettings {
                bits: 17,
                ..ideal()
            },
        ),
        ("black_level", ReadoutSettings { bits: 6, ..ideal() }),
        (
            "subpixel_gains (count)",
            ReadoutSettings {
                subpixel_gains: vec![1.0],
                ..ideal()
            },
        ),
        (
            "subpixel_gains",
            ReadoutSettings {
                subpixel_gains: vec![0.0; 4],
                ..ideal()
            },
        ),
    ];
    for (field, settings) in bad {
        let error = Readout::new(&settings, Subpixels::QUAD, 1e4, 0.25).unwrap_err();
        assert_eq!(error.field, field, "{error}");
    }
    assert!(Readout::new(&ideal(), Subpixels::QUAD, 0.0, 0.25).is_err());
}

#[test]
fn without_a_gain_the_largest_code_is_half_a_stop_above_white_or_a_full_well() {
    let open = ReadoutSettings {
        gain_dn_per_e: None,
        ..ideal()
    };
    let codes = f64::from(u16::MAX) - 64.0;
    // 1.5 × 1e5/4 electrons.
    assert!((readout(&open).gain_dn_per_e() * 37_500.0 / codes - 1.0).abs() < 1e-12);
    let small = ReadoutSettings {
        full_well_e: 9000.0,
        ..open
    };
    assert!((readout(&small).gain_dn_per_e() * 9000.0 / codes - 1.0).abs() < 1e-12);
}
