//! Datasets of small samples with an ideal pixel (no response table), made by processes that are killed or fail.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use super::said;
use super::small::{SMALL, with_values};

/// What the configuration has otherwise than [`SMALL`]: less of everything.
const VALUES: [(&str, &str); 8] = [
    ("rays_per_pixel", "4"),
    ("lens.names", r#"["lib_triplet_US2453260"]"#),
    ("lens.focus_mm", "{ min = 800, max = 1600 }"),
    ("sensor.width", "32"),
    ("sensor.height", "24"),
    ("scene.cards", "1"),
    ("scene.texture_px", "32"),
    ("count", "1"),
];

/// Makes datasets of one configuration in one folder.
pub struct Generator {
    folder: PathBuf,
    config: PathBuf,
}

impl Generator {
    pub fn new(folder: &Path, count: usize) -> Self {
        Self::with_values(folder, &[("count", &count.to_string())])
    }

    /// With other values at dotted places.
    pub fn with_values(folder: &Path, values: &[(&str, &str)]) -> Self {
        let config = folder.join("config.toml");
        let text = with_values(SMALL, &[&VALUES, values].concat());
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
