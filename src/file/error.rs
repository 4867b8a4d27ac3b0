//! What goes wrong with a file.

use std::io;
use std::path::{Path, PathBuf};

/// A file that could not be read or written: which one, what was tried, and the system's reason.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot {action}: {cause}", path.display())]
pub struct FileError {
    /// The file's final name.
    pub path: PathBuf,
    /// What was tried: "read", "write", "create the folder".
    pub action: &'static str,
    /// The system's reason.
    #[source]
    pub cause: io::Error,
}

impl FileError {
    /// Ties `cause` to a path and an action.
    pub fn new(path: &Path, action: &'static str, cause: io::Error) -> Self {
        Self {
            path: path.to_path_buf(),
            action,
            cause,
        }
    }
}
