//! Bad input to every command: exit 2, one sentence that names the file, nothing on stdout, no file written.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, mosaic, qpalgo, refused, write_exr, write_meta, write_views};
use quadpixel::image::{Image, raster};

const SIDE: usize = 64;

/// Every way to give a command the picture `file`, with what its output would be.
fn all_commands(file: &str) -> Vec<Vec<&str>> {
    let quad = ["--subpixels", "2x2"];
    let camera = ["--subpixels", "2x2", "--pitch-um", "1.6"];
    vec![
        [&["sai", file, "-o", "out"][..], &quad].concat(),
        [&["sai", file, "-o", "out", "--format", "png"][..], &quad].concat(),
        [
            &["refocus", file, "--disparity", "1", "-o", "out"][..],
            &quad,
        ]
        .concat(),
        vec!["sharpness", file],
        vec!["sharpness", "good.exr", file],
        vec!["disparity", file, "good.exr", "-o", "out"],
        vec!["disparity", "good.exr", file, "-o", "out"],
        [&["disparity", file, "-o", "out"][..], &quad].concat(),
        [
            &["correct-aberrations", "--calibration", file, "-o", "out"][..],
            &camera,
        ]
        .concat(),
        [
            &[
                "correct-aberrations",
                "--apply",
                "camera.json",
                file,
                "-o",
                "out",
            ][..],
            &camera,
        ]
        .concat(),
    ]
}

/// A good mosaic and its calibration.
fn prepare(here: &Path) {
    write_exr(&here.join("good.exr"), &mosaic(SIDE, |_, _| 0.4, 1.0));
    let calibrate = [
        "correct-aberrations",
        "--calibration",
        "good.exr",
        "--subpixels",
        "2x2",
        "--pitch-um",
        "1.6",
        "-o",
        "camera.json",
    ];
    json(&calibrate, here);
}

#[test]
fn every_command_refuses_files_empty_cut_short_garbled_or_missing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here);
    let exr = std::fs::read(here.join("good.exr")).unwrap();
    raster::write_png8(&here.join("good.png"), &[100; 64 * 64], 64, 64, 1).unwrap();
    let png = std::fs::read(here.join("good.png")).unwrap();
    write_exr(&here.join("one.exr"), &Image::zeros(3, 3, 1));
    for (name, bytes) in [
        ("empty.exr", &[][..]),
        ("empty.png", &[]),
        ("empty.tif", &[]),
        ("cut.exr", &exr[..exr.len() / 2]),
        ("short.exr", &exr[..exr.len() - 1]),
        ("cut.png", &png[..png.len() / 2]),
        ("garbage.tif", b"II*\0garbage"),
        ("text.png", b"not a picture"),
    ] {
        std::fs::write(here.join(name), bytes).unwrap();
    }
    for file in [
        "empty.exr",
        "empty.png",
        "empty.tif",
        "cut.exr",
        "short.exr",
        "cut.png",
        "garbage.tif",
        "text.png",
        "none.exr",
    ] {
        for command in all_commands(file) {
            refused(&qpalgo(&command, here), file);
            assert!(!here.join("out").exists(), "{command:?}");
        }
        for command in [["score", file, "one.exr"], ["score", "one.exr", file]] {
            refused(&qpalgo(&command, here), file);
        }
    }
}

#[test]
fn nan_and_infinity_are_refused_with_the_pixel_named_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut image = mosaic(SIDE, |_, _| 0.4, 1.0);
        image.pixel_mut(37, 21)[1] = bad;
        write_exr(&here.join("bad.exr"), &image);
        for command in all_commands("bad.exr") {
            let run = qpalgo(&command, here);
            refused(&run, "(x 37, y 21)");
            refused(&run, &format!("{bad} in channel G"));
            assert!(!here.join("out").exists(), "{command:?}");
        }
    }
}

#[test]
fn a_mosaic_that_the_sub_pixels_do_not_divide_is_refused_with_both_sizes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    prepare(here);
    write_exr(&here.join("odd.exr"), &Image::zeros(127, 128, 3));
    for command in all_commands("odd.exr") {
        let parts = command.contains(&"2x2");
        let text = if parts { "127 × 128" } else { "one size" };
        // Alone it is a picture like any other.
        if command != ["sharpness", "odd.exr"] {
            refused(&qpalgo(&command, here), text);
        }
        assert!(!here.join("out").exists(), "{command:?}");
    }
    write_meta(here, 64, |_| ());
    refused(
        &qpalgo(&["depth", "odd.exr", "-o", "out"], here),
        "127 × 128",
    );
    assert!(!here.join("out").exists());
}

#[test]
fn views_that_are_missing_or_of_unequal_size_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let views = common::views(&mosaic(SIDE, |_, _| 0.4, 1.0));
    write_views(&here.join("three.exr"), &["B", "A", "D"], &views[..3]);
    write_views(&here.join("dual.exr"), &["L", "R"], &views[..2]);
    write_exr(&here.join("a.exr"), &Image::zeros(SIDE, SIDE, 3));
    write_exr(&here.join("b.exr"), &Image::zeros(SIDE, SIDE - 1, 3));
    for (command, text) in [
        (vec!["sai", "three.exr", "-o", "out"], "--subpixels"),
        (
            vec!["sai", "three.exr", "-o", "out", "--subpixels", "2x2"],
            "no view C",
        ),
        (
            vec!["disparity", "dual.exr", "-o", "out", "--subpixels", "2x2"],
            "no view B",
        ),
        (
            vec!["disparity", "a.exr", "b.exr", "-o", "out"],
            "b.exr: 64 × 63",
        ),
        (
            vec!["disparity", "b.exr", "a.exr", "-o", "out"],
            "a.exr: 64 × 64",
        ),
        (vec!["sharpness", "a.exr", "b.exr"], "b.exr: 64 × 63"),
    ] {
        refused(&qpalgo(&command, here), text);
        assert!(!here.join("out").exists(), "{command:?}");
    }
    // A dual pixel's views are known by their names.
    json(&["sai", "dual.exr", "-o", "out"], here);
    assert!(here.join("out/sum_R.exr").is_file() && !here.join("out/sum_T.exr").exists());
}

#[test]
fn a_sample_with_a_missing_or_unfit_meta_json_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir(here.join("s")).unwrap();
    raster::write_png8(&here.join("s/raw.png"), &[90; 512 * 512], 512, 512, 1).unwrap();
    let commands = [
        vec!["sai", "s", "-o", "out"],
        vec!["refocus", "s", "--disparity", "1", "-o", "out"],
        vec!["disparity", "s", "-o", "out"],
        vec!["depth", "s", "-o", "out"],
        vec!["correct-aberrations", "--calibration", "s", "-o", "out"],
    ];
    let all_refuse = |text: &str| {
        for command in &commands {
            refused(&qpalgo(command, here), text);
            assert!(!here.join("out").exists(), "{command:?}");
        }
    };
    all_refuse("a sample's folder");
    write_meta(&here.join("s"), 255, |_| ());
    all_refuse("views of 256 × 256 pixels where s/meta.json says 255 × 255");
    let path = here.join("s/meta.json");
    write_meta(&here.join("s"), 256, |meta| {
        meta["raw"]["white_level"] = 0.into()
    });
    all_refuse("white_level 0 must be above black_level 0");
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    all_refuse("meta.json");
    std::fs::write(&path, b"").unwrap();
    all_refuse("meta.json");
}

#[test]
fn a_list_for_the_table_that_is_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (text, wanted) in [
        ("", "row"),
        ("row = []", "row is []"),
        ("[[row]]\nsetup = 3", "setup"),
        (
            "[[row]]\nsetup = 'a'\nposition = 'b'\ncalibration = 'x'\ncapture = 'y'",
            "x",
        ),
    ] {
        std::fs::write(here.join("list.toml"), text).unwrap();
        refused(&qpalgo(&["table", "list.toml", "-o", "out"], here), wanted);
        assert!(!here.join("out").exists());
    }
}
