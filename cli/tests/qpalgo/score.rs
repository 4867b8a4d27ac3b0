//! `qpalgo score` against values computed by hand.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, qpalgo, refused, write_exr};
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};
use quadpixel::image::{Image, raster};
use quadpixel_algorithms::maps::{MapFormat, Maps};

fn row(values: &[f32]) -> Image {
    Image::from_vec(values.len(), 1, 1, values.to_vec()).unwrap()
}

fn near(found: &serde_json::Value, wanted: f64) {
    // 1e-6: the files hold 32-bit floats.
    let found = found.as_f64().unwrap();
    assert!((found - wanted).abs() < 1e-6, "{found} is not {wanted}");
}

fn write_maps(folder: &Path, stem: &str, format: MapFormat, image: &Image) {
    let maps = [(String::new(), image.clone())];
    let channels: &[&str] = if image.channels() == 1 {
        &["Y"]
    } else {
        &["dx", "dy"]
    };
    let maps = Maps {
        stem,
        channels,
        maps: &maps,
    };
    for (name, bytes) in maps.encode(format).unwrap() {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}

#[test]
fn one_channel_gives_the_errors_computed_by_hand_from_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Errors 0, 0.3, −0.7, 1.5; then no estimate, then no truth.
    let estimate = row(&[0.0, 1.3, 1.3, 4.5, f32::NAN, 3.0]);
    let truth = row(&[0.0, 1.0, 2.0, 3.0, 4.0, f32::NAN]);
    for (format, name) in [
        (MapFormat::Exr, "exr"),
        (MapFormat::Npy, "npy"),
        (MapFormat::Pfm, "pfm"),
    ] {
        write_maps(here, "estimate", format, &estimate);
        write_maps(here, "truth", format, &truth);
        let [e, t] = ["estimate", "truth"].map(|stem| format!("{stem}.{name}"));
        let found = json(&["score", &e, &t], here);
        assert_eq!(found["truths"], 5);
        assert_eq!(found["end_point"]["pixels"], 4);
        near(&found["estimated_share"], 0.8);
        near(&found["end_point"]["epe_px"], 2.5 / 4.0);
        near(&found["end_point"]["rms_px"], (2.83f64 / 4.0).sqrt());
        near(&found["end_point"]["bad_01"], 0.75);
        near(&found["end_point"]["bad_05"], 0.5);
        near(&found["end_point"]["bad_1"], 0.25);
        // Least squares of the truth (0, 1, 2, 3; mean 1.5) on the estimate (0, 1.3, 1.3, 4.5; mean 1.775):
        // Sxx = 23.63 − 4·1.775² = 11.0275, Sxy = 17.4 − 4·1.775·1.5 = 6.75, Syy = 5; AIWE(2)² = (Syy − Sxy²/Sxx)/4.
        let affine = &found["affine_invariant"];
        near(
            &affine["aiwe_2"],
            ((5.0 - 6.75 * 6.75 / 11.0275) / 4.0f64).sqrt(),
        );
        // A line of least deviations leads through two of the points (0, 0), (1.3, 1), (1.3, 2), (4.5, 3). Through the
        // second and the last, of slope 5/8, it leaves 1.3·5/8 − 1 = −3/16 at the first and 1 at the third; the four
        // others leave more: 1.27 (first and last), 1.46, 2.59 and 4.92.
        near(&affine["aiwe_1"], (3.0 / 16.0 + 1.0) / 4.0);
        // Ranks (0, 1.5, 1.5, 3) and (0, 1, 2, 3): ρ = 4.5/√(4.5·5).
        near(&affine["one_minus_spearman"], 1.0 - (4.5f64 / 5.0).sqrt());
    }
}

#[test]
fn two_channels_give_the_length_of_the_vectors_and_no_affine_measure() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let of = |values: &[f32]| Image::from_vec(2, 1, 2, values.to_vec()).unwrap();
    write_maps(here, "estimate", MapFormat::Exr, &of(&[3.0, 4.0, 1.0, 1.0]));
    write_maps(here, "truth", MapFormat::Npy, &of(&[0.0, 0.0, 1.0, 1.0]));
    // The EXR's dx and dy are found by their names; an NPY has none.
    refused(
        &qpalgo(&["score", "estimate.exr", "truth.npy"], here),
        "--truth-channels",
    );
    let asked = [
        "score",
        "estimate.exr",
        "truth.npy",
        "--truth-channels",
        "0,1",
    ];
    let found = json(&asked, here);
    near(&found["end_point"]["epe_px"], 2.5);
    assert!(found["affine_invariant"].is_null());
}

#[test]
fn a_grid_of_nodes_is_compared_at_its_pixels_under_a_weighing_mask() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Truth x + 10 y; nodes at 1, 3, 5 across and 1, 3 down.
    let mut truth = Image::zeros(7, 5, 1);
    for y in 0..5 {
        (0..7).for_each(|x| truth.pixel_mut(x, y)[0] = (x + 10 * y) as f32);
    }
    let values = vec![11.0, 13.0, 15.0, 31.0, 33.0, 36.0]; // the last one is 1 too much
    write_exr(
        &here.join("e.exr"),
        &Image::from_vec(3, 2, 1, values).unwrap(),
    );
    write_exr(&here.join("t.exr"), &truth);
    let asked = ["score", "e.exr", "t.exr", "--grid", "1,2"];
    let found = json(&asked, here);
    assert_eq!(found["truths"], 6);
    near(&found["end_point"]["epe_px"], 1.0 / 6.0);

    let mut codes = vec![255u8; 35];
    codes[3 * 7 + 5] = 0;
    raster::write_png8(&here.join("mask.png"), &codes, 7, 5, 1).unwrap();
    let found = json(&[&asked[..], &["--mask", "mask.png"]].concat(), here);
    assert_eq!(found["truths"], 5);
    near(&found["end_point"]["epe_px"], 0.0);
    near(&found["affine_invariant"]["aiwe_2"], 0.0);

    // Weights 1 and 3 of two equal estimates whose truths are 0 and 1: the best constant is the weighted mean, 3/4, and
    // AIWE(2)² = (1·9/16 + 3·1/16)/4 = 3/16; the weighted median is 1, and AIWE(1) = 1/4.
    write_exr(&here.join("e.exr"), &row(&[5.0, 5.0]));
    write_exr(&here.join("t.exr"), &row(&[0.0, 1.0]));
    write_exr(&here.join("w.exr"), &row(&[1.0, 3.0]));
    let found = json(&["score", "e.exr", "t.exr", "--mask", "w.exr"], here);
    near(&found["affine_invariant"]["aiwe_2"], (3.0f64 / 16.0).sqrt());
    near(&found["affine_invariant"]["aiwe_1"], 0.25);
    near(&found["affine_invariant"]["one_minus_spearman"], 1.0);
}

#[test]
fn left_minus_right_of_truth_is_mean_of_b_and_d_less_that_of_a_and_c() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let of = |dx: f32, dy: f32| Image::from_vec(1, 2, 2, vec![dx, dy, f32::NAN, f32::NAN]).unwrap();
    // B, A, D, C: x_L − x_R = (1 + 3)/2 − (−2 − 6)/2 = 6; y_T − y_B = (4 + 2)/2 − (−1 − 3)/2 = 5.
    let images = [of(1.0, 4.0), of(-2.0, 2.0), of(3.0, -1.0), of(-6.0, -3.0)];
    let layers: Vec<Layer<'_>> = (["B", "A", "D", "C"].iter().zip(&images))
        .map(|(name, image)| Layer {
            name,
            channels: &["dx", "dy"],
            image,
            sample: Sample::Float,
        })
        .collect();
    write_layers(&here.join("t.exr"), &layers, Compression::Zip).unwrap();
    let values = vec![6.25, 9.0];
    write_exr(
        &here.join("e.exr"),
        &Image::from_vec(1, 2, 1, values).unwrap(),
    );
    for (which, wanted) in [("left-right", 0.25), ("top-bottom", 1.25)] {
        let found = json(
            &["score", "e.exr", "t.exr", "--truth-channels", which],
            here,
        );
        assert_eq!(found["truths"], 1);
        near(&found["end_point"]["epe_px"], wanted);
    }
    let asked = ["score", "t.exr", "e.exr", "--truth-channels", "left-right"];
    refused(&qpalgo(&asked, here), "--estimate-channels");
    let asked = ["score", "e.exr", "e.exr", "--truth-channels", "left-right"];
    refused(&qpalgo(&asked, here), "left-right");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("a.exr"), &row(&[1.0, 2.0]));
    write_exr(&here.join("b.exr"), &row(&[1.0, 2.0, 3.0]));
    write_exr(&here.join("nan.exr"), &row(&[f32::NAN; 2]));
    std::fs::write(here.join("empty.pfm"), b"").unwrap();
    for (arguments, text) in [
        (vec!["a.exr", "b.exr"], "--grid"),
        (vec!["a.exr", "b.exr", "--grid", "2,1"], "--grid"),
        (vec!["a.exr", "nan.exr"], "no pixel"),
        (vec!["a.exr", "a.exr", "--mask", "b.exr"], "b.exr"),
        (vec!["a.exr", "empty.pfm"], "empty.pfm"),
        (vec!["none.npy", "a.exr"], "none.npy"),
        (vec!["a.exr", "a.exr", "--truth-channels", "Q"], "Q"),
    ] {
        refused(&qpalgo(&[&["score"][..], &arguments].concat(), here), text);
    }
}
