//! Files written aside and renamed, so that a name never stands for half a file.

use std::fs::File;
use std::io::Write;
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
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn write_aside(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let aside = aside(path);
    write_through(&aside, bytes)
        .and_then(|()| fs::rename(&aside, path))
        .map_err(|cause| {
            // The first error is the one to tell; a leftover that cannot be removed changes nothing about it.
            let _ = fs::remove_file(&aside);
            FileError::new(path, "write", cause)
        })
}

/// Writes a file and waits for the disk, so that a name given to it later never stands for less, even after a loss of
/// power.
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn write_synced(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_through(path, bytes).map_err(|cause| FileError::new(path, "write", cause))
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Gives a finished file or folder its name, and waits for the disk.
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn rename_synced(from: &Path, to: &Path) -> Result<(), FileError> {
    fs::rename(from, to).map_err(|cause| FileError::new(to, "write", cause))?;
    // Where a folder cannot be opened as a file (Windows) or synced, the name is written when the system sees fit.
    if let Some(parent) = to.parent()
        && let Ok(folder) = File::open(parent)
    {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// `NAME.tmp-PID` beside `path`: where a file or folder is made before it gets its name.
pub fn aside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".tmp-{}", std::process::id()));
    path.with_file_name(name)
}

/// Reads a whole file.
///
/// # Errors
/// The file cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(path).map_err(|cause| FileError::new(path, "read", cause))
}

/// Creates a folder and its parents; one that exists already is fine.
///
/// # Errors
/// The folder cannot be made.
pub fn create_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(|cause| FileError::new(path, "create the folder", cause))
}

/// A folder of the program's own below one that exists: created, or there already as a plain folder. A link is refused,
/// for what is written below it would land elsewhere.
///
/// # Errors
/// The folder cannot be made, or what is there is no plain folder.
pub fn own_folder(path: &Path) -> Result<(), FileError> {
    let error = |cause| FileError::new(path, "create the folder", cause);
    match fs::symlink_metadata(path) {
        Ok(data) if data.is_dir() => Ok(()),
        Ok(_) => Err(error(io::Error::new(
            io::ErrorKind::NotADirectory,
            "is there as a link or file; allowed: a plain folder",
        ))),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => {
            fs::create_dir(path).map_err(error)
        }
        Err(cause) => Err(error(cause)),
    }
}

/// Removes a file, folder or link, if there is one; what a link leads to stays.
///
/// # Errors
/// The disk; that nothing is there is no error.
pub fn remove(path: &Path) -> Result<(), FileError> {
    let result = match fs::symlink_metadata(path) {
        Ok(data) if data.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(cause) => Err(cause),
    };
    result.map_err(|cause| FileError::new(path, "remove", cause))
}

/// Writes files of one folder, which is created where it is missing; each is written aside and renamed.
///
/// # Errors
/// The disk, with the file and what was tried.
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
    #[cfg(unix)]
    fn a_link_is_no_folder_of_ours_and_is_removed_without_what_it_leads_to() {
        let folder = tempfile::tempdir().unwrap();
        let (there, link) = (folder.path().join("there"), folder.path().join("link"));
        own_folder(&there).unwrap();
        own_folder(&there).unwrap();
        fs::write(there.join("a"), b"x").unwrap();
        std::os::unix::fs::symlink(&there, &link).unwrap();
        let text = own_folder(&link).unwrap_err().to_string();
        assert!(
            text.contains("link") && text.contains("plain folder"),
            "{text}"
        );
        remove(&link).unwrap();
        remove(&link).unwrap();
        assert!(!link.exists() && there.join("a").exists());
        remove(&there).unwrap();
        assert!(!there.exists());
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
