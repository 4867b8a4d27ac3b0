//! Correction of views that were shifted by known smooth fields, from the mosaic to the corrected picture.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{qpalgo, texture, write_exr};
use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};
use quadpixel_algorithms::aberration_score::AberrationScore;
use quadpixel_algorithms::calibration::Calibration;
use quadpixel_algorithms::load;

const SIDE: usize = 96;

/// Field of sub-pixel `view` (B, A, D, C: opposite ones are opposite, as those of a lens) and channel, px.
fn field(view: usize, channel: usize, [x, y]: [f64; 2]) -> [f64; 2] {
    let [u, v] = [x, y].map(|p| 2.0 * p / SIDE as f64 - 1.0);
    let (sx, sy) = ([-1.0, 1.0][view % 2], [-1.0, 1.0][view / 2]);
    let spread = 0.05 * (channel as f64 - 1.0); // lateral colour
    [
        sx * (0.3 + 0.15 * u - 0.1 * v * v) + spread * u,
        sy * (0.25 - 0.1 * v + 0.1 * u * v) + spread * v,
    ]
}

/// Views in which what lies at x in the reference lies at x + d(x), as a mosaic of 2 × 2.
fn mosaic() -> Image {
    let mut mosaic = Image::zeros(2 * SIDE, 2 * SIDE, 3);
    for view in 0..4 {
        for y in 0..SIDE {
            for x in 0..SIDE {
                for c in 0..3 {
                    let to = [x as f64, y as f64];
                    let mut from = to;
                    for _ in 0..20 {
                        let d = field(view, c, from); // a contraction: its slopes are far below 1
                        from = [to[0] - d[0], to[1] - d[1]];
                    }
                    let value = 0.25 * texture(from[0], from[1]) as f32;
                    mosaic.pixel_mut(2 * x + view % 2, 2 * y + view / 2)[c] = value;
                }
            }
        }
    }
    mosaic
}

const CALIBRATE: [&str; 8] = [
    "correct-aberrations",
    "--calibration",
    "raw.exr",
    "--subpixels",
    "2x2",
    "--pitch-um",
    "1.6",
    "-o",
];

fn calibrated(folder: &Path) -> Calibration {
    write_exr(&folder.join("raw.exr"), &mosaic());
    let run = qpalgo(
        &[&CALIBRATE[..], &["camera.json", "--degree", "3"]].concat(),
        folder,
    );
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    Calibration::from_json(&std::fs::read(folder.join("camera.json")).unwrap()).unwrap()
}

#[test]
fn a_smoothing_that_is_none_is_refused_before_it_takes_memory() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("raw.exr"), &mosaic());
    for (more, why) in [
        (&["--smoothing", "1e300"][..], "1.5 to 100"),
        (&["--smoothing", "0.5"], "1.5 to 100"),
        (
            &["--smoothing", "2", "--align", "texture"],
            "with --align centroid",
        ),
    ] {
        let run = qpalgo(&[&CALIBRATE[..], &["c.json"], more].concat(), folder.path());
        common::refused(&run, why);
    }
}

#[test]
fn known_fields_come_back_and_the_corrected_sum_is_the_texture() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let calibration = calibrated(here);
    let fields = calibration.smooth_fields().unwrap();
    assert_eq!(fields.len(), 12);
    let mut squares = 0.0;
    for (i, found) in fields.iter().enumerate() {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let at = [x as f64, y as f64];
                let (found, wanted) = (found.at(at), field(i / 3, i % 3, at));
                squares += (found[0] - wanted[0]).powi(2) + (found[1] - wanted[1]).powi(2);
            }
        }
    }
    let rms = (squares / (12 * SIDE * SIDE) as f64).sqrt();
    assert!(rms <= 0.03, "residual of {rms} px");

    let apply = [
        "correct-aberrations",
        "--apply",
        "camera.json",
        "raw.exr",
        "--subpixels",
        "2x2",
        "--pitch-um",
        "1.6",
        "-o",
        "out",
        "--json",
    ];
    let run = qpalgo(&apply, here);
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    let json: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!(json["aberration"].is_null());
    let corrected = load::image(&here.join("out/corrected.exr")).unwrap();
    let valid = load::image(&here.join("out/valid.png")).unwrap();
    let raw = mosaic();
    let (mut before, mut after, mut slope) = (0.0, 0.0, 0.0);
    for y in 12..SIDE - 12 {
        for x in 12..SIDE - 12 {
            assert_eq!(valid.pixel(x, y), [1.0]);
            let sum: f32 = (0..4)
                .map(|v| raw.pixel(2 * x + v % 2, 2 * y + v / 2)[1])
                .sum();
            let wanted = texture(x as f64, y as f64);
            before += (f64::from(sum) - wanted).powi(2);
            after += (f64::from(corrected.pixel(x, y)[1]) - wanted).powi(2);
            let [right, down] = [(1e-3, 0.0), (0.0, 1e-3)]
                .map(|(dx, dy)| texture(x as f64 + dx, y as f64 + dy) - wanted);
            slope += (right * right + down * down) / 1e-6;
        }
    }
    // A residual shift of 0.03 px is worth 0.03 times the slope; what was blur is gone.
    assert!(after.sqrt() < 0.03 * f64::sqrt(slope), "{after}, {slope}");
    assert!(after < before / 10.0, "{before} to {after}");
    for name in ["B", "A", "D", "C"] {
        assert!(here.join(format!("out/view_{name}.exr")).is_file());
    }
}

#[test]
fn another_camera_a_broken_file_and_a_bare_wall_are_refused_without_output() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    calibrated(here);
    write_exr(&here.join("small.exr"), &Image::zeros(64, 64, 3));
    let refused = |arguments: &[&str], text: &str| {
        let run = qpalgo(arguments, here);
        common::refused(&run, text);
        assert!(!here.join("no").exists());
    };
    let apply = |capture, subpixels, pitch| {
        [
            "correct-aberrations",
            "--apply",
            "camera.json",
            capture,
            "--subpixels",
            subpixels,
            "--pitch-um",
            pitch,
            "-o",
            "no",
        ]
    };
    refused(&apply("raw.exr", "2x2", "2.0"), "pitch_um");
    refused(&apply("raw.exr", "4x4", "1.6"), "subpixels");
    refused(&apply("small.exr", "2x2", "1.6"), "size");
    refused(&apply("none.exr", "2x2", "1.6"), "none.exr");
    refused(&apply("raw.exr", "2x2", "0"), "pitch");
    refused(
        &[
            "correct-aberrations",
            "--apply",
            "camera.json",
            "raw.exr",
            "-o",
            "no",
        ],
        "--subpixels",
    );
    let whole = std::fs::read(here.join("camera.json")).unwrap();
    std::fs::write(here.join("camera.json"), &whole[..whole.len() / 2]).unwrap();
    refused(&apply("raw.exr", "2x2", "1.6"), "camera.json");
    // A broken camera.json beside a capture would be refused as the camera's description.
    std::fs::write(here.join("camera.json"), &whole).unwrap();
    write_exr(&here.join("raw.exr"), &Image::zeros(2 * SIDE, 2 * SIDE, 3));
    refused(&[&CALIBRATE[..], &["no"]].concat(), "textured");
}

#[test]
fn the_score_is_the_distance_from_traced_minus_paraxial() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrated(folder.path());
    let fields = calibration.smooth_fields().unwrap();
    let truth = |view: usize| {
        let mut image = Image::zeros(SIDE, SIDE, 4);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let [dx, dy] = fields[3 * view + 1].at([x as f64, y as f64]);
                let own = [0.7, -0.4]; // of the defocus: must not count
                let pixel = [dx + own[0] + 0.03, dy + own[1] - 0.04, own[0], own[1]];
                image
                    .pixel_mut(x, y)
                    .copy_from_slice(&pixel.map(|v| v as f32));
            }
        }
        image.pixel_mut(3, 5).fill(f32::NAN);
        image
    };
    let images: Vec<Image> = (0..4).map(truth).collect();
    let layers: Vec<Layer<'_>> = (["B", "A", "D", "C"].iter().zip(&images))
        .map(|(name, image)| Layer {
            name,
            channels: &["dx", "dy", "paraxial_dx", "paraxial_dy"],
            image,
            sample: Sample::Float,
        })
        .collect();
    write_layers(
        &folder.path().join("disparity.exr"),
        &layers,
        Compression::Zip,
    )
    .unwrap();
    let score = AberrationScore::read(&calibration, folder.path()).unwrap();
    assert_eq!(score.count, 4 * (SIDE * SIDE - 1));
    assert!((score.residual.rms_px - 0.05).abs() < 1e-6);
    assert!((score.residual.p95_px - 0.05).abs() < 1e-6);
    assert!(score.truth.rms_px > 0.2);
}
