//! Scenes from files: glTF 2.0 (`.gltf`, `.glb`) and Wavefront OBJ with MTL.
//!
//! Frame and unit: the file's own axes (right-handed, y up in glTF) in **mm**. glTF's unit is the metre; OBJ has none,
//! so the caller says how long its unit is. A glTF camera looks along its −z with y up, which is the camera frame
//! of [`crate::frames`]: [`placed`] with the inverse of a camera's place brings a world before the lens.
//!
//! Nothing is fetched from a network, and files are read from the folder of the scene only. A file that makes no sense
//! is an [`ImportError`] that names it and the place; what can be left out without harm (a missing picture, a triangle
//! without area, an index out of range) is left out and counted in [`Warnings`].

mod accessor;
mod container;
mod folder;
mod gltf;
mod gltf_light;
mod gltf_material;
mod imported;
mod json;
mod obj;
mod obj_scene;
mod panorama;
mod picture;
mod placing;
mod primitive;
mod raw;
mod skin;

use std::path::Path;

use folder::{Folder, read_limited};

pub use imported::{FileCamera, ImportError, Imported, MAX_FILE_BYTES, MAX_TRIANGLES, Warnings};
pub use panorama::read_panorama;
pub use placing::{bounds_mm, placed};

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
