//! `qpgen response` and `qpgen study` as processes.

// because tests fail by panicking
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use common::small::{SMALL_TABLE, with_values};
use common::{journal_in, json, refused};
use quadpixel_generators::config::DEFAULT_TOML;

fn qpgen(cache: &Path, arguments: &[&str]) -> Output {
    command(cache, arguments).output().unwrap()
}

fn command(cache: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command.args(arguments).env("QUADPIXEL_CACHE", cache);
    command
}

#[test]
fn a_killed_table_goes_on_and_repeats_no_direction() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let output = folder.path().join("t.npz");
    let arguments = [
        &SMALL_TABLE[..],
        &["--json", "-o", output.to_str().unwrap()],
    ]
    .concat();
    let journal = || journal_in(&cache);
    let mut first = command(&cache, &arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // The head and a few runs, and then the plug is pulled.
    while journal().is_none_or(|text| text.lines().count() < 4) {
        assert!(
            first.try_wait().unwrap().is_none(),
            "it ended before it could be killed"
        );
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    first.kill().unwrap();
    first.wait().unwrap();
    let kept = journal().unwrap();
    let kept = kept.lines().filter(|l| l.ends_with('}')).count() - 1;
    assert!(!output.exists());

    let done = json(&qpgen(&cache, &arguments));
    let build = &done["build"];
    assert_eq!(build["reused"], kept, "{done}");
    // 13 × 13 nodes by the eight symmetries of the square: 28, less (5, 5) and (6, 4) to (6, 6), which are beyond 70°.
    assert_eq!(build["runs"], 24);
    assert!(journal().is_none());
    let whole = fs::read(&output).unwrap();

    let again = folder.path().join("again");
    assert_eq!(json(&qpgen(&again, &arguments))["build"]["reused"], 0);
    assert_eq!(fs::read(&output).unwrap(), whole);
    assert_eq!(json(&qpgen(&again, &arguments))["from_cache"], true);
}

#[test]
fn an_exported_response_comes_back_by_import_and_serves_a_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let thetas: Vec<String> = (0..=12).map(|i| (5 * i).to_string()).collect();
    let phis: Vec<String> = (0..=24).map(|i| (15 * i).to_string()).collect();
    let directions = json(&qpgen(
        folder.path(),
        &[
            "response",
            "--pixel",
            "2.8um",
            "--model",
            "geometric",
            "--focal-length-um",
            "5",
            "--theta-deg",
            &thetas.join(","),
            "--phi-deg",
            &phis.join(","),
            "--json",
        ],
    ));
    let mut csv = String::from("theta_deg,phi_deg,subpixel,P\n");
    for d in directions["directions"].as_array().unwrap() {
        for (name, p) in d["powers"]["mean"]["p"].as_object().unwrap() {
            csv += &format!("{},{},{name},{p}\n", d["theta_deg"], d["phi_deg"]);
        }
    }
    fs::write(at("power.csv"), &csv).unwrap();
    let import = |file: &str| {
        let arguments = [
            "response",
            "--pixel",
            "2.8um",
            "--import",
            file,
            "-o",
            &at("x.npz"),
            "--json",
        ];
        qpgen(folder.path(), &arguments)
    };
    assert_eq!(
        json(&import(&at("power.csv")))["wavelengths_nm"],
        serde_json::json!([550.0])
    );
    // What only a simulated table has use for.
    for more in [["--shifts", "8"], ["--model", "rcwa"], ["--grid", "5"]] {
        let arguments = [&["response", "--import", "power.csv"][..], &more].concat();
        refused(&qpgen(folder.path(), &arguments), "cannot be used with");
    }
    let narrow = ["response", "--cosine-max", "1e-300"];
    refused(&qpgen(folder.path(), &narrow), "cosine_max");
    let files = format!("[{:?}]", at("x.npz"));
    let values = [
        ("response.model", "\"table\""),
        ("response.pixels", ""),
        ("response.files", &files),
        ("sensor.width", "24"),
        ("sensor.height", "24"),
        ("rays_per_pixel", "4"),
        ("scene.texture_px", "64"),
    ];
    let config = with_values(DEFAULT_TOML, &values);
    fs::write(at("c.toml"), config).unwrap();
    let made = json(&qpgen(
        folder.path(),
        &[
            "dataset",
            "--config",
            &at("c.toml"),
            "--count",
            "1",
            "--out",
            &at("out"),
            "--json",
        ],
    ));
    assert_eq!(made["samples"], 1);
    let meta = fs::read_to_string(at("out/samples/000000/meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
    assert_eq!(meta["sensor"]["pitch_um"], 2.8);

    // No dataset begins hours of FDTD or of Fourier modes unasked.
    for model in ["fdtd", "rcwa"] {
        let quoted = format!("{model:?}");
        let values = [
            ("response.model", quoted.as_str()),
            ("response.pixels", "[\"3.5um-thin-filter\"]"),
        ];
        let config = with_values(DEFAULT_TOML, &values);
        fs::write(at("f.toml"), config).unwrap();
        let asked = [
            "dataset",
            "--config",
            &at("f.toml"),
            "--count",
            "1",
            "--out",
            &at("f"),
        ];
        refused(
            &qpgen(folder.path(), &asked),
            &format!("qpgen response --model {model} --pixel 3.5um-thin-filter"),
        );
    }

    let broken = csv.replacen("5.0,0.0,A,", "5.0,0.0,A,x", 1);
    fs::write(at("broken.csv"), broken).unwrap();
    refused(&import(&at("broken.csv")), "column 4 (P) is `x");
    refused(&import(&at("absent.csv")), "absent.csv");
}

#[test]
fn a_study_writes_its_curves_ranges_and_plot() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("s");
    let study = |kind: &str, step: &str, max: &str, pixels: &str| {
        let out = out.to_str().unwrap();
        let mut arguments = vec![
            "study",
            kind,
            "--theta-step-deg",
            step,
            "--theta-max-deg",
            max,
            "--json",
            "--preset",
            "draft",
            "--out",
            out,
        ];
        if !pixels.is_empty() {
            arguments.extend(["--pixel", pixels]);
        }
        qpgen(folder.path(), &arguments)
    };
    let done = json(&study("rejection", "5", "30", "1.6um,2.8um"));
    let cases = done["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 2);
    // A larger pixel parts the light closer to the normal (Fig. 11).
    let r_a = |i: usize| cases[i]["r_a_deg"].as_f64().unwrap();
    assert!(r_a(1) < r_a(0), "{cases:?}");
    let curves = fs::read_to_string(out.join("rejection.csv")).unwrap();
    let mut lines = curves.lines();
    let columns = lines.next().unwrap().split(',').count();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    // Two pixels from −30° to 30° in steps of 5°.
    assert_eq!(rows.len(), 2 * 13);
    for row in &rows {
        assert_eq!(row.len(), columns);
        let n: Vec<f64> = row[2..].iter().map(|c| c.parse().unwrap()).collect();
        let [_, left, right, sum, ratio, total, reflected] = n[..] else {
            panic!("{row:?}");
        };
        let ours = if n[0] >= 0.0 {
            left / right
        } else {
            right / left
        };
        assert!((ratio - ours).abs() < 1e-3 * ours.max(1.0) && (sum - left - right).abs() < 2e-5);
        // Two rows of sub-pixels alike.
        assert!((total - 2.0 * sum).abs() < 5e-3 && total + reflected < 1.0);
    }
    let ranges = fs::read_to_string(out.join("rejection-ranges.csv")).unwrap();
    assert_eq!(ranges.lines().count(), 3);
    let svg = fs::read_to_string(out.join("rejection.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));

    refused(&study("tungsten", "5", "30", ""), "metal");
    // Its pixels are its own.
    refused(
        &study("pitch", "5", "30", "1.6um"),
        "--pixel does not apply to this study; allowed: with rejection",
    );
    let runs = qpgen(folder.path(), &["study", "rejection", "--exact-runs", "8"]);
    refused(
        &runs,
        "--exact-runs with --model wave; allowed: with --model corrected",
    );
    let chart = qpgen(folder.path(), &["study", "size", "--theta-step-deg", "5"]);
    refused(&chart, "--theta-step-deg does not apply");
    refused(&study("rejection", "5", "30", "9um"), "9um");
    refused(
        &study("rejection", "5", "90", "1.6um"),
        "--theta-max-deg 90",
    );
    refused(&study("pitch", "0", "30", ""), "--theta-step-deg is 0");
    refused(&study("colour", "5", "30", ""), "invalid value");
}

#[test]
fn a_knob_of_accuracy_that_is_gone_names_the_page_that_holds_its_answer() {
    let folder = tempfile::tempdir().unwrap();
    let output = qpgen(folder.path(), &["accuracy", "rays", "lens"]);
    refused(&output, "benches/runs/2026-11-21/accuracy.md");
    assert!(!folder.path().join("accuracy").exists());
}

#[test]
fn bad_directions_tables_and_pixels_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let response = |more: &[&str]| {
        let arguments: Vec<&str> = ["response"].iter().chain(more).copied().collect();
        qpgen(folder.path(), &arguments)
    };
    refused(&response(&["--theta-deg", "90"]), "--theta-deg is 90");
    refused(
        &response(&["--theta-deg", "0", "--phi-deg", "inf"]),
        "--phi-deg is inf",
    );
    refused(&response(&["--grid", "1"]), "steps is 1");
    refused(&response(&["--cosine-max", "1.5"]), "cosine_max is 1.5");
    refused(
        &response(&["--wavelength-nm", "900"]),
        "wavelength_nm is 900",
    );
    refused(&response(&["--wavelength-nm", "600,500"]), "wavelengths_nm");
    refused(
        &response(&["--pixel", "2.8um-tungsten", "--theta-deg", "0"]),
        "metal",
    );
    refused(
        &response(&["--model", "geometric", "--focal-length-um", "0"]),
        "focal_length_um",
    );
    refused(
        &response(&["--focal-length-um", "5"]),
        "--focal-length-um with --model wave; allowed: with --model geometric",
    );
    refused(
        &response(&["--theta-deg", "0", "--grid", "7"]),
        "cannot be used with",
    );
    let old = folder.path().join("old.toml");
    fs::write(
        &old,
        "name = \"x\"\npitch_um = 2.8\nsubpixels = [2, 2]\nplanarization_um = 0.5\n",
    )
    .unwrap();
    refused(
        &response(&["--pixel", old.to_str().unwrap()]),
        "planarization_um",
    );
}

#[test]
fn a_file_of_others_under_a_name_that_was_not_given_stays() {
    let folder = tempfile::tempdir().unwrap();
    let theirs = folder.path().join("1.6um-wave.npz");
    fs::write(&theirs, b"measured last year").unwrap();
    let arguments = "response --pixel 1.6um --preset draft --grid 2";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let run = || {
        let mut command = command(folder.path(), &arguments);
        command.current_dir(folder.path()).output().unwrap()
    };
    refused(&run(), "1.6um-wave.npz");
    assert_eq!(fs::read(&theirs).unwrap(), b"measured last year");
    fs::remove_file(&theirs).unwrap();
    // A table of ours is made again.
    assert!(run().status.success() && run().status.success());
    assert!(fs::read(&theirs).unwrap().starts_with(b"PK"));
}

#[test]
fn a_table_made_in_parts_has_the_bytes_of_one_made_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let table = |cache: &str, more: &[&str]| {
        let output = folder.path().join(format!("{cache}.npz"));
        let arguments = "response --pixel 2.8um --preset draft --grid 5 --json -o";
        let arguments = arguments.split(' ').chain([output.to_str().unwrap()]);
        let arguments: Vec<&str> = arguments.chain(more.iter().copied()).collect();
        let said = json(&qpgen(&folder.path().join(cache), &arguments));
        (said, fs::read(output).ok())
    };
    let (said, whole) = table("whole", &[]);
    let runs = said["build"]["runs"].as_u64().unwrap();
    for split in [2, 5] {
        let cache = format!("parts-{split}");
        let mut done = 0;
        for part in 1..=split {
            let (said, none) = table(&cache, &["--shard", &format!("{part}/{split}")]);
            done += said["runs"].as_u64().unwrap();
            assert!(none.is_none() && said["reused"] == 0);
        }
        assert_eq!(done, runs);
        // A shard that is run again does nothing twice.
        let (said, _) = table(&cache, &["--shard", &format!("1/{split}")]);
        assert_eq!(said["reused"], said["runs"]);
        let (said, joined) = table(&cache, &[]);
        assert_eq!(said["build"]["reused"], runs, "{split}");
        assert!(joined == whole, "{split}");
        let left = fs::read_dir(folder.path().join(&cache)).unwrap();
        let left: Vec<_> = left.map(|f| f.unwrap().path()).collect();
        assert!(
            left.len() == 1 && left[0].extension().is_some_and(|e| e == "npz"),
            "{left:?}"
        );
    }
    // A part that never came is made by the call that joins.
    table("some", &["--shard", "2/3"]);
    let (said, joined) = table("some", &[]);
    assert!((1..runs).contains(&said["build"]["reused"].as_u64().unwrap()));
    assert!(joined == whole);
}
