//! The program as a process: what it writes, what it refuses, and with which exit code.

// because tests fail by panicking
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::fs;

use common::small::{SMALL, attempt, dataset, refused_config};
use common::{files, qpgen, refused, render, said};

#[test]
fn same_seed_same_bytes_at_any_thread_count_and_a_sound_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let runs: Vec<_> = ["1", "2", "5"]
        .iter()
        .map(|threads| {
            let name = format!("threads-{threads}");
            dataset(folder.path(), &name, SMALL, &["--threads", threads]);
            files(&folder.path().join(name))
        })
        .collect();
    assert!(runs[0] == runs[1] && runs[0] == runs[2]);
    let root = folder.path().join("threads-1");
    let check = qpgen(&["check", root.to_str().unwrap()]);
    assert!(
        check.status.success(),
        "{}",
        String::from_utf8_lossy(&check.stdout)
    );

    // Another seed is another dataset.
    dataset(folder.path(), "other", SMALL, &["--seed", "6"]);
    assert_ne!(
        files(&folder.path().join("other"))["samples/000000/raw.png"],
        runs[0]["samples/000000/raw.png"]
    );
}

#[test]
fn a_sample_does_not_depend_on_their_number_and_a_stopped_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "grown", SMALL, &["--count", "1"]);
    let root = folder.path().join("grown");
    let first = fs::read(root.join("samples/000000/raw.png")).unwrap();
    let grown = dataset(folder.path(), "grown", SMALL, &[]);
    assert!(
        String::from_utf8_lossy(&grown.stdout).contains("1 of an earlier run"),
        "{grown:?}"
    );
    assert_eq!(
        fs::read(root.join("samples/000000/raw.png")).unwrap(),
        first
    );
    dataset(folder.path(), "whole", SMALL, &[]);
    assert!(files(&root) == files(&folder.path().join("whole")));
    // Fewer samples than are there, or another configuration, would leave a mixture.
    for more in [["--count", "1"], ["--seed", "9"]] {
        let refused = attempt(folder.path(), "grown", SMALL, &more);
        assert_eq!(refused.status.code(), Some(2), "{more:?}");
    }
    assert!(
        files(&root) == files(&folder.path().join("whole")),
        "a refused run changed the dataset"
    );
}

#[test]
fn a_sample_is_rendered_again_from_its_own_description() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "data", SMALL, &[]);
    let sample = folder.path().join("data/samples/000001");
    let again = folder.path().join("again");
    render(&sample.join("meta.json"), &again);
    for name in [
        "raw.png",
        "views.exr",
        "depth.exr",
        "disparity.exr",
        "target.exr",
        "occlusion.png",
        "valid.png",
    ] {
        assert_eq!(
            fs::read(sample.join(name)).unwrap(),
            fs::read(again.join(name)).unwrap(),
            "{name}"
        );
    }
}

#[test]
fn the_printed_configuration_is_the_default_one() {
    let printed = qpgen(&["dataset", "--print-config"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    let read = quadpixel_generators::config::DatasetConfig::from_toml(&text, "printed").unwrap();
    let default = quadpixel_generators::config::DatasetConfig::from_toml(
        quadpixel_generators::config::DEFAULT_TOML,
        "default",
    )
    .unwrap();
    assert_eq!(read, default);
    assert!(text.contains("# samples"));
}

#[test]
fn bad_configurations_are_refused_with_field_and_value_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("count = 2", "count = 0", "count"),
        (
            "rays_per_pixel = 16",
            "rays_per_pixel = 0",
            "rays_per_pixel",
        ),
        (
            "charts = [\"noise\", \"checkerboard\"]",
            "charts = [\"nosie\"]",
            "nosie",
        ),
        (
            "names = [\"wide_US20120327520A1_emb3\"]",
            "names = [\"no-such-lens\"]",
            "no-such-lens",
        ),
        ("subpixels = \"2x2\"", "subpixels = \"5x7\"", "5x7"),
        ("pitch_um = 2.0", "pitch_um = nan", "pitch_um"),
        ("pitch_um = 2.0", "pitch_um = -2.0", "pitch_um"),
        ("pitch_um = 2.0", "", "pitch_um"),
        (
            "focus_mm = { min = 200, max = 400 }",
            "focus_mm = { min = 400, max = 200 }",
            "focus_mm",
        ),
        ("focus_mm = { min = 200, max = 400 }", "focus_mm = 2.0", "2"),
        ("width = 40", "width = 0", "width"),
        ("width = 40", "widht = 40", "widht"),
        (
            "window = { at = \"random\", max_height_mm = 1.0 }",
            "window = { at = \"chief-ray-angle\", theta_deg = 80, phi_deg = 0 }",
            "theta_deg",
        ),
        ("card_size = 0.4", "card_size = -0.4", "card_size"),
        (
            "model = \"geometric\"",
            "model = \"wave\"\npixels = [\"7um\"]",
            "7um",
        ),
    ];
    for (right, wrong, named) in cases {
        assert!(SMALL.contains(right));
        refused_config(folder.path(), &SMALL.replace(right, wrong), named);
    }
}

#[test]
fn a_window_outside_the_image_circle_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let big = SMALL
        .replace("pitch_um = 2.0", "pitch_um = 99.0")
        .replace("width = 40", "width = 100");
    let done = attempt(folder.path(), "big", &big, &[]);
    let text = said(&done);
    assert!(
        done.status.code() == Some(2) && text.contains("image circle") && text.contains("mm"),
        "{text}"
    );
}

#[test]
fn a_foreign_folder_a_file_and_a_read_only_place_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = folder.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "years of work").unwrap();
    let done = attempt(folder.path(), "foreign", SMALL, &[]);
    assert_eq!(done.status.code(), Some(2));
    assert_eq!(files(&foreign).len(), 1);

    fs::write(folder.path().join("file"), "text").unwrap();
    assert_eq!(
        attempt(folder.path(), "file", SMALL, &[]).status.code(),
        Some(2)
    );

    // A place where nobody can write, root included.
    let config = folder.path().join("file.toml");
    let done = qpgen(&[
        "dataset",
        "--config",
        config.to_str().unwrap(),
        "--out",
        "/proc/quadpixel/out",
    ]);
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    assert!(said(&done).contains("/proc/quadpixel"));
}

#[test]
fn unreadable_recipes_and_lenses_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let render_text = |text: &str| {
        let scene = folder.path().join("scene.toml");
        fs::write(&scene, text).unwrap();
        qpgen(&[
            "render",
            scene.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ])
    };
    for text in ["", "lens = 3", "\u{0}\u{1}"] {
        refused(&render_text(text), "scene.toml");
    }
    let lens = folder.path().join("lens.json");
    fs::write(&lens, r#"{ "name": "x", "surfaces": [] }"#).unwrap();
    refused(
        &qpgen(&["lens", "info", lens.to_str().unwrap()]),
        "lens.json",
    );
    assert!(!out.exists());
}

#[test]
fn every_subcommand_has_help_with_an_example() {
    for command in [
        "dataset", "merge", "preview", "render", "response", "study", "validate", "check",
    ] {
        let help = String::from_utf8(qpgen(&[command, "--help"]).stdout).unwrap();
        assert!(help.contains("Example: qpgen"), "{command}");
    }
}

#[test]
fn a_printed_pixel_is_read_back_as_the_same_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let printed = qpgen(&["response", "--pixel", "1.6um", "--print-pixel"]);
    assert!(printed.status.success(), "{printed:?}");
    let file = folder.path().join("pixel.toml");
    fs::write(&file, printed.stdout).unwrap();
    let angles = |pixel: &str| {
        let arguments = "response --theta-deg 0,10 --preset draft --pixel";
        let arguments = arguments.split(' ').chain([pixel]);
        let said = qpgen(&arguments.collect::<Vec<_>>()).stdout;
        let lines = String::from_utf8(said).unwrap();
        // The last column is the time that it took.
        let line = |l: &str| l.rsplit_once(' ').map(|(found, _)| found.trim().to_owned());
        lines.lines().map(line).collect::<Vec<_>>()
    };
    let ours = angles("1.6um");
    assert!(ours.len() == 3 && ours == angles(file.to_str().unwrap()));
    let broken = fs::read_to_string(&file)
        .unwrap()
        .replace("pitch_um = 1.6", "pitch_um = -1.6");
    fs::write(&file, broken).unwrap();
    let arguments = "response --theta-deg 0 --pixel".split(' ');
    let arguments: Vec<&str> = arguments.chain(file.to_str()).collect();
    refused(&qpgen(&arguments), "pitch_um");
}
