//! Datasets of small samples with an ideal pixel (no response table), made by processes that are killed or fail.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use super::said;

const CONFIGURATION: &str = r#"
count = 1
seed = 5
rays_per_pixel = 4
exposure_ev = 0
[lens]
names = ["lib_triplet_US2453260"]
focus_mm = { min = 800, max = 1600 }
[sensor]
subpixels = "2x2"
width = 32
height = 24
window = { at = "random", max_height_mm = 1.0 }
microlens_shift = { rule = "chief-ray" }
pitch_um = 2.0
[response]
model = "geometric"
[scene]
charts = ["noise", "checkerboard"]
background_over_focus = 1.5
tilt_deg = { min = -10, max = 10 }
cards = 1
card_over_focus = 0.7
card_size = 0.4
texture_px = 32
"#;

/// Makes datasets of one configuration in one folder.
pub struct Generator {
    folder: PathBuf,
    config: PathBuf,
}

impl Generator {
    pub fn new(folder: &Path, count: usize) -> Self {
        let text = CONFIGURATION.replace("count = 1", &format!("count = {count}"));
        Self::of(folder, &text)
    }

    /// Of the configuration above after `change`.
    pub fn changed(folder: &Path, change: impl Fn(&str) -> String) -> Self {
        Self::of(folder, &change(CONFIGURATION))
    }

    fn of(folder: &Path, text: &str) -> Self {
        let config = folder.join("config.toml");
        fs::write(&config, text).unwrap();
        Self {
            folder: folder.to_owned(),
            config,
        }
    }

    /// `qpgen dataset` into `folder/name`.
    pub fn command(&self, name: &str, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        command.args(["dataset", "--config"]).arg(&self.config);
        command.arg("--out").arg(self.folder.join(name)).args(more);
        command
    }

    /// As [`Self::command`], to its end.
    pub fn make(&self, name: &str, more: &[&str]) {
        let done = self.command(name, more).output().unwrap();
        assert!(done.status.success(), "{name} {more:?}: {}", said(&done));
    }
}

/// A number from the environment.
pub fn number_from(variable: &str, otherwise: usize) -> usize {
    let set = std::env::var(variable).ok();
    set.map_or(otherwise, |value| value.parse().unwrap())
}

/// Sends a signal, such as `TERM`.
pub fn send(child: &Child, name: &str) {
    let command = format!("kill -{name} {}", child.id());
    let status = Command::new("sh").args(["-c", &command]).status();
    assert!(status.unwrap().success());
}
