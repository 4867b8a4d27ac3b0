//! The two programs, run in the work folder.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use quadpixel::file;
use serde_json::Value;

/// `qpgen` and `qpalgo`, and where they write.
pub struct Tools {
    programs: PathBuf,
    pub work: PathBuf,
    pub quick: bool,
}

impl Tools {
    pub fn new(programs: &Path, work: &Path, quick: bool) -> Result<Self, Box<dyn Error>> {
        let failed = |e: &dyn std::fmt::Display, p: &Path| format!("{}: {e}", p.display());
        let work = work.join(if quick { "quick" } else { "full" });
        file::create_folder(&work).map_err(|e| failed(&e, &work))?;
        let whole = |p: &Path| p.canonicalize().map_err(|e| failed(&e, p));
        Ok(Self {
            programs: whole(programs)?,
            work: whole(&work)?,
            quick,
        })
    }

    /// What the program prints for `arguments`, given from the work folder. Kept in `NAME.out` there; a step whose file
    /// is there is not run.
    pub fn step(
        &self,
        name: &str,
        program: &str,
        arguments: &[&str],
    ) -> Result<String, Box<dyn Error>> {
        let kept = self.work.join(format!("{name}.out"));
        if let Ok(text) = std::fs::read_to_string(&kept) {
            return Ok(text);
        }
        eprintln!("{name}: {program} {}", arguments.join(" "));
        let output = Command::new(self.programs.join(program))
            .args(arguments)
            .current_dir(&self.work)
            .stderr(Stdio::inherit())
            .output()
            .map_err(|e| format!("{program}: {e}"))?;
        if !output.status.success() {
            return Err(format!(
                "{name}: {program} {}: {}",
                arguments.join(" "),
                output.status
            )
            .into());
        }
        file::write_aside(&kept, &output.stdout)?;
        String::from_utf8(output.stdout).map_err(|e| format!("{name}: {e}").into())
    }

    /// [`Self::step`] of a command that prints one JSON object when told `--json`.
    pub fn json(
        &self,
        name: &str,
        program: &str,
        arguments: &[&str],
    ) -> Result<Value, Box<dyn Error>> {
        let arguments = [arguments, &["--json"]].concat();
        let text = self.step(name, program, &arguments)?;
        serde_json::from_str(&text).map_err(|e| format!("{name}: {e}").into())
    }

    /// Writes a file that a step reads.
    pub fn write(&self, name: &str, text: &str) -> Result<(), Box<dyn Error>> {
        file::write_aside(&self.work.join(name), text.as_bytes()).map_err(Into::into)
    }
}
