//! Files written aside and renamed, so that a name never stands for half a file.

use std::path::{Path, PathBuf};
use std::{fs, io};

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

/// Writes `bytes` to `NAME.tmp-PID` beside `path` and renames it to `path`; on failure (also a full disk) the temporary
/// file is removed and whatever stood at `path` is untouched.
pub fn write_aside(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let aside = aside(path);
    fs::write(&aside, bytes)
        .and_then(|()| fs::rename(&aside, path))
        .map_err(|cause| {
            // The first error is the one to tell; a leftover that cannot be removed changes nothing about it.
            let _ = fs::remove_file(&aside);
            FileError::new(path, "write", cause)
        })
}

/// `NAME.tmp-PID` beside `path`: where a file or folder is made before it gets its name.
pub fn aside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".tmp-{}", std::process::id()));
    path.with_file_name(name)
}

/// Reads a whole file.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(path).map_err(|cause| FileError::new(path, "read", cause))
}

/// Creates a folder and its parents; one that exists already is fine.
pub fn create_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(|cause| FileError::new(path, "create the folder", cause))
}

/// Writes files of one folder, which is created where it is missing; each is written aside and renamed.
pub fn write_folder(folder: &Path, files: &[(impl AsRef<Path>, Vec<u8>)]) -> Result<(), FileError> {
    create_folder(folder)?;
    (files.iter()).try_for_each(|(name, bytes)| write_aside(&folder.join(name), bytes))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn an_unwritable_path_is_named_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("a.png");
        let text = write_aside(&path, b"x").unwrap_err().to_string();
        assert!(text.contains("a.png") && text.contains("write"), "{text}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_keeps_the_old_file_and_is_an_error() {
        // The temporary name leads to /dev/full, which answers every write with "no space left".
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_aside(&path, b"old").unwrap();
        let aside = folder
            .path()
            .join(format!("a.exr.tmp-{}", std::process::id()));
        std::os::unix::fs::symlink("/dev/full", &aside).unwrap();
        let text = write_aside(&path, b"new").unwrap_err().to_string();
        assert!(
            text.contains("a.exr") && text.contains("No space left"),
            "{text}"
        );
        assert_eq!(read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_rewrite_replaces_the_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        write_aside(&path, b"a longer first text").unwrap();
        write_aside(&path, b"short").unwrap();
        assert_eq!(read(&path).unwrap(), b"short");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
