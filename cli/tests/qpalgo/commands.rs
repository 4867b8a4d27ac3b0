//! The binary as a user meets it: exit codes, one clear sentence, no partial output.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use common::{qpalgo, refused, write_exr};
use quadpixel::image::{Image, raster};

#[test]
fn sai_writes_views_and_sums_that_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut mosaic = Image::zeros(6, 4, 3);
    for (i, value) in mosaic.data_mut().iter_mut().enumerate() {
        *value = i as f32 / 128.0;
    }
    write_exr(&folder.path().join("raw.exr"), &mosaic);
    for format in ["exr", "png"] {
        let run = qpalgo(
            &[
                "sai",
                "raw.exr",
                "--subpixels",
                "2x2",
                "-o",
                "out",
                "--format",
                format,
            ],
            folder.path(),
        );
        assert_eq!(run.status.code(), Some(0));
        let read =
            |name: &str| raster::read(&folder.path().join(format!("out/{name}.{format}"))).unwrap();
        let near = |found: f32, wanted: f32| assert!((found - wanted).abs() < 1e-5);
        near(read("view_B").pixel(1, 1)[2], mosaic.pixel(2, 2)[2]);
        near(read("view_C").pixel(1, 1)[2], mosaic.pixel(3, 3)[2]);
        let scale = if format == "png" { 0.5 } else { 1.0 }; // a PNG holds the mean of two views
        let left = mosaic.pixel(2, 2)[0] + mosaic.pixel(2, 3)[0];
        near(read("sum_L").pixel(1, 1)[0], scale * left);
        let names = std::fs::read_dir(folder.path().join("out")).unwrap();
        let suffix = format!(".{format}");
        let written = names.filter(|n| {
            n.as_ref()
                .unwrap()
                .file_name()
                .to_string_lossy()
                .ends_with(&suffix)
        });
        assert_eq!(written.count(), 9);
    }
}

#[test]
fn sai_refuses_bad_input_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("odd.exr"), &Image::zeros(7, 4, 3));
    let mut nan = Image::zeros(8, 4, 3);
    nan.pixel_mut(5, 1)[1] = f32::NAN;
    write_exr(&here.join("nan.exr"), &nan);
    std::fs::write(here.join("empty.exr"), b"").unwrap();
    std::fs::write(here.join("empty.png"), b"").unwrap();
    let whole = std::fs::read(here.join("nan.exr")).unwrap();
    std::fs::write(here.join("cut.exr"), &whole[..whole.len() - 9]).unwrap();
    for (file, text) in [
        ("odd.exr", "7 × 4"),
        ("nan.exr", "(x 5, y 1)"),
        ("empty.exr", "empty.exr"),
        ("empty.png", "empty.png"),
        ("cut.exr", "cut.exr"),
        ("none.exr", "none.exr"),
    ] {
        let asked = ["sai", file, "--subpixels", "2x2", "-o", "out"];
        refused(&qpalgo(&asked, here), text);
    }
    refused(
        &qpalgo(&["sai", "odd.exr", "--subpixels", "7", "-o", "out"], here),
        "--subpixels",
    );
    refused(
        &qpalgo(&["sai", "odd.exr", "-o", "out"], here),
        "--subpixels",
    );
    assert!(!here.join("out").exists());
}

#[test]
fn sharpness_prints_its_choices_and_measures_an_8_bit_file_as_its_codes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let vectors = format!(
        "{}/../algorithms/tests/vectors/vectors_tiny8.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let file: serde_json::Value = serde_json::from_slice(&std::fs::read(vectors).unwrap()).unwrap();
    let rows = file["image8"].as_array().unwrap();
    let samples = rows.iter().flat_map(|row| row.as_array().unwrap());
    let codes: Vec<u8> = samples.map(|v| v.as_u64().unwrap() as u8).collect();
    raster::write_png8(&here.join("tiny.png"), &codes, 8, 8, 1).unwrap();
    for (preset, name) in [("table-2", "wee_sum2_k6"), ("wee-abstract", "wee_sqrt_k6")] {
        let run = qpalgo(
            &["sharpness", "tiny.png", "--json", "--preset", preset],
            here,
        );
        assert_eq!(run.status.code(), Some(0));
        let printed: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(printed["settings"]["wee_k"], 6);
        let found = &printed["images"][0];
        assert_eq!(found["de"].as_f64(), file["de"].as_f64());
        // 1e-6: the file's codes become f32 parts of 255 when read.
        let near = |found: &serde_json::Value, wanted: &serde_json::Value| {
            let ratio = found.as_f64().unwrap() / wanted.as_f64().unwrap();
            assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        };
        near(&found["wee"], &file[name]);
        near(&found["gradient"], &file["grad01"]["sobel"]);
    }
}

#[test]
fn sharpness_refuses_unequal_sizes_nan_and_unknown_presets() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("a.exr"), &Image::zeros(5, 4, 3));
    write_exr(&here.join("b.exr"), &Image::zeros(4, 4, 3));
    let mut nan = Image::zeros(5, 4, 3);
    nan.pixel_mut(4, 0)[2] = f32::INFINITY;
    write_exr(&here.join("nan.exr"), &nan);
    refused(
        &qpalgo(&["sharpness", "a.exr", "b.exr", "--json"], here),
        "b.exr",
    );
    refused(
        &qpalgo(&["sharpness", "a.exr", "nan.exr", "--json"], here),
        "(x 4, y 0)",
    );
    refused(
        &qpalgo(&["sharpness", "a.exr", "--preset", "best"], here),
        "--preset",
    );
    refused(
        &qpalgo(&["sharpness", "a.exr", "--wee-scale", "0"], here),
        "wee_scale",
    );
}

#[test]
fn refocus_writes_an_image_and_refuses_what_it_cannot_use() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mosaic = Image::from_vec(8, 6, 3, vec![0.25; 144]).unwrap();
    write_exr(&here.join("raw.exr"), &mosaic);
    let run = qpalgo(
        &[
            "refocus",
            "raw.exr",
            "--subpixels",
            "2x2",
            "--disparity",
            "-1.5",
            "-o",
            "out.exr",
        ],
        here,
    );
    assert_eq!(run.status.code(), Some(0));
    let out = raster::read(&here.join("out.exr")).unwrap();
    assert_eq!((out.width(), out.height()), (4, 3));
    assert!(out.data().iter().all(|v| (v - 1.0).abs() < 1e-6));
    let base = ["refocus", "raw.exr", "-o", "bad.exr", "--disparity"];
    for (more, text) in [
        (["inf", "--lobes", "4", "--subpixels", "2x2"], "--disparity"),
        (["1", "--lobes", "5", "--subpixels", "2x2"], "--lobes"),
        (["1", "--weights", "1,2", "--subpixels", "2x2"], "--weights"),
        (["1", "--lobes", "4", "--subpixels", "3x4"], "raw.exr"),
    ] {
        refused(&qpalgo(&[&base[..], &more[..]].concat(), here), text);
    }
    assert!(!here.join("bad.exr").exists());
}
