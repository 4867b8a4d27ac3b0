//! Pictures as they come: integers and floats, any scale, one pixel, odd sizes, layers, mosaics with a `meta.json` of
//! their own.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, mosaic, shifted, views, write_exr, write_meta, write_views};
use quadpixel::image::raster::{self, Levels};
use quadpixel::image::{Image, channel};

fn read(folder: &Path, name: &str) -> Image {
    raster::read(&folder.join(name)).unwrap()
}

/// Codes 0, 1, 2, … of 6 × 4 pixels, `channels` each.
fn codes(channels: usize) -> Vec<u16> {
    (0..24 * channels as u16)
        .map(|i| 1000 * (i % 61) + i)
        .collect()
}

#[test]
fn integer_and_float_files_are_read_as_parts_of_their_full_scale() {
    use image::{DynamicImage, ImageBuffer, Luma, Rgb};
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let gray8: Vec<u8> = codes(1).iter().map(|c| (c >> 8) as u8).collect();
    let rgb8: Vec<u8> = codes(3).iter().map(|c| (c >> 8) as u8).collect();
    let rgb_float: Vec<f32> = codes(3)
        .iter()
        .map(|c| f32::from(*c) / 777.0 - 9.0)
        .collect();
    let buffers: [(&str, DynamicImage); 5] = [
        (
            "8",
            ImageBuffer::<Luma<u8>, _>::from_raw(6, 4, gray8)
                .unwrap()
                .into(),
        ),
        (
            "16",
            ImageBuffer::<Luma<u16>, _>::from_raw(6, 4, codes(1))
                .unwrap()
                .into(),
        ),
        (
            "rgb8",
            ImageBuffer::<Rgb<u8>, _>::from_raw(6, 4, rgb8.clone())
                .unwrap()
                .into(),
        ),
        (
            "rgb16",
            ImageBuffer::<Rgb<u16>, _>::from_raw(6, 4, codes(3))
                .unwrap()
                .into(),
        ),
        (
            "float",
            ImageBuffer::<Rgb<f32>, _>::from_raw(6, 4, rgb_float.clone())
                .unwrap()
                .into(),
        ),
    ];
    for (name, buffer) in buffers {
        for kind in ["png", "tif"] {
            if name == "float" && kind == "png" {
                continue;
            }
            let file = format!("{name}.{kind}");
            buffer.save(here.join(&file)).unwrap();
            json(&["sai", &file, "--subpixels", "3x2", "-o", "out"], here);
            // View (i, j) = (2, 1) of pixel (1, 1) is mosaic pixel (5, 3): the last one.
            let found = read(here, "out/view_r1c2.exr");
            assert_eq!((found.width(), found.height()), (2, 2), "{file}");
            let found = found.pixel(1, 1).to_vec();
            let part = |code: u16| f32::from(code) / 65535.0;
            let wanted: Vec<f32> = match name {
                "8" => vec![f32::from((codes(1)[23] >> 8) as u8) / 255.0],
                "16" => vec![part(codes(1)[23])],
                "rgb8" => rgb8[69..].iter().map(|c| f32::from(*c) / 255.0).collect(),
                "rgb16" => codes(3)[69..].iter().map(|c| part(*c)).collect(),
                _ => rgb_float[69..].to_vec(),
            };
            assert_eq!(found.len(), wanted.len(), "{file}");
            for (a, b) in found.iter().zip(&wanted) {
                assert!((a - b).abs() <= 1e-6 * b.abs(), "{file}: {a} is not {b}");
            }
        }
    }
}

#[test]
fn pngs_of_views_and_sums_are_full_at_the_mosaics_white_times_their_views() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let raw = mosaic(24, |_, _| 0.0, 0.9);
    // The same mosaic as a PNG with a black level and a white of 0.5, beside its meta.json.
    write_exr(&here.join("raw.exr"), &raw);
    std::fs::create_dir(here.join("s")).unwrap();
    let levels = Levels {
        black: 1024,
        white: 61000,
        linear_at_white: 0.5,
    };
    raster::write_png16(&here.join("s/raw.png"), &raw, levels).unwrap();
    write_meta(&here.join("s"), 24, |meta| {
        meta["raw"]["black_level"] = levels.black.into();
        meta["raw"]["white_level"] = levels.white.into();
        meta["raw"]["linear_at_white"] = levels.linear_at_white.into();
    });
    json(&["sai", "raw.exr", "--subpixels", "2x2", "-o", "e"], here);
    json(&["sai", "s/raw.png", "-o", "p"], here);
    json(&["sai", "s", "--format", "png", "-o", "q"], here);
    json(
        &[
            "sai",
            "raw.exr",
            "--subpixels",
            "2x2",
            "--format",
            "png",
            "-o",
            "r",
        ],
        here,
    );
    for (name, added) in [("view_B", 1.0), ("sum_L", 2.0), ("sum_all", 4.0)] {
        let wanted = read(here, &format!("e/{name}.exr"));
        for (file, white) in [
            (format!("p/{name}.exr"), 1.0),
            (format!("q/{name}.png"), 0.5 * added),
            (format!("r/{name}.png"), added),
        ] {
            // A code of the mosaic is 0.5/59976 wide and one of the output white/65535; both are rounded to the
            // nearest.
            let bound = 0.5 * (added * 0.5 / 59976.0 + white / 65535.0) + 1e-6;
            for (found, wanted) in read(here, &file).data().iter().zip(wanted.data()) {
                let apart = (f64::from(*found) * white - f64::from(*wanted)).abs();
                assert!(apart <= bound, "{file}: {found} for {wanted}");
            }
        }
    }
}

#[test]
fn an_exr_of_views_gives_what_its_mosaic_gives() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let raw = mosaic(64, |x, _| 0.5 + 0.003 * x as f64, 1.0);
    write_exr(&here.join("raw.exr"), &raw);
    let mut images = views(&raw);
    images.push(Image::zeros(64, 64, 3)); // a sum that is none must not be looked at
    write_views(
        &here.join("views.exr"),
        &["B", "A", "D", "C", "sum"],
        &images,
    );
    let quad = ["--subpixels", "2x2"];
    let both = |command: &[&str], more: &[&str], out: &str| {
        let of = |file: &str, given: &[&str], to: &str| {
            let command: Vec<&str> = command
                .iter()
                .map(|c| if *c == "FILE" { file } else { c })
                .collect();
            json(&[&command[..], given, more, &["-o", to]].concat(), here)
        };
        let [a, b] = [format!("a_{out}"), format!("b_{out}")];
        of("raw.exr", &quad, &a);
        of("views.exr", &[], &b);
        [a, b]
    };
    let same = |[a, b]: [String; 2]| {
        let [a, b] = [a, b].map(|name| std::fs::read(here.join(name)).unwrap());
        assert!(a == b);
    };
    let [a, b] = both(&["sai", "FILE"], &[], "views");
    for name in ["view_C.exr", "sum_T.exr", "sum_all.exr"] {
        same([format!("{a}/{name}"), format!("{b}/{name}")]);
    }
    same(both(
        &["refocus", "FILE", "--disparity", "0.7"],
        &[],
        "near.exr",
    ));
    let calibrate = ["correct-aberrations", "--calibration", "FILE"];
    same(both(&calibrate, &["--pitch-um", "2"], "camera.json"));
    let apply = ["correct-aberrations", "--apply", "a_camera.json", "FILE"];
    let [a, b] = both(&apply, &["--pitch-um", "2"], "corrected");
    same([format!("{a}/corrected.exr"), format!("{b}/corrected.exr")]);
}

#[test]
fn a_calibration_is_applied_to_a_png_mosaic_by_the_meta_json_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let raw = mosaic(64, |x, _| 0.5 + 0.003 * x as f64, 0.9);
    let levels = Levels {
        black: 512,
        white: 60000,
        linear_at_white: 0.25,
    };
    for name in ["png", "exr"] {
        std::fs::create_dir(here.join(name)).unwrap();
        write_meta(&here.join(name), 64, |meta| {
            let exr = name == "exr";
            let number = |v: serde_json::Value| if exr { serde_json::Value::Null } else { v };
            meta["raw"]["format"] = name.into();
            meta["raw"]["black_level"] = number(levels.black.into());
            meta["raw"]["white_level"] = number(levels.white.into());
            meta["raw"]["linear_at_white"] = number(levels.linear_at_white.into());
        });
    }
    write_exr(&here.join("exr/raw.exr"), &raw);
    raster::write_png16(&here.join("png/another_name.png"), &raw, levels).unwrap();
    let calibrate = [
        "correct-aberrations",
        "--calibration",
        "exr",
        "-o",
        "camera.json",
    ];
    json(&calibrate, here);
    let apply = |capture: &str, out: &str, format: &str| {
        let apply = [
            "correct-aberrations",
            "--apply",
            "camera.json",
            capture,
            "-o",
            out,
        ];
        let printed = json(&[&apply[..], &["--format", format]].concat(), here);
        assert!(printed["aberration"].is_null()); // no truth beside it
    };
    apply("exr", "a", "exr");
    apply("png/another_name.png", "b", "exr");
    apply("png/another_name.png", "c", "png");
    let wanted = read(here, "a/corrected.exr");
    // Four views rounded to half a code of 0.25/59488, each through a kernel (a = 4) whose weights add up to less than
    // 1.72 in absolute value on each axis (at half a pixel); the PNG is full at 4 × 0.25 and rounded again.
    let bound = 4.0 * 0.5 * (0.25 / 59488.0) * 1.72 * 1.72 + 1e-6;
    for (file, bound) in [
        ("b/corrected.exr", bound),
        ("c/corrected.png", bound + 0.5 / 65535.0),
    ] {
        for (found, wanted) in read(here, file).data().iter().zip(wanted.data()) {
            let clipped = wanted.clamp(0.0, 1.0);
            let wanted = if file.ends_with("png") {
                clipped
            } else {
                *wanted
            };
            let apart = f64::from(found - wanted).abs();
            assert!(apart <= bound, "{file}: {found} for {wanted}");
        }
    }
}

#[test]
fn images_scaled_by_1e6_give_the_same_shifts_and_sharpness_in_proportion() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut found = Vec::new();
    write_meta(here, 64, |meta| {
        meta["raw"] = serde_json::json!({
            "format": "exr", "black_level": null, "white_level": null, "linear_at_white": null, "clipped": 0
        });
    });
    for gain in [1.0, 1e-6, 1e6] {
        write_exr(&here.join("v.exr"), &shifted(64, [0.7, -0.3], gain));
        write_exr(&here.join("r.exr"), &shifted(64, [0.0, 0.0], gain));
        write_exr(&here.join("raw.exr"), &mosaic(64, |_, _| 0.6, gain));
        let shift = json(&["disparity", "v.exr", "r.exr", "-o", "d"], here);
        let sharp = json(&["sharpness", "v.exr"], here);
        json(&["sai", "raw.exr", "--subpixels", "2x2", "-o", "s"], here);
        let refocus = [
            "refocus",
            "raw.exr",
            "--subpixels",
            "2x2",
            "--disparity",
            "0.6",
        ];
        json(&[&refocus[..], &["-o", "f.exr"]].concat(), here);
        let camera = ["--subpixels", "2x2", "--pitch-um", "2"];
        let calibrate = [
            "correct-aberrations",
            "--calibration",
            "raw.exr",
            "-o",
            "c.json",
        ];
        let calibrated = json(&[&calibrate[..], &camera].concat(), here);
        json(
            &["depth", "raw.exr", "--sparse", "--kappa", "0.3", "-o", "z"],
            here,
        );
        let depth = f64::from(read(here, "z/depth.exr").pixel(32, 30)[0]);
        let value = |v: &serde_json::Value| v.as_f64().unwrap();
        let channel0 = &shift["channels"][0];
        let middle = |name: &str| f64::from(read(here, name).pixel(32, 30)[1]) / gain;
        found.push([
            value(&channel0["median_dx_px"]),
            value(&channel0["median_dy_px"]),
            value(&sharp["images"][0]["de"]),
            value(&sharp["images"][0]["wee"]) * gain.powi(0),
            value(&sharp["images"][0]["gradient"]) / gain,
            middle("s/sum_all.exr"),
            middle("f.exr"),
            depth,
            value(&calibrated["sharpness"]["corrected"]["gradient"]) / gain,
        ]);
    }
    assert!((found[0][0] - 0.7).abs() < 0.01 && (found[0][1] + 0.3).abs() < 0.01);
    for other in &found[1..] {
        for (i, (a, b)) in found[0].iter().zip(other).enumerate() {
            // Rounding to f32 differs between the scales: 6e-8, enlarged some tens of times on the way.
            assert!((b / a - 1.0).abs() < 1e-5, "number {i}: {a} and {b}");
        }
    }
}

#[test]
fn one_pixel_and_odd_sizes_go_through_sai_and_sharpness() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (width, height, subpixels) in [
        (1, 1, "1x1"),
        (2, 2, "2x2"),
        (2, 1, "2x1"),
        (1, 2, "1x2"),
        (3, 5, "3x5"),
        (9, 35, "3x5"),
        (7, 1, "1x1"),
        (1, 7, "1x1"),
    ] {
        for channels in [1, 2, 3, 5] {
            let data = (0..width * height * channels).map(|i| 0.1 + 0.01 * i as f32);
            let raw = Image::from_vec(width, height, channels, data.collect()).unwrap();
            write_exr(&here.join("raw.exr"), &raw);
            let printed = json(
                &["sai", "raw.exr", "--subpixels", subpixels, "-o", "out"],
                here,
            );
            let (m, n) = subpixels.split_once('x').unwrap();
            let [m, n]: [usize; 2] = [m, n].map(|t| t.parse().unwrap());
            assert_eq!(printed["width"], width / m);
            assert_eq!(printed["height"], height / n);
            let sum = read(here, "out/sum_all.exr");
            for c in 0..channels {
                let total = |image: &Image| -> f64 {
                    channel(image, c).data().iter().map(|v| f64::from(*v)).sum()
                };
                assert!((total(&sum) / total(&raw) - 1.0).abs() < 1e-6);
            }
            let measured = json(&["sharpness", "raw.exr", "out/sum_all.exr"][..2], here);
            let rows = measured["images"].as_array().unwrap();
            assert_eq!(rows.len(), channels);
            for row in rows {
                for name in ["de", "wee", "gradient"] {
                    assert!(row[name].as_f64().unwrap().is_finite(), "{subpixels} {row}");
                }
            }
        }
    }
}
