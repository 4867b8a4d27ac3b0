//! No truth goes into an estimate: with every file and field of truth deleted each command writes the same bytes.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::collections::BTreeMap;
use std::path::Path;

use common::{json, qpalgo};
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::production::dataset::make;

const CONFIG: &str = r#"
count = 3
seed = 5
rays_per_pixel = 48
exposure_ev = -1
[lens]
names = ["wide_US20120327520A1_emb3"]
focus_mm = 300
[sensor]
subpixels = "2x2"
width = 96
height = 80
window = { at = "centre" }
microlens_shift = { rule = "chief-ray" }
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise"]
background_over_focus = 1.2
tilt_deg = 0
cards = 0
card_over_focus = 0.7
card_size = 0.4
texture_px = 128
[sweep]
steps = 3
focus_over_drawn = { min = 0.8, max = 1.5, scale = "inverse" }
"#;
const SAMPLE: &str = "samples/000000";
/// All that a camera of its own would leave beside the raw mosaic.
const OF_THE_CAMERA: [&str; 3] = ["raw.png", "camera.json", "meta.json"];
/// Fields of meta.json that tell of the scene, of the render or of the truth.
const OF_THE_TRUTH: [&str; 9] = [
    "configuration_blake3",
    "contents",
    "coc_disparity",
    "effects",
    "files",
    "ranges",
    "scene",
    "seed",
    "statistics",
];

/// Takes every truth out of the samples.
fn strip(dataset: &Path) {
    for sample in std::fs::read_dir(dataset.join("samples")).unwrap() {
        let sample = sample.unwrap().path();
        for file in std::fs::read_dir(&sample).unwrap() {
            let file = file.unwrap().path();
            if !OF_THE_CAMERA.contains(&file.file_name().unwrap().to_str().unwrap()) {
                std::fs::remove_file(file).unwrap();
            }
        }
        change_meta(&sample, |meta| {
            for field in OF_THE_TRUTH {
                meta.remove(field);
            }
        });
    }
}

fn change_meta(sample: &Path, change: impl Fn(&mut serde_json::Map<String, serde_json::Value>)) {
    let path = sample.join("meta.json");
    let meta: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let serde_json::Value::Object(mut meta) = meta else {
        panic!("meta.json is no object");
    };
    change(&mut meta);
    std::fs::write(path, serde_json::to_vec(&meta).unwrap()).unwrap();
}

/// What the estimators write of a dataset, by file; of autofocus the columns without the truth. `more` goes to depth
/// and to the dense maps.
fn estimates(here: &Path, dataset: &str, more: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let sample = format!("{dataset}/{SAMPLE}");
    let out = here.join("out");
    std::fs::create_dir(&out).unwrap();
    let calibrate = [
        "correct-aberrations",
        "--align",
        "texture",
        "--calibration",
        &sample,
    ];
    for (command, to) in [
        (vec!["sai", &sample], "out/sai"),
        (vec!["disparity", &sample], "out/disparity"),
        (
            [&["disparity", "--dense", &sample], more].concat(),
            "out/dense",
        ),
        (
            [&["disparity", "--network", &sample], more].concat(),
            "out/network",
        ),
        (
            vec!["refocus", &sample, "--disparity", "0.4"],
            "out/near.exr",
        ),
        (calibrate.to_vec(), "out/lens.json"),
        (
            vec!["correct-aberrations", "--apply", "out/lens.json", &sample],
            "out/corrected",
        ),
        ([&["depth", &sample], more].concat(), "out/depth"),
        (
            [
                &[
                    "depth",
                    &sample,
                    "--sparse",
                    "--calibration",
                    "out/lens.json",
                ],
                more,
            ]
            .concat(),
            "out/depth_corrected",
        ),
        (vec!["autofocus", dataset], "out/autofocus"),
    ] {
        json(&[&command[..], &["-o", to]].concat(), here);
    }
    let sharpness = qpalgo(&["sharpness", "out/sai/sum_all.exr", "--json"], here);
    let mut files = BTreeMap::from([("sharpness".to_owned(), sharpness.stdout)]);
    collect(&out, &out, &mut files);
    std::fs::remove_dir_all(&out).unwrap();
    assert!(files.len() > 25, "{:?}", files.keys());
    files
}

fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().display().to_string();
        if path.is_dir() {
            collect(root, &path, files);
        } else if name.ends_with(".csv") {
            files.insert(name, without_truth(&std::fs::read_to_string(path).unwrap()));
        } else if !name.ends_with(".svg") && !name.ends_with(quadpixel::file::WRITTEN) {
            // The plots show the truth beside the estimate.
            files.insert(name, std::fs::read(path).unwrap());
        }
    }
}

/// A table without its columns `true_…`.
fn without_truth(csv: &str) -> Vec<u8> {
    let names: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let lines = csv.lines().map(|line| {
        let cells = line.split(',').zip(&names);
        let kept: Vec<&str> = cells
            .filter(|(_, n)| !n.starts_with("true_"))
            .map(|(c, _)| c)
            .collect();
        kept.join(",")
    });
    lines.collect::<Vec<_>>().join("\n").into_bytes()
}

fn assert_same(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>, which: &str) {
    assert!(a.keys().eq(b.keys()), "{which}");
    for (name, bytes) in a {
        assert!(*bytes == b[name], "{which}: {name}");
    }
}

/// Makes the focus stack in `folder/data`.
fn make_stack(folder: &Path) {
    let config = DatasetConfig::from_toml(CONFIG, "test").unwrap();
    make(&config, &folder.join("data"), &()).unwrap();
}

/// Largest relative difference of the camera's κ and that of the paraxial maps: two quadratures of one integral, the
/// one averaged over the window, the other over the blurred pixels (benches/runs/2026-11-22/depth.md: 0.2 %).
const RATIO_TOLERANCE: f64 = 0.005;

#[test]
fn the_camera_s_ratio_of_disparity_to_defocus_is_that_of_the_truth_maps() {
    let folder = tempfile::tempdir().unwrap();
    make_stack(folder.path());
    for sample in std::fs::read_dir(folder.path().join("data/samples")).unwrap() {
        let sample = sample.unwrap().path();
        let read = |name: &str| -> serde_json::Value {
            serde_json::from_slice(&std::fs::read(sample.join(name)).unwrap()).unwrap()
        };
        let camera = &read("camera.json")["disparity_ratio"]["left_right"]["mean"];
        let truth = &read("meta.json")["coc_disparity"]["paraxial_ratio"];
        let [camera, truth] = [camera, truth].map(|ratio| ratio.as_f64().unwrap());
        assert!(
            (camera / truth - 1.0).abs() < RATIO_TOLERANCE,
            "{camera} {truth}"
        );
    }
}

#[test]
fn every_estimate_is_the_same_without_any_truth() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    make_stack(here);
    let whole = estimates(here, "data", &[]);

    strip(&here.join("data"));
    assert_same(
        &whole,
        &estimates(here, "data", &[]),
        "fields and files deleted",
    );

    let sample = here.join("data").join(SAMPLE);
    let camera = std::fs::read(sample.join("camera.json")).unwrap();
    let meta = std::fs::read(sample.join("meta.json")).unwrap();
    std::fs::remove_file(sample.join("meta.json")).unwrap();
    assert_same(&whole, &estimates(here, "data", &[]), "meta.json deleted");

    // The description may lie anywhere; without it the ratio is not known, and no truth is taken in its place.
    std::fs::write(here.join("mine.json"), camera).unwrap();
    std::fs::remove_file(sample.join("camera.json")).unwrap();
    std::fs::write(sample.join("meta.json"), meta).unwrap();
    let described = estimates(here, "data", &["--camera", "mine.json"]);
    assert_same(&whole, &described, "description elsewhere");
    let refused = qpalgo(&["depth", &format!("data/{SAMPLE}"), "-o", "no"], here);
    common::refused(&refused, "--camera or --calibration");
}
