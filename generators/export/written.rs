//! Files of an export, and what was written.

use std::fs;
use std::path::Path;

use quadpixel::file;

use super::error::ExportError;
use super::pictures::Png;

/// What an export did, or a part of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Exported {
    /// Samples of the dataset.
    pub samples: usize,
    /// Files that were written.
    pub files: u64,
    /// Their length.
    pub bytes: u64,
    /// Values above white, stored as white.
    pub clipped: u64,
}

impl Exported {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            files: self.files + other.files,
            bytes: self.bytes + other.bytes,
            clipped: self.clipped + other.clipped,
        }
    }
}

/// Writes a file of the export and its folders.
pub(super) fn put(root: &Path, path: &str, bytes: &[u8]) -> Result<Exported, ExportError> {
    let path = root.join(path);
    if let Some(folder) = path.parent() {
        file::create_folder(folder)?;
    }
    fs::write(&path, bytes).map_err(|e| ExportError::disk(&path, e))?;
    Ok(Exported {
        files: 1,
        bytes: bytes.len() as u64,
        ..Exported::default()
    })
}

/// As [`put`], of a picture.
pub(super) fn put_png(root: &Path, path: &str, png: &Png) -> Result<Exported, ExportError> {
    let clipped = png.clipped;
    Ok(Exported {
        clipped,
        ..put(root, path, &png.bytes)?
    })
}
