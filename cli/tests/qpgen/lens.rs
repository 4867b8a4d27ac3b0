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
fn no_number_of_a_lens_is_shown_with_dozens_of_digits() {
    let folder = tempfile::tempdir().unwrap();
    let surface = |radius_mm: f64, nd: Option<f64>, is_stop: bool| {
        serde_json::json!({
            "radius_mm": radius_mm, "thickness_mm": 2.0, "nd": nd, "vd": null, "conic": 0.0, "coefficients": {},
            "semi_aperture_mm": 1.0, "is_stop": is_stop,
        })
    };
    let surfaces = [surface(1e30, Some(1.5), true), surface(-10.0, None, false)];
    let lens = serde_json::json!({ "name": "nearly plane", "source": "a test", "wavelengths": [587.56], "surfaces": surfaces });
    std::fs::write(folder.path().join("lens.json"), lens.to_string()).unwrap();
    let output = qpgen_in(folder.path(), &["info", "lens.json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(text.contains("1.000e30"), "{text}");
    let longest = text
        .split(|c: char| !c.is_ascii_digit())
        .map(str::len)
        .max();
    assert!(longest < Some(13), "{text}");
}

#[test]
fn list_and_check_cover_the_library() {
    let listed = json(&["list", "--json"])["lenses"]
        .as_array()
        .unwrap()
        .len();
    let checked = json(&["check", "--json"]);
    let lenses = checked["lenses"].as_array().unwrap();
    assert_eq!((listed, lenses.len()), (18, 18));
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
    let cases: [(&[&str], i32, &str); 7] = [
        (&["info", "no_such_lens"], 2, "no_such_lens"),
        (&["info", "bad.json"], 2, "surfaces is []"),
        (&["info", "missing.zmx"], 2, "missing.zmx"),
        (&["info", "--f-number", "1"], 2, "f_number is 1"),
        (&["spots", "--focus-mm", "2"], 2, "distance_mm is 2"),
        (&["info", "--focus-mm", "1e10"], 2, "up to 1e7 mm"),
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

/// The default lens's file, changed.
fn lens_file(path: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let text = include_str!("../../../src/lens/library/wide_US20120327520A1_emb3.json");
    let mut file = serde_json::from_str(text).unwrap();
    change(&mut file);
    std::fs::write(path, file.to_string()).unwrap();
}

#[test]
fn check_goes_on_after_a_bad_lens_and_ends_with_2() {
    let folder = tempfile::tempdir().unwrap();
    lens_file(&folder.path().join("bad.json"), |file| {
        file["surfaces"] = serde_json::json!([])
    });
    lens_file(&folder.path().join("good.json"), |_| {});
    let names = ["bad.json", "good.json", "missing.zmx"];
    let table = qpgen_in(folder.path(), &[&["check"], &names[..]].concat());
    let (out, errors) = (
        String::from_utf8_lossy(&table.stdout),
        String::from_utf8_lossy(&table.stderr),
    );
    assert_eq!(table.status.code(), Some(2), "{errors}");
    assert!(out.contains("| good.json | "), "{out}");
    assert!(
        errors.lines().count() == 2
            && errors.contains("bad.json: surfaces is []")
            && errors.contains("missing.zmx")
    );
    let json = qpgen_in(folder.path(), &[&["check", "--json"], &names[..]].concat());
    assert_eq!(json.status.code(), Some(2));
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let lenses = json["lenses"].as_array().unwrap();
    let kinds: Vec<bool> = lenses
        .iter()
        .map(|lens| lens["error"].is_string())
        .collect();
    assert_eq!(kinds, [false, true, true]);
}

#[test]
fn a_rounded_stop_explains_an_f_number_that_it_makes() {
    let folder = tempfile::tempdir().unwrap();
    lens_file(&folder.path().join("rounded.json"), |file| {
        // Of 0.79386 mm, which gives F/2.6637; 0.7939 mm gives F/2.66353.
        file["surfaces"][0]["semi_aperture_mm"] = serde_json::json!(0.7939);
        let verification = &mut file["verification"];
        verification["stop_semi_aperture_mm"] = serde_json::json!(0.7939);
        verification["computed_f_number"] = serde_json::json!(2.6637);
        verification["epd_mm"] = serde_json::json!(1.5877);
        verification["rms_spot_um"] = serde_json::json!([]);
        file["stated"]["f_number"] = serde_json::json!(null);
    });
    let output = qpgen_in(folder.path(), &["check", "rounded.json"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && !text.contains("UNEXPLAINED"),
        "{text}"
    );
    assert!(text.contains("2.6637 / 2.6635"), "{text}");
}

#[test]
fn rims_that_overlap_are_trimmed_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    // Thinner glass between surfaces 1 and 2, whose rims then cross near their edge.
    lens_file(&folder.path().join("thin.json"), |file| {
        file["surfaces"][1]["thickness_mm"] = serde_json::json!(0.215);
    });
    let output = qpgen_in(folder.path(), &["info", "thin.json", "--json"]);
    let warning = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{warning}");
    assert!(
        warning.contains(
            "warning: thin.json: surfaces[1] and surfaces[2] overlap beyond a radius of 0.7"
        ),
        "{warning}"
    );
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let semi = |i: usize| info["surfaces"][i]["semi_aperture_mm"].as_f64().unwrap();
    assert!(
        semi(1) == semi(2) && (0.65..0.824).contains(&semi(1)),
        "{warning}"
    );
}
