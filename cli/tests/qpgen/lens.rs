//! `qpgen lens` as a process: what it prints, writes and how it ends.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::path::Path;
use std::process::{Command, Output};

fn qpgen_in(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_qpgen"))
        .current_dir(folder)
        .arg("lens")
        .args(args)
        .output()
        .unwrap()
}

fn json(args: &[&str]) -> serde_json::Value {
    let output = qpgen_in(Path::new("."), args);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn info_of_the_default_lens_is_its_patents_focal_length() {
    let info = json(&["info", "--json"]);
    assert!((info["efl_mm"].as_f64().unwrap() - 4.22).abs() < 0.02);
    assert_eq!(info["surfaces"].as_array().unwrap().len(), 13);
    let stopped = json(&["info", "--f-number", "5.6", "--focus-mm", "1000", "--json"]);
    assert!((stopped["f_number"].as_f64().unwrap() - 5.6).abs() < 1e-9);
    assert!(stopped["sensor_z_mm"].as_f64() > info["sensor_z_mm"].as_f64());
}

#[test]
fn list_and_check_cover_the_library() {
    let listed = json(&["list", "--json"])["lenses"]
        .as_array()
        .unwrap()
        .len();
    let checked = json(&["check", "--json"]);
    let lenses = checked["lenses"].as_array().unwrap();
    assert_eq!((listed, lenses.len()), (17, 17));
    assert!(lenses.iter().all(|lens| lens["unexplained"] == 0));
}

#[test]
fn pictures_are_written_whole_under_their_names() {
    let folder = tempfile::tempdir().unwrap();
    for what in ["spots", "layout"] {
        let output = qpgen_in(folder.path(), &[what, "tele_US10571665B2_220b"]);
        let name = format!("tele_US10571665B2_220b-{what}.svg");
        assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), name);
        let picture = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
        assert!(!picture.contains("NaN") && !picture.contains("inf"));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn bad_lenses_end_with_2_and_unwritable_pictures_with_1() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.json");
    std::fs::write(
        &bad,
        "{\"name\": \"x\", \"source\": \"\", \"wavelengths\": [], \"surfaces\": []}",
    )
    .unwrap();
    let cases: [(&[&str], i32, &str); 6] = [
        (&["info", "no_such_lens"], 2, "no_such_lens"),
        (&["info", "bad.json"], 2, "surfaces is []"),
        (&["info", "missing.zmx"], 2, "missing.zmx"),
        (&["info", "--f-number", "1"], 2, "f_number is 1"),
        (&["spots", "--focus-mm", "2"], 2, "distance_mm is 2"),
        (&["layout", "-o", "no/folder/x.svg"], 1, "no/folder/x.svg"),
    ];
    for (args, code, expected) in cases {
        let output = qpgen_in(folder.path(), args);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {message}");
        assert!(
            message.contains(expected) && message.lines().count() == 1,
            "{message}"
        );
    }
}
