//! `qpgen … | head`.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::process::{Command, Stdio};

use quadpixel_cli::process::CLOSED_PIPE;

#[test]
fn a_reader_that_goes_away_ends_the_process_without_a_word() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let run = Command::new(env!("CARGO_BIN_EXE_qpgen"))
        .args(["dataset", "--print-config"])
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(String::from_utf8_lossy(&run.stderr), "");
    assert_eq!(run.status.code(), Some(CLOSED_PIPE));
}
