//! The commands on a rendered sample: signs and frames are those of the dataset's specification, by its own truth.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::json;
use quadpixel::image::Image;
use quadpixel_algorithms::maps::{MapFormat, Maps};
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::production::dataset::make;

/// Width and height of a sample in microlenses.
type Size = [usize; 2];
const SMALL: Size = [64, 60];
/// A chart from which the smoothed fit of the centroids has enough to go by.
const CHART: Size = [128, 120];

/// A textured plane at `background_over_focus` times the focused depth, seen by an ideal quad pixel.
/// By rays alone: its texture is finer than the lens's diffraction pattern.
fn sample(folder: &Path, name: &str, [width, height]: Size, background_over_focus: f64) -> String {
    let text = format!(
        r#"
count = 1
seed = 5
rays_per_pixel = 48
effects = ["pixel-diffraction", "cra-variation", "dispersion", "aberrations", "vignetting", "occlusion"]
exposure_ev = -1
[lens]
names = ["wide_US20120327520A1_emb3"]
focus_mm = 300
[sensor]
subpixels = "2x2"
width = {width}
height = {height}
window = {{ at = "centre" }}
microlens_shift = {{ rule = "chief-ray" }}
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise"]
background_over_focus = {background_over_focus}
tilt_deg = 0
cards = 0
card_over_focus = 0.7
card_size = 0.4
texture_px = 128
"#
    );
    let config = DatasetConfig::from_toml(&text, "test").unwrap();
    make(&config, &folder.join(name), &()).unwrap();
    format!("{name}/samples/000000")
}

/// How far a match may lie from the truth, as a part of the disparity: the truth is the distance of the views'
/// centroids, and blurs of unlike shape (mirrored halves, a quarter and the whole of a pupil) match best elsewhere, by
/// a part of their width and so of the disparity. Nothing found would be 1, the wrong sign 2.
const UNLIKE_BLUR: f64 = 0.25;

/// Mean length of the truth, px: the error of a map of zeros.
fn mean_truth_px(here: &Path, truth: &str, channels: &str) -> f64 {
    let count = channels.split(',').count();
    let maps = vec![(String::new(), Image::zeros(SMALL[0], SMALL[1], count))];
    let zeros = Maps {
        stem: "zeros",
        channels: &["dx", "dy"][..count],
        maps: &maps,
    };
    for (name, bytes) in zeros.encode(MapFormat::Exr).unwrap() {
        std::fs::write(here.join(name), bytes).unwrap();
    }
    let score = ["score", "zeros.exr", truth, "--truth-channels", channels];
    number(&json(&score, here)["end_point"]["epe_px"])
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn left_minus_right_is_positive_before_the_focus_and_agrees_with_truth() {
    for (over_focus, sign) in [(0.85, 1.0), (1.25, -1.0)] {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        let sample = sample(here, "data", SMALL, over_focus);
        let file = format!("{sample}/disparity.exr");
        json(&["sai", &sample, "-o", "v"], here);
        for (pair, direction, axis, truth) in [
            (["L", "R"], "horizontal", "dx", "left-right"),
            (["T", "B"], "vertical", "dy", "top-bottom"),
        ] {
            let [a, b] = pair.map(|side| format!("v/sum_{side}.exr"));
            let asked = [
                "disparity",
                &a,
                &b,
                "-o",
                "d",
                "--one-dimensional",
                direction,
            ];
            let found = json(&asked, here);
            let median = number(&found["channels"][1][format!("median_{axis}_px")]);
            assert!(sign * median > 0.3, "{truth} at {over_focus}: {median}");
            let grid = [&found["grid"]["first_px"], &found["grid"]["stride_px"]];
            let grid = grid.map(|v| v.to_string()).join(",");
            let estimate = format!("G.{axis}");
            let score = [
                "score",
                "d/disparity.exr",
                &file,
                "--estimate-channels",
                &estimate,
                "--truth-channels",
                truth,
                "--mask",
                &format!("{sample}/valid.png"),
                "--grid",
                &grid,
            ];
            let score = json(&score, here);
            assert!(number(&score["estimated_share"]) > 0.5, "{score}");
            let epe = number(&score["end_point"]["epe_px"]);
            let limit = UNLIKE_BLUR * mean_truth_px(here, &file, truth);
            assert!(epe < limit, "{truth} at {over_focus}: {epe}, {limit} px");
        }
        // A single view against the sum: the truth's own definition.
        let found = json(&["disparity", &sample, "-o", "each"], here);
        assert_eq!(found["channels"].as_array().unwrap().len(), 12);
        for view in ["A", "B", "C", "D"] {
            let truth = format!("{view}.dx,{view}.dy");
            let score = [
                "score",
                "each/disparity.exr",
                &file,
                "--estimate-channels",
                &format!("{view}.G.dx,{view}.G.dy"),
                "--truth-channels",
                &truth,
                "--grid",
                "14,4",
            ];
            let epe = number(&json(&score, here)["end_point"]["epe_px"]);
            let limit = UNLIKE_BLUR * mean_truth_px(here, &file, &truth);
            assert!(epe < limit, "{view} at {over_focus}: {epe}, {limit} px");
        }
    }
}

#[test]
fn depth_of_a_sample_is_that_of_its_plane_by_its_camera_and_by_a_calibration_in_focus() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let chart = sample(here, "chart", CHART, 1.0);
    let near = sample(here, "near", CHART, 0.85);
    json(
        &[
            "correct-aberrations",
            "--calibration",
            &chart,
            "-o",
            "camera.json",
        ],
        here,
    );
    let score = |more: &[&str]| {
        let asked = ["depth", &near, "--score", "-o", "depth"];
        json(&[&asked[..], more].concat(), here)["score"].clone()
    };
    let [dense, without, with] = [
        &[][..],
        &["--sparse"],
        &["--sparse", "--calibration", "camera.json"],
    ]
    .map(score);
    let rms = |score: &serde_json::Value| number(&score["disparity_rms_px"]);
    // κ fx A = 1.52 px·m, so the plane's disparity is 1.52 (1/0.255 − 1/0.3) = 0.89 px; an error of a quarter of it is
    // one of 0.255 · 0.22/1.52 = 3.7 % of the depth.
    assert!(rms(&with) < 0.22, "{with}");
    assert!(number(&with["median_relative"]) < 0.037, "{with}");
    // The camera's own curve has the aberrations and the matcher's stretch in it.
    assert!(number(&without["median_relative"]) < 0.01, "{without}");
    assert!(rms(&without) < 0.05, "{without}");
    // Dense matching has no stretch, and a depth at every pixel.
    assert!(number(&dense["median_relative"]) < 0.02, "{dense}");
    assert!(
        dense["count"].as_u64() > without["count"].as_u64(),
        "{dense}"
    );
}
