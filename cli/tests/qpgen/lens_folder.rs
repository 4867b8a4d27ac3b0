//! Folders of lens files: what loads is reported, and datasets draw from them.

use std::fs;
use std::path::Path;

use quadpixel::lens::Prescription;

use crate::common::small::{SMALL, with_values};
use crate::common::{done, json, qpgen, refused, said};

/// Three lenses that load, one of them below, and three that do not.
fn make(folder: &Path) {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../src/lens/library");
    fs::create_dir_all(folder.join("deep")).unwrap();
    for (name, to) in [
        ("lib_triplet_US2453260", "triplet.json"),
        ("tele_US10571665B2_220b", "deep/tele.json"),
    ] {
        fs::copy(library.join(format!("{name}.json")), folder.join(to)).unwrap();
    }
    let seq = "RDM\nTIT 'singlet, \"plano\"'\nEPD 10\nWL 587.56\nYAN 5\nSO 0 1e13\nS 50 3 NBK7_SCHOTT\n STO\nS 0 94\nSI\n";
    fs::write(folder.join("singlet.seq"), seq).unwrap();
    for glass in ["one", "two"] {
        fs::write(
            folder.join(format!("{glass}.seq")),
            seq.replace("NBK7", "XX"),
        )
        .unwrap();
    }
    fs::write(folder.join("none.zmx"), "").unwrap();
    fs::write(folder.join("notes.txt"), "not a lens").unwrap();
}

#[test]
fn a_folder_is_imported_with_figures_layouts_and_reasons() {
    let folder = tempfile::tempdir().unwrap();
    let lenses = folder.path().join("in");
    make(&lenses);
    let (from, out) = (lenses.to_str().unwrap(), folder.path().join("out"));
    let arguments = ["lens", "import", from, "-o", out.to_str().unwrap()];
    let report = json(&done(&[&arguments[..], &["--json"]].concat()));
    assert_eq!(
        (report["files"].as_u64(), report["loaded"].as_u64()),
        (Some(6), Some(3))
    );
    let lens = |file: &str| {
        let all = report["lenses"].as_array().unwrap();
        all.iter().find(|l| l["file"] == file).unwrap().clone()
    };
    let tele = Prescription::builtin("tele_US10571665B2_220b").unwrap();
    assert_eq!(lens("deep/tele.json")["lens"]["title"], tele.title());
    let singlet = lens("singlet.seq");
    let efl = singlet["lens"]["efl_mm"].as_f64().unwrap();
    assert!((efl - 50.0 / 0.5168).abs() < 2e-3);
    assert!(
        lens("one.seq")["error"]
            .as_str()
            .unwrap()
            .contains("unknown glass `XX_SCHOTT`")
    );
    let csv = fs::read_to_string(out.join("lenses.csv")).unwrap();
    assert_eq!(csv.lines().count(), 7);
    assert!(csv.contains("\"singlet, \"\"plano\"\"\""), "{csv}");
    let drawn = fs::read_dir(out.join("layouts")).unwrap().count();
    assert_eq!(drawn, 3);
    // Again over its own report, and as text: equal reasons are one line.
    let text = String::from_utf8(done(&arguments).stdout).unwrap();
    assert!(text.contains("3 of 6 files load"), "{text}");
    assert_eq!(text.matches("unknown glass").count(), 1);
    assert!(text.contains("2 × S1: unknown glass"), "{text}");
    let nothing = folder.path().join("empty");
    fs::create_dir(&nothing).unwrap();
    refused(
        &qpgen(&["lens", "import", nothing.to_str().unwrap()]),
        "no lens file",
    );
}

#[test]
fn a_dataset_draws_from_a_folder_what_the_filter_takes() {
    let folder = tempfile::tempdir().unwrap();
    let lenses = folder.path().join("in");
    make(&lenses);
    let from = format!("\"{}\"", lenses.display());
    let config = |filter: &str| {
        let values = [
            ("count", "3"),
            ("lens.names", "[]"),
            ("lens.from", from.as_str()),
            ("lens.filter", filter),
        ];
        let path = folder.path().join("c.toml");
        fs::write(&path, with_values(SMALL, &values)).unwrap();
        path.display().to_string()
    };
    let out = folder.path().join("out").display().to_string();
    let path = config("{ f_number = [2.0, 4.0], focal_length_mm = [60, 200] }");
    let run = qpgen(&["dataset", "--config", &path, "--out", &out]);
    assert!(run.status.success(), "{}", said(&run));
    assert!(said(&run).contains("unknown glass"), "{}", said(&run));
    for number in 0..3 {
        let meta = fs::read_to_string(format!("{out}/samples/00000{number}/meta.json")).unwrap();
        let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
        let name = meta["lens"]["name"].as_str().unwrap();
        assert!(name.ends_with("triplet.json"), "{name}");
    }
    for (filter, why) in [
        ("{ f_number = [0.1, 0.2] }", "3 load and none is taken"),
        ("{ f_number = [4, 2] }", "lens.filter.f_number is [4, 2]"),
        ("{ kind = \"macro\" }", "macro"),
    ] {
        let path = config(filter);
        refused(&qpgen(&["dataset", "--config", &path, "--out", &out]), why);
    }
    let text = with_values(SMALL, &[("lens.names", "[]")]);
    let path = folder.path().join("c.toml");
    fs::write(&path, text).unwrap();
    let arguments = ["dataset", "--config", path.to_str().unwrap(), "--out", &out];
    refused(&qpgen(&arguments), "lens.names is empty");
}
