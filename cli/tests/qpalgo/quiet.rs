//! What is not said: nothing on a pipe that nobody reads any more, and no progress by `--quiet`.
#![cfg(unix)]
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::process::{Command, Stdio};

use quadpixel::image::Image;
use quadpixel_cli::process::CLOSED_PIPE;

#[test]
fn a_reader_that_goes_away_ends_the_process_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let values = (0..64 * 64).map(|i| (i % 7) as f32 / 7.0).collect();
    let picture = Image::from_vec(64, 64, 1, values).unwrap();
    common::write_exr(&folder.path().join("a.exr"), &picture);
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let run = Command::new(env!("CARGO_BIN_EXE_qpalgo"))
        .args(["sharpness", "a.exr", "--quiet"])
        .current_dir(folder.path())
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(said, "");
    assert_eq!(run.status.code(), Some(CLOSED_PIPE));
}
