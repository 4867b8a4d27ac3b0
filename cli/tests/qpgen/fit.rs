//! `qpgen fit`: what it prints without captures, and what is refused.

use std::process::{Command, Output};

use quadpixel::em::PixelStack;
use quadpixel::sensor::Subpixels;

use crate::common::{self, done, refused, said};

fn qpgen(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command.arg("fit").args(arguments).output().unwrap()
}

#[test]
fn the_example_of_a_capture_is_printed_and_names_files_that_must_be_there() {
    let printed = qpgen(&["--print-capture"]);
    assert!(printed.status.success());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("capture.toml");
    std::fs::write(&path, printed.stdout).unwrap();
    let output = qpgen(&[path.to_str().unwrap()]);
    refused(&output, "white_sheet_left.png");
}

#[test]
fn arguments_that_cannot_be_are_refused() {
    refused(&qpgen(&[]), "required");
    refused(&qpgen(&["/nowhere/capture.toml"]), "/nowhere/capture.toml");
    refused(&qpgen(&["--trials", "0"]), "--trials");
    refused(
        &qpgen(&["--trials", "1", "--prior", "silicon_um=3"]),
        "allowed: such as silicon_um=3,0.5",
    );
    refused(
        &qpgen(&["--trials", "1", "--prior", "silicon=3,1"]),
        "there is no such parameter; there are: radius_um",
    );
    refused(
        &qpgen(&["--trials", "1", "--prior", "silicon_um=99,1"]),
        "99",
    );
}

#[test]
fn the_grid_of_dots_is_printed_with_its_numbers() {
    let printed = qpgen(&[
        "--print-target",
        "--target-mm",
        "297x210",
        "--dot-pitch-mm",
        "15",
    ]);
    let svg = String::from_utf8(printed.stdout).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("19 x 12 dots of 1 mm, 15 mm apart"));
    refused(
        &qpgen(&["--print-target", "--target-mm", "A4"]),
        "allowed: such as 420x297",
    );
    refused(
        &qpgen(&["--print-target", "--dot-mm", "15"]),
        "dot_mm is 15",
    );
}

/// A table of few lens shifts, coarsely made.
const SMALL: &str = r#"
count = 1
seed = 3
rays_per_pixel = 8
exposure_ev = 0
[lens]
names = ["lib_dgauss_50mm"]
focus_mm = 400
[sensor]
subpixels = "2x2"
width = 12
height = 8
window = { at = "centre" }
microlens_shift = { rule = "centred" }
[response]
model = "wave"
pixels = ["2.8um"]
preset = "draft"
shifts = 4
[scene]
charts = ["noise"]
texture_px = 64
"#;

/// All of a camera file but its pixel.
const CAMERA: &str = r#"
name = "a phone"
lens = { focal_length_mm = 4.4, f_number = 2.2 }
charge = { diffusion_um = 0.15, crosstalk = 0.05 }
microlenses = { um = 0.1 }
"#;

#[test]
fn a_fitted_camera_takes_the_pictures_of_a_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let pixel = PixelStack {
        subpixels: Subpixels::DUAL_X,
        ..PixelStack::builtin("1.6um").unwrap()
    };
    let mut camera: toml::Table = toml::from_str(CAMERA).unwrap();
    camera.insert("pixel".into(), toml::Value::try_from(pixel).unwrap());
    std::fs::write(at("camera.toml"), camera.to_string()).unwrap();
    std::fs::write(at("small.toml"), SMALL).unwrap();
    let command = [
        "dataset",
        "--config",
        &at("small.toml"),
        "--out",
        &at("data"),
    ];
    let made = done(&[&command[..], &["--camera", &at("camera.toml")]].concat());
    assert!(said(&made).contains("stands in"), "{}", said(&made));
    let meta = std::fs::read(folder.path().join("data/samples/000000/meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_slice(&meta).unwrap();
    assert_eq!(meta["sensor"]["pitch_um"], 1.6);
    assert_eq!(meta["sensor"]["subpixels"], "2x1");
    // A sample is rendered again by the same camera.
    let shown = common::qpgen(
        &[
            &[
                "render",
                &at("data/samples/000000/meta.json"),
                "-o",
                &at("again"),
            ][..],
            &["--camera", &at("camera.toml")],
        ]
        .concat(),
    );
    assert!(shown.status.success(), "{}", said(&shown));
    let bad = common::qpgen(
        &[
            &command[..2],
            &[
                &at("small.toml"),
                "--out",
                &at("bad"),
                "--camera",
                "/nowhere/c.toml",
            ],
        ]
        .concat(),
    );
    refused(&bad, "/nowhere/c.toml");
    std::fs::write(at("broken.toml"), "name = 3").unwrap();
    let bad = common::qpgen(&[
        "dataset",
        "--out",
        &at("bad"),
        "--camera",
        &at("broken.toml"),
    ]);
    refused(&bad, "broken.toml");
    // A focal length that cannot be is named as it is written.
    let wrong = SMALL.replace("focus_mm = 400", "focus_mm = 400\nfocal_length_mm = -4");
    std::fs::write(at("wrong.toml"), wrong).unwrap();
    let bad = common::qpgen(&[
        "dataset",
        "--config",
        &at("wrong.toml"),
        "--out",
        &at("bad"),
    ]);
    refused(&bad, "lens.focal_length_mm is -4");
}
