//! A focus stack of a flat chart: the phase difference is zero, and the picture sharpest, where the truth says.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, qpalgo, refused};
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::production::dataset::make;

fn stack(folder: &Path, sweep: &str, count: usize) {
    let text = format!(
        r#"
count = {count}
seed = 5
rays_per_pixel = 48
effects = ["pixel-diffraction", "cra-variation", "dispersion", "aberrations", "vignetting", "occlusion"]
exposure_ev = -1
[lens]
names = ["wide_US20120327520A1_emb3"]
focus_mm = 300
[sensor]
subpixels = "2x2"
width = 96
height = 80
window = {{ at = "centre" }}
microlens_shift = {{ rule = "chief-ray" }}
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise"]
background_over_focus = 1.1
tilt_deg = 0
cards = 0
card_over_focus = 0.7
card_size = 0.4
texture_px = 256
{sweep}
"#
    );
    let config = DatasetConfig::from_toml(&text, "test").unwrap();
    make(&config, &folder.join("stack"), &()).unwrap();
}

#[test]
fn phase_is_zero_and_sharpness_largest_where_the_scene_is_in_focus() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Nine steps, 0.41 dioptres apart, about the chart at 330 mm.
    stack(
        here,
        "[sweep]\nsteps = 9\nfocus_over_drawn = { min = 0.7, max = 2.3, scale = \"inverse\" }\n",
        9,
    );
    let found = json(&["autofocus", "stack", "-o", "af"], here);
    let scene = &found["scenes"][0];
    let of = |name: &str| scene[name].as_f64().unwrap();
    let samples = scene["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 9);
    let at = |i: usize, name: &str| samples[i][name].as_f64().unwrap();
    let step = at(1, "focus_per_m") - at(0, "focus_per_m");
    assert!(step > 0.0 && (at(8, "focus_per_m") - at(0, "focus_per_m") - 8.0 * step).abs() < 0.01);
    // The ideal lens is in focus at the chart, d = 0.33 m + p.
    let meta = std::fs::read_to_string(here.join("stack/samples/000000/meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
    let behind = meta["intrinsics"]["pinhole_behind_vertex_m"]
        .as_f64()
        .unwrap();
    assert!((of("true_focus_per_m") - 1.0 / (0.33 + behind)).abs() < 0.01);
    // px a dioptre of the true phase, between the middle steps.
    let truth = |i: usize| samples[i]["truth"]["shift_px"].as_f64().unwrap();
    let slope = (truth(5) - truth(3)) / (2.0 * step);
    assert!(slope < 0.0, "{slope}");
    // Matching is good to some hundredths of a px near the focus, where the halves' blurs are small; half of 0.1 px is
    // allowed.
    let off_px = (of("phase_zero_per_m") - of("true_phase_zero_per_m")) * slope;
    assert!(off_px.abs() < 0.05, "{off_px} px");
    // A peak of contrast lies between the samples about it: within a step. What balances aberration is not paraxial, by
    // design.
    for peak in ["gradient_peak_per_m", "wee_peak_per_m"] {
        assert!(
            (of(peak) - of("true_phase_zero_per_m")).abs() < step,
            "{peak} {}",
            of(peak)
        );
    }
    // Behind the focus of the camera (its 1/d_f above the scene's) D is negative, as the specification says; coc is
    // positive.
    let mut matched = 0;
    for (i, sample) in samples.iter().enumerate() {
        let beyond = at(i, "focus_per_m") > of("true_focus_per_m");
        assert_eq!(
            sample["truth"]["coc_px"].as_f64().unwrap() > 0.0,
            beyond,
            "{i}"
        );
        // The ends of the stack are too blurred for some windows, or all: no match, and none is made up.
        if let Some(shift) = sample["phase"]["shift_px"].as_f64() {
            let beyond = at(i, "focus_per_m") > of("true_phase_zero_per_m");
            assert!(shift.abs() < 0.1 || (shift < 0.0) == beyond, "{i}: {shift}");
            matched += 1;
        }
    }
    assert!(matched >= 5, "{matched} of 9 samples were matched");
    for name in ["autofocus.csv", "focus.csv"] {
        let text = std::fs::read_to_string(here.join("af").join(name)).unwrap();
        let columns = text.lines().next().unwrap().split(',').count();
        assert!(text.lines().all(|l| l.split(',').count() == columns));
    }
    let name = format!("af/{}.svg", scene["scene"].as_str().unwrap());
    assert!(
        std::fs::read_to_string(here.join(name))
            .unwrap()
            .ends_with("</svg>\n")
    );
    let region = ["autofocus", "stack", "-o", "bad", "--region", "90,0,20,20"];
    refused(&qpalgo(&region, here), "--region");
    assert_eq!(
        qpalgo(
            &["autofocus", "stack", "-o", "bad", "--region", "1,2"],
            here
        )
        .status
        .code(),
        Some(2)
    );
}

#[test]
fn a_dataset_without_stacks_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    stack(folder.path(), "", 1);
    refused(
        &qpalgo(&["autofocus", "stack", "-o", "af"], folder.path()),
        "[sweep]",
    );
    refused(
        &qpalgo(&["autofocus", "none", "-o", "af"], folder.path()),
        "none",
    );
    assert!(!folder.path().join("af").exists());
}
