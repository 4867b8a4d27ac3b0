//! `qpgen study mosaic` and `qpgen response --colour`, as a user calls them.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::small::with_values;
use common::{json, refused};

/// In a folder, with its cache there.
fn qpgen_in(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command.current_dir(folder).env("QUADPIXEL_CACHE", folder);
    command.args(arguments).output().unwrap()
}

/// The built-in mosaic as a pixel of half its size, which a test can afford.
fn small_pixel(folder: &Path) -> String {
    let printed = qpgen_in(
        folder,
        &["response", "--pixel", "1.6um-bayer", "--print-pixel"],
    );
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(text.contains("[mosaic]") && text.contains("stand-ins"));
    let text = text
        .replace("pitch_um = 1.6", "pitch_um = 0.8")
        .replace("1.1313708498984762", "0.57")
        .replace("silicon_um = 4.0", "silicon_um = 1.0");
    let path = folder.join("small.toml");
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn the_mosaic_study_tells_every_microlens_beside_its_own_colour_around() {
    let folder = tempfile::tempdir().unwrap();
    let pixel = small_pixel(folder.path());
    let study = |more: &[&str]| {
        let given = [
            "study",
            "mosaic",
            "--preset",
            "draft",
            "--theta-step-deg",
            "15",
        ];
        let given = [&given[..], &["--theta-max-deg", "30", "--json"], more].concat();
        qpgen_in(folder.path(), &given)
    };
    let done = json(&study(&["--model", "rcwa", "--pixel", &pixel]));
    // Three wavelengths, three angles; the supercell and three filters alone.
    assert_eq!(done["solutions"], 3 * 3 * 4);
    assert!(done["worst_imbalance"].as_f64().unwrap() < 1e-6);
    let all = done["microlenses"].as_array().unwrap();
    let names: Vec<&str> = all
        .iter()
        .map(|m| m["microlens"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["blue", "green beside red", "green beside blue", "red"]
    );
    for m in all {
        // A filter passes more of its own colour than others do.
        assert!(m["unlike_alone"].as_f64().unwrap() < m["one_colour"]["total"].as_f64().unwrap());
        assert_eq!(m["beyond_angles"], 1);
    }
    let csv = fs::read_to_string(folder.path().join("study/mosaic.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 3 * 3 * (4 + 3));
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|l| l.split(',').count() == columns));
    let summary = fs::read_to_string(folder.path().join("study/mosaic-summary.csv")).unwrap();
    assert_eq!(summary.lines().count(), 1 + 2 * 4);
    let svg = fs::read_to_string(folder.path().join("study/mosaic.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));

    refused(
        &study(&["--pixel", &pixel, "--model", "geometric"]),
        "mosaic is there",
    );
    refused(
        &study(&["--model", "rcwa", "--pixel", "1.6um"]),
        "a pixel with [mosaic]",
    );
}

#[test]
fn a_table_of_each_colour_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let pixel = small_pixel(folder.path());
    let response = |more: &[&str]| {
        let given = ["response", "--pixel", &pixel, "--preset", "draft", "--json"];
        qpgen_in(folder.path(), &[&given[..], more].concat())
    };
    let done = json(&response(&[
        "--model",
        "rcwa",
        "--colour",
        "all",
        "--grid",
        "2",
        "--cosine-max",
        "0.5",
        "-o",
        "t.npz",
    ]));
    let tables = done["tables"].as_array().unwrap();
    assert_eq!(tables.len(), 3);
    for (table, colour) in tables.iter().zip(["red", "green", "blue"]) {
        assert_eq!(table["colour"], colour);
        assert!(folder.path().join(format!("t.{colour}.npz")).exists());
    }
    // Of one colour at one angle, whose powers add up to one.
    let one = json(&response(&[
        "--model",
        "rcwa",
        "--colour",
        "red",
        "--theta-deg",
        "10",
    ]));
    let mean = &one["directions"][0]["powers"]["mean"];
    let sum: f64 = ["A", "B", "C", "D"]
        .iter()
        .map(|n| mean["p"][n].as_f64().unwrap())
        .sum();
    let rest = ["reflected", "transmitted", "elsewhere"].map(|n| mean[n].as_f64().unwrap());
    assert!((sum + rest.iter().sum::<f64>() - 1.0).abs() < 1e-9);

    // The wave level knows it, too; the ideal pixel and what corrects a wave do not.
    let by_waves = json(&response(&["--colour", "red", "--theta-deg", "10"]));
    let mean = &by_waves["directions"][0]["powers"]["mean"];
    assert!(mean["p"]["A"].as_f64().unwrap() > 0.0, "{mean}");
    for (model, said) in [
        ("geometric", "mosaic is there"),
        ("corrected", "none in the wave model of a single microlens"),
    ] {
        let asked = ["--model", model, "--colour", "red", "--theta-deg", "0"];
        refused(&response(&asked), said);
    }
    refused(
        &response(&["--model", "rcwa", "--colour", "all", "--theta-deg", "0"]),
        "--colour all or bands with",
    );
    let plain = ["response", "--pixel", "1.6um", "--colour", "red"];
    refused(
        &qpgen_in(folder.path(), &plain),
        "--colour with the pixel 1.6um",
    );
}

#[test]
fn a_dataset_takes_a_table_of_bands_and_tells_of_crosstalk() {
    let folder = tempfile::tempdir().unwrap();
    let pixel = small_pixel(folder.path());
    let response = |pixel: &str, wavelengths: &str| {
        let arguments = "response --model rcwa --preset draft --json --colour bands --grid 2 --cosine-max 0.4 -o t.npz --band-wavelengths";
        let mut arguments: Vec<&str> = arguments.split(' ').collect();
        arguments.extend([wavelengths, "--pixel", pixel]);
        qpgen_in(folder.path(), &arguments)
    };
    let made = json(&response(&pixel, "1"));
    assert_eq!(
        made["wavelengths_nm"],
        serde_json::json!([465.0, 550.0, 610.0])
    );
    refused(&response("1.6um", "1"), "a pixel with [mosaic]");
    refused(&response(&pixel, "0"), "1 to 32");
    let mixed = [
        "response",
        "--pixel",
        &pixel,
        "--colour",
        "bands",
        "--wavelength-nm",
        "450",
    ];
    refused(&qpgen_in(folder.path(), &mixed), "--band-wavelengths");

    let printed = qpgen_in(folder.path(), &["dataset", "--print-config"]);
    let values = [
        ("count", "1"),
        ("sensor.width", "24"),
        ("sensor.height", "24"),
        ("rays_per_pixel", "8"),
        ("sensor.mosaic", "\"rggb\""),
        ("response.model", "\"table\""),
        ("response.pixels", ""),
        ("response.files", "[\"t.npz\"]"),
        ("spectrum.wavelengths", "1"),
    ];
    let config = with_values(&String::from_utf8(printed.stdout).unwrap(), &values);
    fs::write(folder.path().join("c.toml"), config).unwrap();
    let dataset = ["dataset", "--config", "c.toml", "--out", "data", "--json"];
    json(&qpgen_in(folder.path(), &dataset));
    let meta = fs::read_to_string(folder.path().join("data/samples/000000/meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
    let simulated = meta["effects"]["simulated"].as_array().unwrap();
    assert!(simulated.contains(&"colour-crosstalk".into()));
    for (channel, nm) in [610.0, 550.0, 465.0].into_iter().enumerate() {
        assert_eq!(meta["channels"][channel]["response_wavelength_nm"], nm);
    }

    // By waves the dataset makes its tables itself.
    let printed = qpgen_in(folder.path(), &["dataset", "--print-config"]);
    let mut values = values.to_vec();
    values.retain(|(name, _)| !name.starts_with("response."));
    let pixels = format!("[{pixel:?}]");
    values.extend([
        ("response.model", "\"wave\""),
        ("response.pixels", pixels.as_str()),
        ("response.preset", "\"draft\""),
        ("response.colour", "\"bands\""),
    ]);
    let config = with_values(&String::from_utf8(printed.stdout).unwrap(), &values);
    fs::write(folder.path().join("w.toml"), config).unwrap();
    let dataset = ["dataset", "--config", "w.toml", "--out", "waves", "--json"];
    json(&qpgen_in(folder.path(), &dataset));
    let meta = fs::read_to_string(folder.path().join("waves/samples/000000/meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
    let simulated = meta["effects"]["simulated"].as_array().unwrap();
    assert!(simulated.contains(&"colour-crosstalk".into()));
}

#[test]
fn the_coherent_study_refuses_what_has_no_fields_or_too_many() {
    let folder = tempfile::tempdir().unwrap();
    let study = |more: &[&str]| {
        let arguments = [&["study", "coherent"], more].concat();
        qpgen_in(folder.path(), &arguments)
    };
    refused(&study(&["--model", "wave"]), "allowed: rcwa");
    let large = [
        "--model",
        "rcwa",
        "--preset",
        "reference",
        "--pixel",
        "6um-dual",
    ];
    refused(&study(&large), "allowed: 0 to 6000");
    let names = ["--model", "rcwa", "--pixel", "7um"];
    refused(&study(&names), "7um");
}
