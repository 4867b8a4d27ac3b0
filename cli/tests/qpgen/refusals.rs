//! What is refused before the work, and what cannot be printed.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![cfg(unix)]

use std::fs;
use std::process::Command;

use crate::common::{qpgen, refused, said};

#[test]
fn an_argument_applies_or_the_command_says_that_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, qpgen(&["render", "--print-scene"]).stdout).unwrap();
    let (scene, out) = (scene.to_str().unwrap(), folder.path().join("out"));
    for [name, value] in [
        ["--size", "64x48"],
        ["--seed", "7"],
        ["--rays-per-pixel", "4096"],
        ["--exposure-ev", "1"],
        ["--lens", "lib_triplet_US2453260"],
    ] {
        let out = out.to_str().unwrap();
        refused(&qpgen(&["render", scene, name, value, "--out", out]), name);
        refused(&qpgen(&["render", name, value, "--out", out]), "--scene");
    }
    let data = folder.path().to_str().unwrap();
    let shards = [
        "export",
        data,
        "--layout",
        "dpdd",
        "--shard-mb",
        "1",
        "-o",
        "x",
    ];
    refused(&qpgen(&shards), "--shard-mb");
    assert!(!out.exists());
}

#[test]
fn what_cannot_be_is_found_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("s.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let render = "render --scene s.obj --distance-mm 750 --size 16x12 --rays-per-pixel 4";
    for (arguments, what) in [
        ("--exposure-ev NaN", "--exposure-ev"),
        ("--f-number=-1", "f_number is -1"),
        ("--focus-mm NaN", "--focus-mm"),
        ("--focus-mm=-inf", "focus_mm is -inf"),
        ("--keep-rays missing/rays.npz", "missing/rays.npz"),
        ("--out s.obj/out", "s.obj"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        command
            .args(render.split(' '))
            .args(arguments.split(' '))
            .current_dir(folder.path());
        let done = command.output().unwrap();
        let text = said(&done);
        assert!(
            matches!(done.status.code(), Some(1 | 2)),
            "{arguments}: {text}"
        );
        assert!(text.contains(what), "{arguments}: {text}");
        // A world's first look is written before its rays are traced.
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "{arguments}"
        );
    }
}

#[test]
fn what_cannot_be_printed_is_a_failure_and_no_panic() {
    for arguments in [
        &["lens", "list"][..],
        &["--help"],
        &["render", "--print-scene"],
    ] {
        let full = fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        let done = command.args(arguments).stdout(full).output().unwrap();
        let text = said(&done);
        assert_eq!(done.status.code(), Some(1), "{arguments:?}: {text}");
        assert!(
            text.contains("No space left") && !text.contains("panicked"),
            "{text}"
        );
    }
}

#[test]
fn small_files_that_declare_large_pictures_are_refused_by_the_budget() {
    let folder = tempfile::tempdir().unwrap();
    // 16384 × 16384 px of one grey: 0.8 GB of codes in a file of less than 1 MB.
    let path = folder.path().join("bomb.png");
    let side = 16384;
    quadpixel::image::raster::write_png8(&path, &vec![7; side * side], side, side, 1).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpalgo"));
    let done = command
        .arg("sharpness")
        .arg(&path)
        .args(["--max-memory", "500M"])
        .output()
        .unwrap();
    let text = said(&done);
    assert_eq!(done.status.code(), Some(2), "{text}");
    assert!(
        text.contains("16384 × 16384 px takes") && text.contains("--max-memory"),
        "{text}"
    );
}
