use super::*;

/// The generator of the reference vectors, 0..1, with a periodic Gaussian of radius ⌈4σ⌉ where `sigma` > 0, then 8
/// bits.
fn reference_image(seed: u64, side: usize, sigma: f64) -> Vec<f64> {
    let mut random = crate::random::Lcg(seed);
    let mut image: Vec<f64> = (0..side * side).map(|_| random.uniform()).collect();
    if sigma > 0.0 {
        let radius = (4.0 * sigma).ceil() as i64;
        let raw: Vec<f64> = (-radius..=radius)
            .map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp())
            .collect();
        let sum: f64 = raw.iter().sum();
        for step in [1, side] {
            image = (0..side * side)
                .map(|i| {
                    let along = (i / step % side) as i64;
                    let base = i - along as usize * step;
                    let taps = (-radius..=radius).zip(&raw);
                    let values = taps.map(|(d, w)| {
                        w * image[base + (along + d).rem_euclid(side as i64) as usize * step]
                    });
                    values.sum::<f64>() / sum
                })
                .collect();
        }
    }
    image.iter().map(|u| (255.0 * u + 0.5).floor()).collect()
}

fn near(found: f64, wanted: &serde_json::Value, what: &str) {
    let wanted = wanted.as_f64().unwrap();
    assert!(
        (found / wanted - 1.0).abs() < 1e-10,
        "{what}: {found} is not {wanted}"
    );
}

/// Every reading of Wee that the vectors hold, and both gradients, of 8-bit codes.
fn compare(plane: &Plane, wanted: &serde_json::Value, gradients: [&serde_json::Value; 2]) {
    use Eigenvalues::{Plain, Squared};
    use Energy::{Root, SumOfSquares};
    let unit = SharpnessSettings {
        wee_scale: 1.0, // the plane holds 0..255
        gradient_scale: 1.0 / 255.0,
        ..SharpnessSettings::wee_abstract()
    };
    for (name, wee_energy, wee_k, wee_eigenvalues, wee_mean) in [
        ("wee_sum2_all", SumOfSquares, None, Plain, Mean::Image),
        ("wee_sum2_k6", SumOfSquares, Some(6), Plain, Mean::Image),
        ("wee_sqrt_all", Root, None, Plain, Mean::Image),
        ("wee_sqrt_k6", Root, Some(6), Plain, Mean::Image),
        ("wee_sqrt_sv2_all", Root, None, Squared, Mean::Image),
        ("wee_sqrt_sv2_k6", Root, Some(6), Squared, Mean::Image),
        (
            "wee_sqrt_col_sv2_k24",
            Root,
            Some(24),
            Squared,
            Mean::Column,
        ),
    ] {
        let settings = SharpnessSettings {
            wee_energy,
            wee_k,
            wee_eigenvalues,
            wee_mean,
            ..unit
        };
        if !wanted[name].is_null() {
            near(
                sharpness(plane, &settings).unwrap().wee,
                &wanted[name],
                name,
            );
        }
    }
    let kernels = [GradientKernel::Sobel, GradientKernel::Central];
    for (gradient_kernel, wanted) in kernels.into_iter().zip(gradients) {
        let settings = SharpnessSettings {
            gradient_kernel,
            ..unit
        };
        near(
            sharpness(plane, &settings).unwrap().gradient,
            wanted,
            "gradient",
        );
    }
}

fn vectors(name: &str) -> serde_json::Value {
    let path = format!("{}/tests/vectors/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn noise_images_measure_as_the_reference_vectors_say() {
    let cases = vectors("vectors_sharpness.json");
    let made = [(1, 16, 0.0), (2, 64, 0.0), (4, 150, 0.0), (4, 150, 0.85)];
    assert_eq!(cases.as_array().unwrap().len(), made.len());
    for (case, (seed, side, sigma)) in cases.as_array().unwrap().iter().zip(made) {
        let plane = Plane::new(side, side, reference_image(seed, side, sigma)).unwrap();
        assert_eq!(
            plane.data.iter().sum::<f64>(),
            case["sum"].as_f64().unwrap()
        );
        let count = strong_frequencies(&plane) as i64;
        assert!(
            (count - case["de_count"].as_i64().unwrap()).abs() <= 2,
            "{count}"
        );
        compare(
            &plane,
            case,
            [&case["grad01_sobel"], &case["grad01_central"]],
        );
    }
}

#[test]
fn the_tiny_image_measures_as_the_reference_says() {
    let file = vectors("vectors_tiny8.json");
    let rows = file["image8"].as_array().unwrap();
    let samples = rows.iter().flat_map(|row| row.as_array().unwrap());
    let plane = Plane::new(8, 8, samples.map(|v| v.as_f64().unwrap()).collect()).unwrap();
    assert_eq!(strong_frequencies(&plane), 64);
    compare(
        &plane,
        &file,
        [&file["grad01"]["sobel"], &file["grad01"]["central"]],
    );
}

fn textured(width: usize, height: usize, scale: f64) -> Plane {
    let data = (0..width * height).map(|i| scale * (1.0 + ((i * i + 7 * i) % 31) as f64));
    Plane::new(width, height, data.collect()).unwrap()
}

#[test]
fn all_eigenvalues_add_up_to_the_trace_for_odd_and_non_square_images() {
    for (width, height) in [(7, 5), (5, 7), (2, 9), (31, 3), (64, 33)] {
        for scale in [1e-6, 1.0, 1e6] {
            let plane = textured(width, height, scale);
            let n = plane.data.len() as f64;
            let mean = plane.data.iter().sum::<f64>() / n;
            let variance: f64 = plane.data.iter().map(|v| (v - mean).powi(2)).sum();
            let energy: f64 = plane.data.iter().map(|v| v * v).sum();
            for (wee_energy, divisor) in [
                (Energy::Root, energy),
                (Energy::SumOfSquares, energy * energy),
            ] {
                let settings = SharpnessSettings {
                    wee_energy,
                    wee_k: None,
                    wee_scale: 1.0,
                    ..SharpnessSettings::wee_abstract()
                };
                let found = sharpness(&plane, &settings).unwrap().wee;
                let wanted = variance / (divisor * (width as f64 - 1.0));
                assert!(
                    (found / wanted - 1.0).abs() < 1e-12,
                    "{found} is not {wanted}"
                );
            }
        }
    }
}

#[test]
fn de_and_roots_of_energy_do_not_see_the_gain_and_the_gradient_follows_it() {
    let settings = SharpnessSettings::wee_abstract();
    let one = sharpness(&textured(21, 13, 1.0), &settings).unwrap();
    for gain in [1e-6, 0.37, 1e6] {
        let found = sharpness(&textured(21, 13, gain), &settings).unwrap();
        assert_eq!(found.de_count, one.de_count);
        assert!((found.wee / one.wee - 1.0).abs() < 1e-12);
        assert!((found.gradient / (one.gradient * gain) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_ramp_has_the_gradient_of_its_slope() {
    let data = (0..12 * 9).map(|i| 0.3 * (i % 12) as f64 - 0.4 * (i / 12) as f64);
    let plane = Plane::new(12, 9, data.collect()).unwrap();
    for (gradient_kernel, wanted) in [(GradientKernel::Central, 0.5), (GradientKernel::Sobel, 4.0)]
    {
        let settings = SharpnessSettings {
            gradient_kernel,
            ..SharpnessSettings::wee_abstract()
        };
        let found = sharpness(&plane, &settings).unwrap().gradient;
        assert!((found - wanted).abs() < 1e-12, "{found}");
    }
}

#[test]
fn constant_images_and_single_pixels_are_finite_as_documented() {
    for preset in SharpnessSettings::PRESETS {
        for gradient_kernel in [GradientKernel::Sobel, GradientKernel::Central] {
            let settings = SharpnessSettings {
                gradient_kernel,
                ..preset.parse().unwrap()
            };
            for (width, height) in [(1, 1), (1, 5), (5, 1), (2, 2), (8, 6)] {
                for (value, count) in [(0.5, 1), (0.0, 0)] {
                    let plane = Plane::new(width, height, vec![value; width * height]).unwrap();
                    let found = sharpness(&plane, &settings).unwrap();
                    assert_eq!((found.de_count, found.gradient), (count, 0.0));
                    assert!(found.wee.abs() < 1e-30, "{}", found.wee);
                }
            }
        }
    }
}

#[test]
fn nan_infinity_and_settings_without_meaning_are_refused() {
    for bad in [f64::NAN, f64::INFINITY] {
        let text = Plane::new(2, 2, vec![0.0, 0.0, 0.0, bad])
            .unwrap_err()
            .to_string();
        assert!(text.contains("(x 1, y 1)"), "{text}");
    }
    assert_eq!(Plane::new(0, 0, vec![]), Err(SharpnessError::Empty));
    assert!(Plane::from_image(&Image::zeros(2, 2, 3), 3).is_err());
    assert!("table-3".parse::<SharpnessSettings>().is_err());
    let plane = textured(4, 4, 1.0);
    for settings in [
        SharpnessSettings {
            wee_k: Some(0),
            ..SharpnessSettings::table_2()
        },
        SharpnessSettings {
            wee_scale: f64::NAN,
            ..SharpnessSettings::table_2()
        },
        SharpnessSettings {
            gradient_scale: -1.0,
            ..SharpnessSettings::table_2()
        },
    ] {
        assert!(sharpness(&plane, &settings).is_err());
    }
}

#[test]
fn wees_n_is_of_columns_or_of_rows() {
    let by = |wee_samples, plane: &Plane| {
        let settings = SharpnessSettings {
            wee_samples,
            ..SharpnessSettings::wee_abstract()
        };
        sharpness(plane, &settings).unwrap().wee
    };
    let wide = textured(21, 13, 1.0);
    let ratio = by(Samples::Columns, &wide) / by(Samples::Rows, &wide);
    assert!((ratio - 12.0 / 20.0).abs() < 1e-12, "{ratio}");
    let square = textured(13, 13, 1.0);
    assert_eq!(by(Samples::Columns, &square), by(Samples::Rows, &square));
    assert_eq!(by(Samples::Rows, &textured(21, 1, 1.0)), 0.0);
}
