//! `qpgen fit`: what it prints without captures, and what is refused.

use std::process::{Command, Output};

use crate::common::refused;

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
