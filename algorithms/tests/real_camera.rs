//! The parts of `examples/real_camera`, and the captures themselves where `QUADPIXEL_REAL_DATA` names their folder.
#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(dead_code)] // because the example uses more of its modules than the tests do

#[path = "../examples/real_camera/camera.rs"]
mod camera;
#[path = "../examples/real_camera/compare.rs"]
mod compare;
#[path = "../examples/real_camera/data.rs"]
mod data;
#[path = "../examples/real_camera/measure.rs"]
mod measure;
#[path = "../examples/real_camera/simulate.rs"]
mod simulate;

use std::path::PathBuf;

use data::{Captures, Views};
use quadpixel::image::Image;

/// A smooth irregular colour picture, 0 to 1, moved by `dx` to the right.
fn picture(width: usize, height: usize, dx: f64) -> Image {
    let mut image = Image::zeros(width, height, 3);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as f64 - dx, y as f64);
            let wave = |a: f64, b: f64| (a * u + b * v + 0.02 * (0.3 * a * u).sin() * v).sin();
            let sum = wave(0.31, 0.13) + wave(-0.17, 0.4) + wave(0.5, -0.21) * wave(0.07, 0.11);
            let value = (0.5 + 0.16 * sum) as f32;
            image
                .pixel_mut(x, y)
                .copy_from_slice(&[value, value, value]);
        }
    }
    image
}

#[test]
fn a_shift_of_whole_windows_is_found() {
    // The views' own interpolation is exact here (a formula is moved), the kernel's is not: 0.01 px.
    let parts = measure::thirds(288, 192);
    for shift in [-1.7, 0.05, 0.98] {
        let (left, right) = (picture(288, 192, shift), picture(288, 192, 0.0));
        for found in measure::shifts(&left, &right, &parts).unwrap() {
            assert!((found.whole_px - shift).abs() < 0.01, "{}", found.whole_px);
        }
    }
}

#[test]
fn one_tone_curve_makes_a_brightened_copy_equal_and_noise_gives_its_own_psnr() {
    let plain = picture(96, 80, 0.0);
    let mut brighter = plain.clone();
    brighter
        .data_mut()
        .iter_mut()
        .for_each(|v| *v = v.powf(0.7));
    let pair = |image: &Image| Views {
        left: image.clone(),
        right: image.clone(),
    };
    let like = compare::compare(&pair(&plain), &pair(&brighter));
    // Two codes of 256 bins lie 1/256 apart; a line between their middles is far nearer.
    assert!(like.psnr_db > 55.0 && like.ssim > 0.999, "{like:?}");

    // Views off by ±e each way of a flat grey code: the curve cannot follow, PSNR = −20 log e.
    let grey = |code: f32| {
        let mut image = Image::zeros(96, 80, 3);
        image
            .data_mut()
            .fill(quadpixel::image::srgb::to_linear(code));
        image
    };
    let real = Views {
        left: grey(0.52),
        right: grey(0.48),
    };
    let like = compare::compare(&pair(&grey(0.5)), &real);
    assert!(
        (like.psnr_db - -20.0 * 0.02f64.log10()).abs() < 0.05,
        "{like:?}"
    );
}

#[test]
fn half_disks_lie_four_thirds_over_pi_of_the_radius_from_the_middle() {
    // A white point in front of the focus: the left view shows it on the right.
    let mut point = Image::zeros(41, 41, 3);
    point.pixel_mut(20, 20).fill(1.0);
    let views = simulate::half_disks(&point, -12.0);
    let centroid = |image: &Image| {
        let (mut sum, mut all) = (0.0, 0.0);
        for y in 0..41 {
            for x in 0..41 {
                let v = f64::from(image.pixel(x, y)[1]);
                sum += v * (x as f64 - 20.0);
                all += v;
            }
        }
        assert!((all - 1.0).abs() < 1e-5);
        sum / all
    };
    let expected = 4.0 / (3.0 * std::f64::consts::PI) * 6.0;
    assert!((centroid(&views.left) - expected).abs() < 0.01 * expected);
    assert!((centroid(&views.right) + expected).abs() < 0.01 * expected);
}

#[test]
fn folders_without_captures_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let error = Captures::find(folder.path()).err().unwrap().to_string();
    assert!(error.contains("no capture in it"), "{error}");
}

#[test]
fn shifts_of_the_real_captures_are_those_measured_independently() {
    let Some(folder) = std::env::var_os("QUADPIXEL_REAL_DATA").map(PathBuf::from) else {
        eprintln!("skipped: QUADPIXEL_REAL_DATA does not name the captures' folder");
        return;
    };
    let captures = Captures::find(&folder).unwrap();
    // x_L − x_R, px, in the middle; measured by another program with the same model, whose windows may lie a little otherwise: 0.05 px.
    for (distance_mm, mark, expected) in [
        (600.0, 4.0, 0.98),
        (600.0, 20.0, 0.03),
        (1500.0, 20.0, -0.03),
    ] {
        let flat = (captures.flats.iter()).find(|f| f.distance_mm == distance_mm && f.mark == mark);
        let views = Views::read(&flat.unwrap().folder).unwrap();
        let parts = measure::thirds(views.left.width(), views.left.height());
        let middle = &measure::shifts(&views.left, &views.right, &parts).unwrap()[1];
        assert!(
            (middle.whole_px - expected).abs() < 0.05,
            "{distance_mm} F/{mark}: {}",
            middle.whole_px
        );
    }
}
