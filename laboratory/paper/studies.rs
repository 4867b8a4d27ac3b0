//! The paper's studies of the pixel: Figs. 2, 3, 5, 8, 11, 12, 13.

use serde_json::Value;
use std::error::Error;

use crate::tools::Tools;

/// What the commands said.
pub struct Studies {
    /// Figs. 2 and 3(a).
    pub rejection: Value,
    /// Nine microlenses, in words.
    pub microlens: String,
    /// Fig. 3(b), which takes a vector model; not in the quick page.
    pub tungsten: Option<Value>,
    /// Fig. 8.
    pub validation: Value,
    /// Fig. 12.
    pub size: Value,
    /// Fig. 13.
    pub wavelength: Value,
}

/// Runs them all.
pub fn all(tools: &Tools) -> Result<Studies, Box<dyn Error>> {
    let study = |kind: &str, more: &[&str]| {
        let arguments = [&["study", kind, "--out", kind], more].concat();
        tools.json(kind, "qpgen", &arguments)
    };
    let exact: &[&str] = if tools.quick {
        &["--theta-step-deg", "10"]
    } else {
        &[
            "--model",
            "rcwa",
            "--theta-step-deg",
            "5",
            "--theta-max-deg",
            "40",
        ]
    };
    let coarse: &[&str] = if tools.quick {
        &["--theta-step-deg", "10"]
    } else {
        &["--theta-step-deg", "1"]
    };
    let pixels = ["--pixel", "3.5um-roc3.5,3.5um,3.5um-thin-filter"];
    let microlens = [&["study", "microlens", "--out", "microlens"], coarse].concat();
    let validate: &[&str] = if tools.quick {
        &[
            "validate",
            "--out",
            "validation",
            "--pixel",
            "1.6um",
            "--rays",
            "256",
        ]
    } else {
        &["validate", "--out", "validation"]
    };
    let cra: &[&str] = if tools.quick {
        &["--pixel", "1.6um"]
    } else {
        &[]
    };
    study("cra", cra)?;
    study("pitch", coarse)?;
    Ok(Studies {
        rejection: study("rejection", &[&pixels, exact].concat())?,
        microlens: tools.step("microlens", "qpgen", &microlens)?,
        tungsten: if tools.quick {
            None
        } else {
            Some(study("tungsten", exact)?)
        },
        validation: tools.json("validation", "qpgen", validate)?,
        size: study("size", &[])?,
        wavelength: study("wavelength", exact)?,
    })
}
