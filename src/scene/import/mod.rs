//! Scenes from files: glTF 2.0 (`.gltf`, `.glb`) and Wavefront OBJ with MTL.
//!
//! Frame and unit: the file's own axes (right-handed, y up in glTF) in **mm**. glTF's unit is the metre; OBJ has none, so the
//! caller says how long its unit is. A glTF camera looks along its −z with y up, which is the camera frame of [`crate::frames`]:
//! [`placed`] with the inverse of a camera's place brings a world before the lens.
//!
//! Nothing is fetched from a network, and files are read from the folder of the scene only. A file that makes no sense is an
//! [`ImportError`] that names it and the place; what can be left out without harm (a missing picture, a triangle without
//! area, an index out of range) is left out and counted in [`Warnings`].

mod accessor;
mod container;
mod folder;
mod gltf;
mod gltf_light;
mod gltf_material;
mod json;
mod obj;
mod obj_scene;
mod panorama;
mod picture;
mod placing;
mod primitive;
mod raw;
mod skin;

use std::collections::BTreeMap;
use std::path::Path;

use glam::DAffine3;

use crate::file::FileError;
use crate::scene::world::WorldDescription;
use folder::{Folder, read_limited};

pub use panorama::read_panorama;
pub use placing::{bounds_mm, placed};

/// Largest file that is read, bytes (1 GiB); a larger one is refused before it is.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// Most triangles of one import, over all meshes.
pub const MAX_TRIANGLES: usize = 50_000_000;
/// Most placed meshes of one import.
const MAX_INSTANCES: usize = 1_000_000;

/// A world read from a file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The world in the file's axes, mm.
    pub world: WorldDescription,
    /// Cameras of the file, in the order of its nodes.
    pub cameras: Vec<FileCamera>,
    /// What was left out.
    pub warnings: Warnings,
}

/// A camera of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileCamera {
    /// Its node's name, or its number.
    pub name: String,
    /// Its place (mm, without scale): it looks along its −z, y is up.
    pub file_from_camera: DAffine3,
    /// Vertical angle of view, deg, where the file says so. The lens and sensor set the real one.
    pub vertical_deg: Option<f64>,
}

/// Things left out, and how often.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings(BTreeMap<String, u64>);

/// Why a scene cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// Refused before it was read.
    #[error("{file}: has {bytes} bytes; allowed: up to {limit}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size.
        bytes: u64,
        /// Largest size.
        limit: u64,
    },
    /// Not what it says it is.
    #[error("{file}: {place}: {what}")]
    Broken {
        /// The file.
        file: String,
        /// Field or line.
        place: String,
        /// What is wrong, and what is allowed.
        what: String,
    },
}

impl Warnings {
    /// Adds `times` to a warning; 0 adds nothing.
    pub(super) fn count(&mut self, what: impl Into<String>, times: u64) {
        if times > 0 {
            *self.0.entry(what.into()).or_default() += times;
        }
    }

    /// Each kind and its count, in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, u64)> {
        self.0.iter().map(|(what, &n)| (what.as_str(), n))
    }
}

impl std::fmt::Display for Warnings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, (what, n)) in self.iter().enumerate() {
            let part = if i > 0 { "; " } else { "" };
            write!(f, "{part}{n}× {what}")?;
        }
        Ok(())
    }
}

/// Reads a scene by its extension: `.gltf`, `.glb` or `.obj`. `unit_mm` is the length of the file's unit; `None`: 1000
/// (glTF's metre, and the most common of OBJ).
///
/// # Errors
/// See [`ImportError`].
pub fn import(path: &Path, unit_mm: Option<f64>) -> Result<Imported, ImportError> {
    let name = path.display().to_string();
    let kind = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    if !["gltf", "glb", "obj"].contains(&kind.as_str()) {
        return Err(ImportError::Broken {
            file: name,
            place: "extension".into(),
            what: format!("is `{kind}`; allowed: gltf, glb, obj"),
        });
    }
    let bytes = read_limited(path)?;
    from_bytes(&bytes, kind == "obj", &name, &Folder::of(path), unit_mm)
}

/// Reads a scene from memory, which may refer to no other file; `name` stands in errors.
///
/// # Errors
/// See [`ImportError`].
pub fn import_bytes(bytes: &[u8], is_obj: bool, name: &str) -> Result<Imported, ImportError> {
    from_bytes(bytes, is_obj, name, &Folder::default(), None)
}

fn from_bytes(
    bytes: &[u8],
    is_obj: bool,
    name: &str,
    folder: &Folder,
    unit_mm: Option<f64>,
) -> Result<Imported, ImportError> {
    let unit_mm = unit_mm.unwrap_or(1000.0);
    let read = if !(unit_mm > 0.0 && unit_mm.is_finite()) {
        Err((
            "unit_mm".to_string(),
            format!("is {unit_mm}; allowed: a positive length"),
        ))
    } else if is_obj {
        obj_scene::read(bytes, folder, unit_mm)
    } else {
        gltf::read(bytes, folder, unit_mm)
    };
    read.map_err(|(place, what)| ImportError::Broken {
        file: name.to_string(),
        place,
        what,
    })
}
