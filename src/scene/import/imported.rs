//! What an import gives: a world, cameras, what was left out, or why there is none; and the limits of what is read.

use std::collections::BTreeMap;

use glam::DAffine3;

use crate::file::FileError;
use crate::memory::MemoryError;
use crate::scene::world::WorldDescription;

/// Largest file that is read, bytes (1 GiB); a larger one is refused before it is.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// Most triangles of one import, over all meshes.
pub const MAX_TRIANGLES: usize = 50_000_000;
/// Most placed meshes of one import.
pub(super) const MAX_INSTANCES: usize = 1_000_000;

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

/// Place in the file, and what is wrong there.
pub(super) type Broken = (String, String);

/// Why a scene cannot be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// It does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
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
    pub(in crate::scene) fn count(&mut self, what: impl Into<String>, times: u64) {
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
