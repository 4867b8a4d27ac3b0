//! The lenses that come with the crate, and lenses from files.
//!
//! `library/README.md` says where each comes from.

use std::path::Path;

use super::error::LensError;
use super::prescription::Prescription;

macro_rules! builtin {
    ($name:literal) => {
        ($name, include_str!(concat!("library/", $name, ".json")))
    };
}

const LIBRARY: &[(&str, &str)] = &[
    builtin!("lib_50mm_US20210263286_ex1"),
    builtin!("lib_dgauss_50mm"),
    builtin!("lib_double_gauss_100mm_glass"),
    builtin!("lib_fisheye_10mm"),
    builtin!("lib_fisheye_Miyamoto1964"),
    builtin!("lib_telephoto_250mm"),
    builtin!("lib_triplet_US2453260"),
    builtin!("lib_wide_22mm"),
    builtin!("tele_US10571665B2_220a"),
    builtin!("tele_US10571665B2_220b"),
    builtin!("wide_US10281683B2_110"),
    builtin!("wide_US11940605B2_emb1"),
    builtin!("wide_US11940605B2_emb9"),
    builtin!("wide_US20120327520A1_emb3"),
    builtin!("wide_US20120327520A1_emb5"),
    builtin!("wide_US8345358B2_table12"),
    builtin!("wide_US9261676B2_table9"),
    builtin!("wide_deeplens_cellphone80deg"),
];

/// How the names of lens files end.
pub const FILES: [&str; 3] = ["json", "zmx", "seq"];

/// The names of the built-in lenses, in alphabetical order.
pub fn builtin_names() -> Vec<&'static str> {
    LIBRARY.iter().map(|(name, _)| *name).collect()
}

impl Prescription {
    /// A built-in lens by its name.
    ///
    /// # Errors
    /// [`LensError::UnknownLens`] with the names that exist.
    pub fn builtin(name: &str) -> Result<Prescription, LensError> {
        match LIBRARY.iter().find(|(known, _)| *known == name) {
            Some((known, text)) => Prescription::from_json(text, known),
            None => Err(LensError::UnknownLens {
                name: name.into(),
                known: builtin_names().join(", "),
            }),
        }
    }

    /// A lens from a `.json`, `.zmx` or `.seq` file.
    ///
    /// # Errors
    /// [`LensError::Unreadable`] when the file cannot be read or its name ends otherwise; those of
    /// [`Prescription::from_json`], [`Prescription::from_zmx`] and [`Prescription::from_seq`].
    pub fn from_file(path: &Path) -> Result<Prescription, LensError> {
        let file = path.display().to_string();
        let unreadable = |reason: String| LensError::Unreadable {
            file: file.clone(),
            reason,
        };
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        let extension = extension.to_ascii_lowercase();
        if !FILES.contains(&extension.as_str()) {
            let allowed = "a lens file must end in .json, .zmx or .seq";
            return Err(unreadable(allowed.into()));
        }
        let bytes = crate::file::read(path).map_err(|error| unreadable(error.cause.to_string()))?;
        match extension.as_str() {
            "json" => {
                let text = std::str::from_utf8(&bytes);
                let text = text.map_err(|error| unreadable(error.to_string()))?;
                Prescription::from_json(text, &file)
            }
            "zmx" => Prescription::from_zmx(&bytes, &file),
            _ => Prescription::from_seq(&bytes, &file),
        }
    }

    /// A built-in lens by its name, or a lens from a file when `name` ends in .json, .zmx or .seq.
    ///
    /// # Errors
    /// Those of [`Prescription::builtin`] and [`Prescription::from_file`].
    pub fn named(name: &str) -> Result<Prescription, LensError> {
        let path = Path::new(name);
        if path.extension().is_some() {
            Prescription::from_file(path)
        } else {
            Prescription::builtin(name)
        }
    }
}
