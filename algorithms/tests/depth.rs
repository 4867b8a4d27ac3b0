//! Depth of two analytic planes, by the dataset's relation of disparity and depth.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::path::Path;
use std::process::Command;

use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};

const SIDE: usize = 120;
const DEPTHS_M: [f64; 2] = [0.5, 1.2];
const FOCUS_M: f64 = 0.75;
const KAPPA: f64 = 0.3;

fn write(path: &Path, channels: &[&str], image: &Image) {
    let layer = Layer {
        name: "",
        channels,
        image,
        sample: Sample::Float,
    };
    write_layers(path, &[layer], Compression::Zip).unwrap();
}

/// Sum of waves of 5 to 15 px in many directions: an analytic texture.
fn texture(x: f64, y: f64) -> f64 {
    let waves = (0..40).map(|k| {
        let k = f64::from(k);
        let (angle, period) = (2.399_963 * k, 5.0 + 10.0 * (0.618_034 * k).fract());
        let along = x * angle.cos() + y * angle.sin();
        (std::f64::consts::TAU * along / period + 1.7 * k * k).cos()
    });
    0.5 + waves.sum::<f64>() / 60.0
}

/// The specification's example, with this camera's numbers. Returns fx A, px·m, and p, m.
fn meta(folder: &Path) -> (f64, f64) {
    let example = include_str!("../../datasets_spec/schema/meta.example.json");
    let mut meta: serde_json::Value = serde_json::from_str(example).unwrap();
    meta["sensor"]["width_px"] = SIDE.into();
    meta["sensor"]["height_px"] = SIDE.into();
    meta["sensor"]["subpixels"] = serde_json::json!({ "columns": 2, "rows": 2 });
    meta["focus"]["distance_m"] = FOCUS_M.into();
    meta["raw"]["format"] = "exr".into();
    for level in ["black_level", "white_level", "linear_at_white"] {
        meta["raw"][level] = serde_json::Value::Null;
    }
    meta["coc_disparity"] = serde_json::Value::Null;
    let lens = &meta["intrinsics"];
    let number = |name: &str| lens[name].as_f64().unwrap();
    let found = (
        number("fx_px") * number("entrance_pupil_diameter_m"),
        number("pinhole_behind_vertex_m"),
    );
    std::fs::write(folder.join("meta.json"), meta.to_string()).unwrap();
    found
}

#[test]
fn two_planes_come_out_at_their_depths() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (fx_a, p) = meta(here);
    // D = κ fx A (1/d − 1/d_f): the upper half is the near plane.
    let shift = |z: f64| KAPPA * fx_a * (1.0 / (z + p) - 1.0 / (FOCUS_M + p));
    let plane = |y: usize| usize::from(y >= SIDE / 2);
    let mut mosaic = Image::zeros(2 * SIDE, 2 * SIDE, 3);
    let mut depth = Image::zeros(SIDE, SIDE, 1);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let z = DEPTHS_M[plane(y)];
            depth.pixel_mut(x, y)[0] = z as f32;
            for view in 0..4 {
                // Left and top see the point half of D to the right and below.
                let [sx, sy] = [view % 2, view / 2].map(|i| [0.5, -0.5][i] * shift(z));
                let value = 0.25 * texture(x as f64 - sx, y as f64 - sy) as f32;
                let pixel = mosaic.pixel_mut(2 * x + view % 2, 2 * y + view / 2);
                pixel.fill(value);
            }
        }
    }
    write(&here.join("raw.exr"), &["R", "G", "B"], &mosaic);
    write(&here.join("depth.exr"), &["Z"], &depth);
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_qpalgo"))
            .args(arguments)
            .current_dir(here)
            .output()
            .unwrap()
    };
    let kappa = KAPPA.to_string();
    let common = ["depth", ".", "-o", "out", "--search", "4"];
    let output = run(&common);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(
        error.contains("--kappa") && !here.join("out").exists(),
        "{error}"
    );

    let output = run(&[&common[..], &["--kappa", &kappa, "--score", "--json"]].concat());
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{error}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["measured_share"].as_f64().unwrap() > 0.4, "{json}");
    let found = quadpixel::image::raster::read(&here.join("out/depth.exr")).unwrap();
    let mut compared = 0;
    for y in 0..SIDE {
        for x in 0..SIDE {
            let z = f64::from(found.pixel(x, y)[0]);
            // Windows across the edge between the planes see both.
            if z.is_finite() && y.abs_diff(SIDE / 2) > 20 {
                let wanted = DEPTHS_M[plane(y)];
                let apart = KAPPA * fx_a * (1.0 / (z + p) - 1.0 / (wanted + p));
                assert!(
                    apart.abs() < 0.02,
                    "({x}, {y}): {z} m for {wanted}, {apart} px"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > SIDE * SIDE / 8, "{compared}");
    assert!(here.join("out/confidence.exr").is_file() && here.join("out/depth.png").is_file());
}
