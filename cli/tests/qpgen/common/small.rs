//! Datasets small enough for a second.

use std::fs;
use std::path::Path;
use std::process::Output;

use super::{qpgen, refused};

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

/// `qpgen response` of a table of some seconds, on one thread: its wavelength and its file are to be added.
pub const SMALL_TABLE: [&str; 9] = [
    "--threads",
    "1",
    "response",
    "--pixel",
    "2.8um",
    "--preset",
    "draft",
    "--grid",
    "6",
];

/// The configuration `text` with other values at dotted places, in TOML; an empty one takes the place out.
pub fn with_values(text: &str, values: &[(&str, &str)]) -> String {
    let mut configuration: toml::Table = text.parse().unwrap();
    for (place, value) in values {
        let (sections, key) = place.rsplit_once('.').unwrap_or(("", place));
        let mut section = &mut configuration;
        for name in sections.split('.').filter(|name| !name.is_empty()) {
            let inner = section.entry(name).or_insert(toml::Table::new().into());
            section = inner.as_table_mut().unwrap();
        }
        let before = section.remove(key);
        if value.is_empty() {
            assert!(before.is_some(), "nothing at {place}");
        } else {
            let line: toml::Table = format!("{key} = {value}").parse().unwrap();
            section.extend(line);
        }
    }
    toml::to_string(&configuration).unwrap()
}

/// Tries to make a dataset of the configuration `text` in `folder/NAME`.
pub fn attempt(folder: &Path, name: &str, text: &str, more: &[&str]) -> Output {
    let config = folder.join(format!("{name}.toml"));
    fs::write(&config, text).unwrap();
    let out = folder.join(name);
    let [config, out] = [&config, &out].map(|path| path.to_str().unwrap());
    qpgen(&[&["dataset", "--config", config, "--out", out], more].concat())
}

/// Makes a dataset of the configuration `text` in `folder/NAME`.
pub fn dataset(folder: &Path, name: &str, text: &str, more: &[&str]) -> Output {
    let output = attempt(folder, name, text, more);
    assert!(output.status.success(), "{name}: {output:?}");
    output
}

/// The configuration `text` is refused with `why`, and nothing is made.
pub fn refused_config(folder: &Path, text: &str, why: &str) {
    refused(&attempt(folder, "refused", text, &[]), why);
    assert!(!folder.join("refused/samples/000000").exists(), "{why}");
}
