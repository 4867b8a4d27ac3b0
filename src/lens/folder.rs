//! Folders of lens files: which there are, and what each lens is.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::LensError;
use super::library::FILES;
use super::placed::Lens;
use super::prescription::Prescription;
use crate::file::FileError;
use crate::units::D_LINE_NM;

/// Folders below each other, at most.
const DEEPEST: usize = 16;

/// Kinds of lenses, by half of the field of view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LensKind {
    /// Below 15°.
    Tele,
    /// 15° to 30°.
    Normal,
    /// 30° to 60°.
    Wide,
    /// 60° and more.
    FishEye,
}

/// What a lens is, at the d line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LensFigures {
    /// Its own name, or that of its file.
    pub title: String,
    /// Effective focal length, mm.
    pub efl_mm: f64,
    /// F-number, wide open.
    pub f_number: f64,
    /// Half of the field of view that its apertures let through, deg; stated by the file, or found by chief rays.
    pub half_field_deg: f64,
    /// From the last vertex to the rear focal point, mm.
    pub bfl_mm: f64,
    /// Surfaces, the stop included.
    pub surfaces: usize,
    /// What was changed when it was read.
    pub warnings: Vec<String>,
}

impl LensFigures {
    /// Of a lens.
    ///
    /// # Errors
    /// A lens without a focal length, or that no ray passes.
    pub fn of(lens: &Lens) -> Result<Self, LensError> {
        let paraxial = lens.paraxial(D_LINE_NM)?;
        let prescription: &Prescription = lens.prescription();
        Ok(Self {
            title: prescription.title().to_owned(),
            efl_mm: paraxial.efl_mm,
            f_number: paraxial.f_number,
            half_field_deg: lens.half_field_deg()?,
            bfl_mm: paraxial.bfl_mm,
            surfaces: prescription.surfaces.len(),
            warnings: prescription.warnings.clone(),
        })
    }

    /// Its kind.
    pub fn kind(&self) -> LensKind {
        match self.half_field_deg {
            half if half < 15.0 => LensKind::Tele,
            half if half < 30.0 => LensKind::Normal,
            half if half < 60.0 => LensKind::Wide,
            _ => LensKind::FishEye,
        }
    }
}

/// The lens files of a folder and of those below it, in the order of their names; links are not followed.
///
/// # Errors
/// A folder that cannot be read.
pub fn lens_files(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let mut files = Vec::new();
    let mut folders = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        let failed = |cause| FileError::new(&folder, "read", cause);
        for entry in std::fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
            let extension = path.extension().and_then(|e| e.to_str());
            let is_lens =
                extension.is_some_and(|e| FILES.contains(&e.to_ascii_lowercase().as_str()));
            if kind.is_dir() && depth < DEEPEST {
                folders.push((path, depth + 1));
            } else if kind.is_file() && is_lens {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn files_are_found_in_order_and_links_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("b/deeper")).unwrap();
        for name in ["b/deeper/x.SEQ", "b/a.zmx", "z.json", "notes.txt"] {
            std::fs::write(at(name), "").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.path(), at("b/again")).unwrap();
        let found = lens_files(folder.path()).unwrap();
        assert_eq!(found, [at("b/a.zmx"), at("b/deeper/x.SEQ"), at("z.json")]);
        assert!(lens_files(&at("none")).is_err());
    }

    #[test]
    fn figures_are_those_of_the_lens() {
        let lens = Lens::new(&Prescription::builtin("tele_US10571665B2_220b").unwrap()).unwrap();
        let figures = LensFigures::of(&lens).unwrap();
        let paraxial = lens.paraxial(D_LINE_NM).unwrap();
        assert_eq!(
            (figures.efl_mm, figures.f_number),
            (paraxial.efl_mm, paraxial.f_number)
        );
        assert_eq!(figures.kind(), LensKind::Tele);
    }
}
