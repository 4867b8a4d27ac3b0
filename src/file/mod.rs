//! The one door to the disk. Files are written aside and renamed, so that a name never stands for half a file; only
//! plain files are read, and no more of them than a stated size.

mod error;
mod reports;
mod write;

use std::fs::File;
use std::path::Path;
use std::{fs, io};

pub use error::FileError;
pub use reports::{WRITTEN, write_reports};
pub use write::{
    FolderAside, create_folder, probe_file, probe_folder, rename_synced, write_aside, write_synced,
    write_with,
};

/// The largest file that is read whole: 8 GiB.
pub const LARGEST_BYTES: u64 = 8 << 30;

/// Reads a whole file of at most [`LARGEST_BYTES`].
///
/// # Errors
/// The file cannot be read, is no plain file, or is larger.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let failed = |cause| FileError::new(path, "read", cause);
    quadpixel_datasets::file::read(path, LARGEST_BYTES).map_err(failed)
}

/// Opens a plain file to read it: a pipe or device in its place, which may never end, is refused.
///
/// # Errors
/// The file cannot be opened, or is no plain file.
pub fn open(path: &Path) -> Result<File, FileError> {
    let failed = |cause| FileError::new(path, "read", cause);
    quadpixel_datasets::file::open(path).map_err(failed)
}

/// Reads a whole file of text, as [`read`] does.
///
/// # Errors
/// As there, or what is no UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let no_text = |e| FileError::new(path, "read", io::Error::new(io::ErrorKind::InvalidData, e));
    String::from_utf8(read(path)?).map_err(no_text)
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
}
