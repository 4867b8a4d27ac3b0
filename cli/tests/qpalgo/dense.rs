//! `qpalgo disparity --dense` as a process: a number at every pixel, what a pair needs, what is refused.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, mosaic, qpalgo, refused, shifted, write_exr};
use quadpixel::image::Image;
use quadpixel_algorithms::maps;

/// Every pixel's dx, then sigma.
fn numbers(path: &Path) -> [Vec<f32>; 2] {
    let layer = maps::read(path).unwrap().remove(0);
    assert_eq!(layer.channels, ["dx", "sigma"]);
    [0, 1].map(|c| {
        layer
            .image
            .data()
            .iter()
            .skip(c)
            .step_by(2)
            .copied()
            .collect()
    })
}

#[test]
fn a_capture_and_its_halves_have_a_number_at_every_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("raw.exr"), &mosaic(64, |_, _| 0.6, 1.0));
    let capture = |subpixels: &str| {
        let more = ["--subpixels", subpixels, "-o", "of_capture"];
        let summary = json(
            &[&["disparity", "--dense", "raw.exr"], &more[..]].concat(),
            here,
        );
        assert_eq!(summary["blur_known"], false);
        numbers(&here.join("of_capture/disparity.exr"))
    };
    // Two columns: the same as of their pictures.
    json(&["sai", "raw.exr", "--subpixels", "2x1", "-o", "v"], here);
    let pair = ["disparity", "--dense", "v/sum_L.exr", "v/sum_R.exr"];
    json(&[&pair[..], &["-o", "of_pair"]].concat(), here);
    let of_pair = numbers(&here.join("of_pair/disparity.exr"));
    assert_eq!(capture("2x1"), of_pair);
    // Top and bottom tell, too.
    let found = capture("2x2");
    assert_eq!(found[0].len(), 64 * 64);
    let mut sorted = found[0].clone();
    sorted.sort_by(f32::total_cmp);
    // The mosaic's views are shifted copies: for so small a shift the blur is none.
    assert!(
        (sorted[sorted.len() / 2] - 0.6).abs() < 0.1,
        "{}",
        sorted[sorted.len() / 2]
    );
    assert!(found[1].iter().all(|s| *s > 0.0));
    for picture in ["disparity.png", "sigma.png"] {
        assert!(here.join("of_pair").join(picture).is_file());
    }
}

#[test]
fn black_white_sheet_and_crop_leave_the_pair_that_they_began_with() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (left, right) = (shifted(64, [0.4, 0.0], 1.0), shifted(64, [-0.4, 0.0], 1.0));
    let coded = |image: &Image, gain: f32| {
        let mut coded = image.clone();
        let black = 6553.5 / 65535.0;
        coded
            .data_mut()
            .iter_mut()
            .for_each(|v| *v = black + (1.0 - black) * gain * *v);
        coded
    };
    let white = Image::from_vec(64, 64, 1, vec![1.0; 64 * 64]).unwrap();
    for (name, image) in [
        ("l", left.clone()),
        ("r", right.clone()),
        ("coded_l", coded(&left, 1.0)),
        ("coded_r", coded(&right, 0.5)),
        ("white_l", coded(&white, 0.8)),
        ("white_r", coded(&white, 0.4)),
    ] {
        write_exr(&here.join(format!("{name}.exr")), &image);
    }
    let plain = [
        "disparity",
        "--dense",
        "l.exr",
        "r.exr",
        "--crop",
        "48x40",
        "-o",
        "plain",
    ];
    json(&plain, here);
    let coded = [
        "disparity",
        "--dense",
        "coded_l.exr",
        "coded_r.exr",
        "--crop",
        "48x40",
        "--black-level",
        "6553.5",
        "--white-sheet",
        "white_l.exr,white_r.exr",
        "-o",
        "coded",
    ];
    json(&coded, here);
    let [plain, coded] = ["plain", "coded"].map(|n| numbers(&here.join(n).join("disparity.exr")));
    assert_eq!(plain[0].len(), 48 * 40);
    for (a, b) in plain[0].iter().zip(&coded[0]) {
        assert!((a - b).abs() < 0.01, "{a} {b}");
    }
}

#[test]
fn bad_input_ends_with_exit_code_2_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("a.exr"), &shifted(64, [0.0, 0.0], 1.0));
    write_exr(&here.join("small.exr"), &shifted(32, [0.0, 0.0], 1.0));
    for (view, reference, more, wanted) in [
        ("a.exr", "small.exr", vec![], "one size"),
        ("a.exr", "a.exr", vec!["--crop", "65x64"], "65 × 64"),
        ("a.exr", "a.exr", vec!["--crop", "8x8"], "at least 16"),
        ("a.exr", "a.exr", vec!["--crop", "64"], "COLUMNSxROWS"),
        (
            "a.exr",
            "a.exr",
            vec!["--black-level", "65535"],
            "--black-level is 65535",
        ),
        (
            "a.exr",
            "a.exr",
            vec!["--white-sheet", "a.exr"],
            "LEFT,RIGHT",
        ),
        (
            "a.exr",
            "a.exr",
            vec!["--white-sheet", "a.exr,small.exr"],
            "one size",
        ),
        (
            "a.exr",
            "a.exr",
            vec!["--subpixels", "2x2"],
            "without REFERENCE",
        ),
    ] {
        let command = [
            &["disparity", "--dense", view, reference, "-o", "out"],
            &more[..],
        ]
        .concat();
        refused(&qpalgo(&command, here), wanted);
        assert!(!here.join("out").exists());
    }
    let alone = [
        "disparity",
        "--dense",
        "a.exr",
        "--crop",
        "8x8",
        "-o",
        "out",
    ];
    refused(&qpalgo(&alone, here), "with REFERENCE");
}

#[test]
fn a_network_tells_every_pixel_and_one_that_does_not_fit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (name, shift) in [("l", 0.4), ("r", -0.4)] {
        write_exr(
            &here.join(format!("{name}.exr")),
            &shifted(64, [shift, 0.0], 1.0),
        );
    }
    let pair = |network: &'static str| ["disparity", network, "l.exr", "r.exr", "-o", "out"];
    std::fs::write(here.join("no.zip"), b"no network").unwrap();
    refused(&qpalgo(&pair("--network=no.zip"), here), "no.zip");
    refused(&qpalgo(&pair("--network=absent.zip"), here), "absent.zip");
    let with = |more: &[&'static str]| [&pair("--network")[..], more].concat();
    for more in [&["--search", "3"][..], &["--window", "9"], &["--dense"]] {
        let run = qpalgo(&with(more), here);
        let error = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{error}");
        assert!(error.contains(more[0]), "{error}");
    }
    assert!(!here.join("out").exists());
    let summary = json(&pair("--network"), here);
    // Matching beside the network has assumed a ratio.
    assert_eq!(summary["blur_known"], false);
    let [disparity, sigma] = numbers(&here.join("out/disparity.exr"));
    assert_eq!(disparity.len(), 64 * 64);
    assert!(sigma.iter().all(|s| *s > 0.0 && s.is_finite()));
    // Matching beside the network takes the ratio.
    json(&with(&["--ratio", "0.1"]), here);
    let [narrow, _] = numbers(&here.join("out/disparity.exr"));
    assert_ne!(narrow, disparity);
}
