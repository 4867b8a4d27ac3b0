//! Lenses of a folder, in the place of their names.

use std::cmp::Ordering;
use std::path::Path;

use quadpixel::lens::{Lens, LensFigures, LensKind, Prescription, lens_files};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{ConfigError, LensConfig};

/// Which lenses of a folder are taken; what is absent does not matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LensFilter {
    /// By half of the field of view: tele below 15°, normal below 30°, wide below 60°, fish-eye from there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<LensKind>,
    /// Smallest and largest F-number, wide open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<[f64; 2]>,
    /// Smallest and largest half field of view, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_field_deg: Option<[f64; 2]>,
    /// Shortest and longest focal length, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_length_mm: Option<[f64; 2]>,
}

impl LensFilter {
    fn takes(&self, lens: &LensFigures) -> bool {
        let within = |range: Option<[f64; 2]>, value: f64| {
            range.is_none_or(|[least, most]| (least..=most).contains(&value))
        };
        self.kind.is_none_or(|kind| kind == lens.kind())
            && within(self.f_number, lens.f_number)
            && within(self.half_field_deg, lens.half_field_deg)
            && within(self.focal_length_mm, lens.efl_mm)
    }

    fn check(&self) -> Result<(), ConfigError> {
        for (name, range) in [
            ("f_number", self.f_number),
            ("half_field_deg", self.half_field_deg),
            ("focal_length_mm", self.focal_length_mm),
        ] {
            if let Some([least, most]) =
                range.filter(|[least, most]| least.partial_cmp(most).is_none_or(Ordering::is_gt))
            {
                return Err(ConfigError::Together(format!(
                    "lens.filter.{name} is [{least}, {most}]; allowed: two numbers, the smaller one first"
                )));
            }
        }
        Ok(())
    }
}

impl LensConfig {
    /// Puts the lenses of the folder that load, and that the filter takes, behind the names. Returns what does not
    /// load, a line each.
    ///
    /// # Errors
    /// A folder that cannot be read, or without a lens that is taken.
    pub fn listed(&mut self) -> Result<Vec<String>, ConfigError> {
        let Some(folder) = self.from.take() else {
            return Ok(Vec::new());
        };
        let filter = self.filter.take().unwrap_or_default();
        let failed = |what: String| ConfigError::Together(format!("lens.from: {what}"));
        let files = lens_files(Path::new(&folder)).map_err(|e| failed(e.to_string()))?;
        let read = |file: &Path| {
            let lens = Lens::new(&Prescription::from_file(file)?)?;
            LensFigures::of(&lens)
        };
        let all: Vec<_> = files.par_iter().map(|file| (file, read(file))).collect();
        let (mut skipped, mut loaded, mut taken) = (Vec::new(), 0, 0);
        for (file, lens) in all {
            match lens {
                Ok(lens) => {
                    loaded += 1;
                    if filter.takes(&lens) {
                        taken += 1;
                        self.names.push(file.display().to_string());
                    }
                }
                Err(error) => skipped.push(error.to_string()),
            }
        }
        match taken {
            0 => Err(failed(format!(
                "{folder} has {} lens files, of which {loaded} load and none is taken; allowed: one or more .json, .zmx or .seq files within lens.filter",
                files.len()
            ))),
            _ => Ok(skipped),
        }
    }

    /// Names, or a folder; a filter only with a folder.
    pub(super) fn check_names(&self) -> Result<(), ConfigError> {
        if self.names.is_empty() && self.from.is_none() {
            return Err(ConfigError::Together(
                "lens.names is empty; allowed: one name or more, or lens.from, a folder of lens files".into(),
            ));
        }
        match (&self.filter, &self.from) {
            (Some(_), None) => Err(ConfigError::Together(
                "lens.filter without lens.from; allowed: with a folder of lens files".into(),
            )),
            (Some(filter), _) => filter.check(),
            (None, _) => Ok(()),
        }
    }
}
