//! `qpgen` as a process, on datasets small enough for a second.

#![allow(dead_code)] // because each test binary uses its own part

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Two small samples with an ideal pixel, so that no response table is computed. Tables follow the top-level keys.
pub const SMALL: &str = r#"
count = 2
seed = 5
rays_per_pixel = 16
exposure_ev = 0
[lens]
names = ["wide_US20120327520A1_emb3"]
focus_mm = { min = 200, max = 400 }
[sensor]
subpixels = "2x2"
width = 40
height = 32
window = { at = "random", max_height_mm = 1.0 }
microlens_shift = { rule = "chief-ray" }
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise", "checkerboard"]
background_over_focus = 1.5
tilt_deg = { min = -10, max = 10 }
cards = 2
card_over_focus = 0.7
card_size = 0.4
texture_px = 64
"#;

pub fn qpgen(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_qpgen"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs `qpgen` and expects success.
pub fn done(arguments: &[&str]) -> Output {
    let output = qpgen(arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    output
}

/// Makes a dataset of the configuration `text` in `folder/NAME`.
pub fn dataset(folder: &Path, name: &str, text: &str, more: &[&str]) -> Output {
    let config = folder.join(format!("{name}.toml"));
    fs::write(&config, text).unwrap();
    let out = folder.join(name);
    let mut arguments = vec!["dataset", "--config", config.to_str().unwrap(), "--out"];
    arguments.push(out.to_str().unwrap());
    arguments.extend(more);
    done(&arguments)
}

/// Every file below a folder, by its relative path.
pub fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(root).unwrap().display().to_string();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}
