//! The parts of `examples/real_camera`, and the captures themselves where `QUADPIXEL_REAL_DATA` names their folder.
#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(dead_code)] // because the example uses more of its modules than the tests do

#[path = "../real_camera/camera.rs"]
mod camera;
#[path = "../real_camera/compare.rs"]
mod compare;
#[path = "../real_camera/data.rs"]
mod data;
#[path = "../real_camera/exact.rs"]
mod exact;
#[path = "../real_camera/measure.rs"]
mod measure;
#[path = "../real_camera/noise.rs"]
mod noise;
#[path = "../../tests/common/random.rs"]
mod random;
#[path = "../real_camera/simulate.rs"]
mod simulate;
#[path = "../real_camera/spread.rs"]
mod spread;

use std::path::PathBuf;

use data::{Captures, Views};
use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::image::Image;
use quadpixel::response::{AngularResponse, Provenance, ResponseAxes, ResponseMeta};
use quadpixel::sensor::MovingFrame;
use quadpixel::sensor::Subpixels;

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
fn captures_are_found_by_pattern_and_what_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = Captures::find(folder.path()).err().unwrap().to_string();
    assert!(error.contains("no capture in it"), "{error}");
    for (below, names) in [
        ("flat/0850/f2.8", &["l.png", "r.png"][..]),
        ("flat/0600/f20", &["l.png", "r.png"]),
        ("flat/0600/f4", &["l.png"]),
        ("flat/near/f4", &["l.png", "r.png"]),
        ("box/007", &["l.png", "r.png", "d.png"]),
        ("casual-orbbec-002", &["l.png", "r.png", "d.png"]),
        ("lens", &["rf50mm.zmx"]),
    ] {
        let here = folder.path().join(below);
        std::fs::create_dir_all(&here).unwrap();
        (names.iter()).for_each(|n| std::fs::write(here.join(n), b"").unwrap());
    }
    let found = Captures::find(folder.path()).unwrap();
    let flats: Vec<_> = (found.flats.iter())
        .map(|f| (f.distance_mm, f.mark))
        .collect();
    assert_eq!(flats, [(600.0, 20.0), (850.0, 2.8)]);
    let scenes: Vec<_> = (found.scenes.iter())
        .map(|s| (s.name.as_str(), s.kind()))
        .collect();
    assert_eq!(
        scenes,
        [("box-007", "box"), ("casual-orbbec-002", "casual")]
    );
    assert_eq!(found.left_out.len(), 2, "{:?}", found.left_out);
    assert!(found.left_out[0].contains("flat/0600/f4: r.png is missing"));
    assert!(found.left_out[1].contains("flat/near/f4: neither d.png"));
}

/// A table on v = u = −0.4 … 0.4 of a pixel of 6 µm: P_right(u), the left one its mirror image.
fn table(right: impl Fn(f64) -> f64) -> AngularResponse {
    let axis: Vec<f64> = (-80..=80).map(|i| f64::from(i) / 200.0).collect();
    let row = axis
        .iter()
        .flat_map(|u| [right(-u) as f32, right(*u) as f32]);
    let row: Vec<f32> = row.collect();
    let axes = ResponseAxes {
        wavelengths_nm: vec![550.0],
        shifts_um: vec![[0.0, 0.0]],
        u: axis.clone(),
        v: axis.clone(),
    };
    let meta = ResponseMeta {
        model: "a test".into(),
        settings: Provenance::Imported {
            file: "made up".into(),
            symmetric: false,
        },
        pixel: PixelStack::builtin("1.6um").unwrap(),
        pitch_um: 6.0,
        subpixels: Subpixels::DUAL_X,
        frame: MovingFrame::new(1.5, 5.0).unwrap(),
        key: String::new(),
        shift_grid: None,
        chief_ray_shifts: None,
        corrections: Vec::new(),
        charge: Default::default(),
    };
    AngularResponse::new(axes, meta, row.repeat(axis.len())).unwrap()
}

#[test]
fn wandering_charge_makes_an_error_function_of_a_sharp_split() {
    let sigma_um = 0.5;
    let sharp = table(|u| 0.5 * (1.0 + u.signum() * f64::from(u8::from(u != 0.0))) * 0.8);
    let spread = spread::spread(&sharp, sigma_um).unwrap();
    let lookup = spread.interpolator(550.0);
    // Light from u lands H t beside the split, t = u/√(n² − u²): the part beyond it is Φ(H t/σ), here by summing the
    // Gaussian.
    for u in [-0.3, -0.1, -0.04, 0.0, 0.04, 0.1, 0.3] {
        let z = 5.0 * u / f64::sqrt(2.25 - u * u) / sigma_um;
        let steps = 4000;
        let cut = |k: i32| -8.0 + (z + 8.0) * (f64::from(k) + 0.5) / f64::from(steps);
        let gauss = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let phi: f64 =
            (0..steps).map(|k| gauss(cut(k))).sum::<f64>() * (z + 8.0) / f64::from(steps);
        let mut p = [0.0f32; 2];
        lookup.weights(u as f32, 0.0, &mut p);
        // The sum of 25 places a quarter of σ apart over a step that the table blurs by 0.005 in u, a thirtieth of σ:
        // half a place's weight, 0.1 · 0.8/2, at the most; nothing at 0.
        assert!(
            (f64::from(p[1]) / 0.8 - phi).abs() < 0.05,
            "{u}: {} {phi}",
            p[1]
        );
        assert!((f64::from(p[0] + p[1]) - 0.8).abs() < 1e-5);
    }
    // Where P goes straight with the place of the light, nothing changes.
    let straight = table(|u| 0.3 + 0.2 * u / f64::sqrt(2.25 - u * u));
    let same = spread::spread(&straight, sigma_um).unwrap();
    let (mut p, mut q) = ([0.0f32; 2], [0.0f32; 2]);
    straight.interpolator(550.0).weights(0.05, 0.0, &mut p);
    same.interpolator(550.0).weights(0.05, 0.0, &mut q);
    assert!((p[1] - q[1]).abs() < 1e-4, "{p:?} {q:?}");
}

#[test]
fn the_view_with_less_light_is_known_by_its_noise() {
    // Uniform noise whose width goes from 2 to 4 codes in the left view and back in the right one, on smooth grey;
    // equally bright.
    let mut random = random::Lcg(1);
    let mut uniform = || random.uniform() - 0.5;
    let mut view = |width_at: &dyn Fn(f64) -> f64| {
        let mut image = Image::zeros(386, 258, 3);
        for y in 0..258 {
            for x in 0..386 {
                let code = 120.0 + 0.1 * y as f64 + width_at(x as f64 / 386.0) * uniform();
                let linear = quadpixel::image::srgb::to_linear((code / 255.0) as f32);
                image.pixel_mut(x, y).fill(linear);
            }
        }
        image
    };
    let views = Views {
        left: view(&|t| 2.0 + 2.0 * t),
        right: view(&|t| 4.0 - 2.0 * t),
    };
    for (i, found) in noise::left_over_right(&views).into_iter().enumerate() {
        let at = |t: f64| ((2.0 + 2.0 * t) / (4.0 - 2.0 * t)).powi(2);
        let (low, high) = (at(i as f64 / 6.0), at((i as f64 + 1.0) / 6.0));
        // The quietest blocks may lie anywhere in the part. They are picked by their own noise, too: the quietest 30 %
        // are by 1.16 standard deviations (9 %, of 256 pixels) quieter in the louder view.
        assert!(
            found > 0.9 * low && found < high / 0.9,
            "{i}: {found} {low} {high}"
        );
    }
}

#[test]
fn the_corrected_table_is_the_exact_one_on_its_meridian_and_mirrored() {
    let wave = table(|u| 0.3 + 0.5 * u);
    let run = |u: f64, left: f64, right: f64| exact::Run {
        u,
        p: [left, right],
        seconds: 0.0,
    };
    let runs = exact::Runs {
        pixel: PixelStack::builtin("6um-dual").unwrap(),
        settings: RcwaSettings::draft(),
        runs: vec![
            run(0.0, 0.31, 0.31),
            run(0.2, 0.22, 0.42),
            run(0.4, 0.1, 0.5),
        ],
    };
    let corrected = runs.correct(&wave).unwrap();
    let lookup = corrected.interpolator(550.0);
    for (u, v, expected) in [
        (0.2, 0.0, [0.22, 0.42]),
        (-0.2, 0.0, [0.42, 0.22]),
        (0.0, 0.3, [0.31, 0.31]),
        // Half way: the mean of the differences 0.01, 0.01 and 0.02, 0.02 beside 0.25, 0.35.
        (0.1, 0.1, [0.265, 0.365]),
    ] {
        let mut p = [0.0f32; 2];
        lookup.weights(u, v, &mut p);
        for (p, e) in p.iter().zip(expected) {
            assert!((f64::from(*p) - e).abs() < 1e-4, "{u} {v}: {p} {e}");
        }
    }
}

#[test]
fn shifts_of_the_real_captures_are_those_measured_independently() {
    let Some(folder) = std::env::var_os("QUADPIXEL_REAL_DATA").map(PathBuf::from) else {
        eprintln!("skipped: QUADPIXEL_REAL_DATA does not name the captures' folder");
        return;
    };
    let captures = Captures::find(&folder).unwrap();
    // x_L − x_R, px, in the middle; measured by another program with the same model, whose windows may lie a little
    // otherwise: 0.05 px.
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
