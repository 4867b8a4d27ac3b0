//! Files of an export, and what was written.

use std::fs;
use std::path::Path;

use quadpixel::file;

use super::error::ExportError;

/// What was written of some samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Written {
    pub files: u64,
    pub bytes: u64,
    /// Values above white, stored as white.
    pub clipped: u64,
}

impl Written {
    pub fn plus(self, other: Self) -> Self {
        Self {
            files: self.files + other.files,
            bytes: self.bytes + other.bytes,
            clipped: self.clipped + other.clipped,
        }
    }
}

/// Writes a file of the export and its folders.
pub(super) fn put(root: &Path, path: &str, bytes: &[u8]) -> Result<Written, ExportError> {
    let path = root.join(path);
    if let Some(folder) = path.parent() {
        file::create_folder(folder)?;
    }
    fs::write(&path, bytes).map_err(|e| ExportError::disk(&path, e))?;
    Ok(Written {
        files: 1,
        bytes: bytes.len() as u64,
        clipped: 0,
    })
}
