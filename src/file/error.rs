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

    /// What stands there is not the program's to replace.
    pub(super) fn of_others(path: &Path) -> Self {
        let what =
            "is there, and is not what this program wrote; move it away, or name another folder";
        Self::new(
            path,
            "write",
            io::Error::new(io::ErrorKind::AlreadyExists, what),
        )
    }

    /// Whether something of others stands in the place, which is the caller's to mend; the system itself says otherwise
    /// that a file exists.
    pub fn is_of_others(&self) -> bool {
        self.cause.kind() == io::ErrorKind::AlreadyExists && self.cause.raw_os_error().is_none()
    }
}
