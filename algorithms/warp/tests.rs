use super::*;
use crate::random::Lcg;
use std::f64::consts::PI;

const BORDERS: [Border; 5] = [
    Border::Replicate,
    Border::Reflect,
    Border::Reflect101,
    Border::Wrap,
    Border::Constant(0.0),
];

fn noise(width: usize, height: usize, channels: usize, seed: u64) -> Image {
    let mut lcg = Lcg(seed);
    let mut image = Image::zeros(width, height, channels);
    image.data_mut().fill_with(|| lcg.uniform() as f32);
    image
}

/// Random positions from 10 px before the image to 10 px behind it, a few on the grid.
fn wild_map(image: &Image, width: usize, height: usize, seed: u64) -> Map {
    let mut lcg = Lcg(seed);
    let mut x = Vec::new();
    let mut y = Vec::new();
    for i in 0..width * height {
        let (mut u, mut v) = (
            lcg.uniform() * (image.width() as f64 + 20.0) - 10.0,
            lcg.uniform() * (image.height() as f64 + 20.0) - 10.0,
        );
        if i % 5 == 0 {
            u = u.round();
        }
        if i % 3 == 0 {
            v = v.round();
        }
        x.push(u);
        y.push(v);
    }
    Map::new(width, height, x, y).unwrap()
}

/// OpenCV's coordinates: to 1/32 px, half to even.
fn to_a_32nd(x: f64) -> f64 {
    (x * 32.0).round_ties_even() / 32.0
}

fn vectors(name: &str) -> serde_json::Value {
    let path = format!("{}/tests/vectors/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn plain_weights_are_the_reference_ones_at_each_32nd() {
    let table = vectors("vectors_lanczos4_coeff.json");
    let rows = table["coeff_1_32"].as_array().unwrap();
    for (step, row) in rows.iter().enumerate() {
        let found = plain::weights(step as f64 / 32.0, Lobes::Four);
        for (found, wanted) in found.iter().zip(row.as_array().unwrap()) {
            assert!((found - wanted.as_f64().unwrap()).abs() < 1e-15, "{step}");
        }
    }
}

#[test]
fn plain_weights_are_the_reference_ones_off_the_32nds() {
    let table = vectors("vectors_lanczos4_coeff.json");
    let wanted = table["coeff_0_3"].as_array().unwrap();
    for (found, wanted) in plain::weights(0.3, Lobes::Four).iter().zip(wanted) {
        assert!((found - wanted.as_f64().unwrap()).abs() < 1e-15);
    }
}

#[test]
fn points_are_the_reference_ones_exact_and_rounded_to_a_32nd_at_every_border() {
    let file = vectors("vectors_lanczos4_remap.json");
    let rows = file["image"].as_array().unwrap();
    let samples = rows.iter().flat_map(|row| row.as_array().unwrap());
    let data: Vec<f32> = samples.map(|v| v.as_f64().unwrap() as f32).collect();
    let image = Image::from_vec(12, 12, 1, data).unwrap();
    let names = ["replicate", "reflect", "reflect101", "wrap", "constant"];
    for point in file["points"].as_array().unwrap() {
        let (x, y) = (point["x"].as_f64().unwrap(), point["y"].as_f64().unwrap());
        for (border, name) in BORDERS.into_iter().zip(names) {
            let rounded = (to_a_32nd(x), to_a_32nd(y), format!("{name}_cv32"));
            for (x, y, name) in [(x, y, name.to_string()), rounded] {
                let wanted = point[&name].as_f64().unwrap();
                if !name.ends_with("cv32") {
                    // The rounded ones are OpenCV's own, computed in f32.
                    let plain = plain::sample(&image, 0, x, y, Lobes::Four, border).unwrap();
                    assert!((plain - wanted).abs() < 1e-11, "{name} at {x}, {y}");
                }
                let map = Map::new(1, 1, vec![x], vec![y]).unwrap();
                let fast = warp(&image, &map, Lobes::Four, border, SimdLevel::detect());
                let error = (f64::from(fast.image.data()[0]) - wanted).abs();
                assert!(error < 1e-6 * 255.0, "{name} at {x}, {y}: off by {error}");
            }
        }
    }
}

#[test]
fn the_fast_warp_is_the_plain_one_to_1e_6_at_any_size_border_and_channels() {
    let mut worst: f64 = 0.0;
    for (width, height, channels) in [
        (1, 1, 1),
        (1, 9, 3),
        (5, 2, 2),
        (33, 17, 1),
        (20, 31, 3),
        (9, 9, 5),
    ] {
        let image = noise(width, height, channels, 3);
        let map = wild_map(&image, 37, 29, 4);
        for lobes in Lobes::ALL {
            for border in [BORDERS.as_slice(), &[Border::Constant(0.7)]].concat() {
                let fast = warp(&image, &map, lobes, border, SimdLevel::detect());
                for row in 0..29 {
                    let (x, y) = map.row(row);
                    for column in 0..37 {
                        for c in 0..channels {
                            let wanted =
                                plain::sample(&image, c, x[column], y[column], lobes, border);
                            let found = f64::from(fast.image.pixel(column, row)[c]);
                            worst = worst.max((found - wanted.unwrap()).abs());
                        }
                    }
                }
            }
        }
    }
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn every_simd_level_gives_the_same_bits() {
    for channels in [1, 3, 4] {
        let image = noise(61, 43, channels, 5);
        let width = if cfg!(miri) { 19 } else { 101 };
        let map = wild_map(&image, width, 7, 6);
        for lobes in Lobes::ALL {
            let of = |level| warp(&image, &map, lobes, Border::Reflect101, level);
            let plain = of(SimdLevel::Scalar);
            for level in SimdLevel::ALL {
                let bits = |w: &Warped| {
                    w.image
                        .data()
                        .iter()
                        .map(|v| v.to_bits())
                        .collect::<Vec<_>>()
                };
                assert_eq!(bits(&of(level)), bits(&plain));
                assert_eq!(of(level).valid, plain.valid);
            }
        }
    }
}

#[test]
fn positions_on_the_grid_give_their_sample_bit_for_bit() {
    for channels in [1, 3] {
        let mut image = noise(23, 19, channels, 7);
        image.pixel_mut(4, 4)[0] = -0.0;
        image.pixel_mut(9, 4)[0] = 1e30;
        for lobes in Lobes::ALL {
            for (dx, dy) in [(0.0, 0.0), (-3.0, 2.0), (23.0, -19.0)] {
                let map = Map::shift(23, 19, dx, dy).unwrap();
                let out = warp(&image, &map, lobes, Border::Wrap, SimdLevel::detect());
                for y in 0..19 {
                    for x in 0..23 {
                        let from_x = (x as i64 + dx as i64).rem_euclid(23) as usize;
                        let from_y = (y as i64 + dy as i64).rem_euclid(19) as usize;
                        let (found, wanted) = (out.image.pixel(x, y), image.pixel(from_x, from_y));
                        for (found, wanted) in found.iter().zip(wanted) {
                            assert_eq!(found.to_bits(), wanted.to_bits());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_constant_image_stays_constant_at_every_position_and_scale() {
    for value in [1e-6f32, 0.3, 1e6] {
        let image = Image::from_vec(9, 7, 1, vec![value; 63]).unwrap();
        let map = wild_map(&image, 64, 64, 8);
        for lobes in Lobes::ALL {
            for border in [&BORDERS[..4], &[Border::Constant(value)]].concat() {
                let out = warp(&image, &map, lobes, border, SimdLevel::detect());
                for found in out.image.data() {
                    assert!((found / value - 1.0).abs() < 1e-6, "{found} for {value}");
                }
            }
        }
    }
}

#[test]
fn no_position_is_no_sample_and_positions_outside_are_not_valid() {
    let image = noise(6, 5, 3, 9);
    let x = vec![f64::NAN, 2.5, f64::INFINITY, -1e300, 5.0, 5.01, -0.01, 0.0];
    let y = vec![2.0, f64::NAN, 1.0, 1.0, 4.0, 4.0, 0.0, 0.0];
    let map = Map::new(8, 1, x, y).unwrap();
    let out = warp(
        &image,
        &map,
        Lobes::Four,
        Border::Replicate,
        SimdLevel::detect(),
    );
    let wanted = [false, false, false, false, true, false, false, true];
    assert_eq!(out.valid, wanted);
    assert!(out.image.data()[..12].iter().all(|v| *v == 0.0));
    assert!(out.image.data().iter().all(|v| v.is_finite()));
    assert!(Map::new(2, 1, vec![0.0; 2], vec![0.0; 3]).is_err());
    assert!(Map::new(0, 0, vec![], vec![]).is_err());
    let nothing = warp(
        &Image::zeros(0, 4, 1),
        &map,
        Lobes::Four,
        Border::Wrap,
        SimdLevel::detect(),
    );
    assert_eq!(nothing.valid, [false; 8]);
}

/// Root mean square error of a sine's warp, ω rad/px in x and 0.6 ω in y, exact (`round` = identity) or with rounded
/// coordinates.
fn rms_on_a_sine(omega: f64, lobes: Lobes, round: fn(f64) -> f64) -> f64 {
    let wave = |x: f64, y: f64| (omega * x + 0.6 * omega * y + 0.4).sin();
    let mut image = Image::zeros(64, 64, 1);
    for y in 0..64 {
        for x in 0..64 {
            image.pixel_mut(x, y)[0] = wave(x as f64, y as f64) as f32;
        }
    }
    let mut lcg = Lcg(11);
    let free: Vec<(f64, f64)> = (0..4096)
        .map(|_| (8.0 + 48.0 * lcg.uniform(), 8.0 + 48.0 * lcg.uniform()))
        .collect();
    let (x, y) = free.iter().map(|(x, y)| (round(*x), round(*y))).unzip();
    let map = Map::new(64, 64, x, y).unwrap();
    let out = warp(&image, &map, lobes, Border::Reflect, SimdLevel::detect());
    let errors = out
        .image
        .data()
        .iter()
        .zip(&free)
        .map(|(found, (x, y))| f64::from(*found) - wave(*x, *y));
    (errors.map(|e| e * e).sum::<f64>() / 4096.0).sqrt()
}

#[test]
fn the_error_on_a_sine_is_that_of_the_kernels_frequency_response() {
    // |Σ ŵ(f−k) exp(iω(k−f)) − 1|, averaged over the fraction f, along each axis: errors of the axes add as vectors.
    for lobes in Lobes::ALL {
        for omega in [0.3, 0.8, 1.5] {
            let response = |omega: f64, f: f64| {
                let weights = plain::weights(f, lobes);
                let terms = weights.iter().enumerate();
                terms.fold((0.0, 0.0), |(re, im), (k, w)| {
                    let phase = omega * (k as f64 - 3.0 - f);
                    (re + w * phase.cos(), im + w * phase.sin())
                })
            };
            let steps = 64;
            let mut square = 0.0;
            for i in 0..steps {
                for j in 0..steps {
                    let (a, b) = response(omega, (f64::from(i) + 0.5) / f64::from(steps));
                    let (c, d) = response(0.6 * omega, (f64::from(j) + 0.5) / f64::from(steps));
                    let (re, im) = (a * c - b * d - 1.0, a * d + b * c);
                    square += re * re + im * im;
                }
            }
            let predicted = (square / f64::from(2 * steps * steps)).sqrt();
            let found = rms_on_a_sine(omega, lobes, |x| x);
            assert!(
                (found / predicted - 1.0).abs() < 0.05,
                "{lobes:?} ω {omega}: {found} for {predicted}"
            );
        }
    }
}

#[test]
fn exact_positions_are_nearer_the_truth_than_those_of_a_32nd() {
    for omega in [0.1, 0.4, 0.8, 1.2] {
        let exact = rms_on_a_sine(omega, Lobes::Four, |x| x);
        let rounded = rms_on_a_sine(omega, Lobes::Four, to_a_32nd);
        assert!(exact < rounded, "ω {omega}: {exact} against {rounded}");
    }
}

#[test]
fn rounding_to_a_32nd_changes_no_more_than_the_gradient_allows() {
    // A band-limited image: |I(x) − I(x_32)| ≤ (max|∂x I| + max|∂y I|)/64 up to the kernel's own ripple on its slope.
    let (omega, slope) = (0.5, 0.5 * (1.0 + 0.6));
    let mut image = Image::zeros(48, 48, 1);
    for y in 0..48 {
        for x in 0..48 {
            image.pixel_mut(x, y)[0] =
                (omega * x as f64 + 0.6 * omega * y as f64 + PI / 7.0).sin() as f32;
        }
    }
    let mut lcg = Lcg(12);
    let (x, y): (Vec<f64>, Vec<f64>) = (0..2304)
        .map(|_| (8.0 + 32.0 * lcg.uniform(), 8.0 + 32.0 * lcg.uniform()))
        .unzip();
    let rounded = |v: &[f64]| v.iter().map(|v| to_a_32nd(*v)).collect();
    let coarse = Map::new(48, 48, rounded(&x), rounded(&y)).unwrap();
    let fine = Map::new(48, 48, x, y).unwrap();
    let of = |map| {
        warp(
            &image,
            map,
            Lobes::Four,
            Border::Reflect,
            SimdLevel::detect(),
        )
        .image
    };
    let (fine, coarse) = (of(&fine), of(&coarse));
    let worst = fine
        .data()
        .iter()
        .zip(coarse.data())
        .map(|(a, b)| f64::from((a - b).abs()))
        .fold(0.0, f64::max);
    assert!(worst <= slope / 64.0, "{worst} above {}", slope / 64.0);
    assert!(
        worst > slope / 128.0,
        "{worst}: the bound is never neared, so nothing was tested"
    );
}
