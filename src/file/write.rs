//! Writing: a file or folder is made under a name that nobody can foresee, beside the one that it gets when it is
//! whole.
//! What is no plain file (`/dev/stdout`, `/dev/null`, a named pipe) is written to where it is, and stays what it is.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile, TempDir};

use super::error::FileError;

/// Creates a folder and its parents; one that exists already is fine.
///
/// # Errors
/// The folder cannot be made.
pub fn create_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(|cause| FileError::new(path, "create the folder", cause))
}

/// Writes `bytes` beside `path` and renames them to it; on failure (also a full disk) whatever stood at `path` is
/// untouched, and nothing else is left. A link is followed; a device or pipe is written to in place.
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn write_aside(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let failed = |cause| FileError::new(path, "write", cause);
    write_with(path, |file| file.write_all(bytes).map_err(failed))
}

/// As [`write_aside`], of what `write` writes.
///
/// # Errors
/// As there, or that of `write`.
pub fn write_with<E: From<FileError>>(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let failed = |cause| FileError::new(path, "write", cause);
    match target(path).map_err(failed)? {
        Target::InPlace => {
            let mut file = OpenOptions::new().append(true).open(path).map_err(failed)?;
            write(&mut file)
        }
        Target::File(path) => {
            let mut aside = file_aside(&path).map_err(failed)?;
            write(aside.as_file_mut())?;
            aside.as_file().sync_all().map_err(failed)?;
            aside.persist(&path).map_err(|e| failed(e.error))?;
            Ok(())
        }
    }
}

/// Whether a file could be written under this name: found out before long work, not after it. Nothing is left.
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn probe_file(path: &Path) -> Result<(), FileError> {
    let failed = |cause| FileError::new(path, "write", cause);
    match target(path).map_err(failed)? {
        Target::InPlace => Ok(()),
        Target::File(path) => file_aside(&path).map(drop).map_err(failed),
    }
}

/// Whether files could be written into this folder, which is made if it is not there.
///
/// # Errors
/// The disk, with the folder and what was tried.
pub fn probe_folder(folder: &Path) -> Result<(), FileError> {
    create_folder(folder)?;
    let failed = |cause| FileError::new(folder, "write to the folder", cause);
    tempfile::tempfile_in(folder).map(drop).map_err(failed)
}

/// Writes a new file and waits for the disk, so that a name given to its folder later never stands for less, even after
/// a loss of power.
///
/// # Errors
/// The disk, with the file and what was tried; something of that name that is there.
pub fn write_synced(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let write = || {
        let mut file = File::create_new(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    };
    write().map_err(|cause| FileError::new(path, "write", cause))
}

/// Gives a finished file or folder its name, and waits for the disk.
///
/// # Errors
/// The disk, with the file and what was tried.
pub fn rename_synced(from: &Path, to: &Path) -> Result<(), FileError> {
    fs::rename(from, to).map_err(|cause| FileError::new(to, "write", cause))?;
    // Where a folder cannot be opened as a file (Windows) or synced, the name is written when the system sees fit.
    if let Ok(folder) = File::open(parent(to)) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// A folder that is made beside the name it will get; dropped before that, it is gone.
#[derive(Debug)]
pub struct FolderAside {
    aside: TempDir,
}

impl FolderAside {
    /// A new folder beside `path`, under a name of its own that begins with `prefix`.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn new(path: &Path, prefix: impl Into<OsString>) -> Result<Self, FileError> {
        let prefix = prefix.into();
        let mut builder = Builder::new();
        builder.prefix(&prefix);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        create_folder(parent(path))?;
        let aside = builder.tempdir_in(parent(path));
        let failed = |cause| FileError::new(path, "create the folder", cause);
        Ok(Self {
            aside: aside.map_err(failed)?,
        })
    }

    /// Where it is made.
    pub fn path(&self) -> &Path {
        self.aside.path()
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// The disk, or something of that name.
    pub fn persist(self, to: &Path) -> Result<(), FileError> {
        rename_synced(self.path(), to)?;
        // It is not where it was made any more.
        let _ = self.aside.keep();
        Ok(())
    }
}

/// Where what is written under a name goes.
enum Target {
    /// To a file that is replaced, or made.
    File(PathBuf),
    /// To what is there: a device or a pipe.
    InPlace,
}

fn target(path: &Path) -> io::Result<Target> {
    let refused = |what| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    let is_link = match path.symlink_metadata() {
        Ok(data) => data.is_symlink(),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => {
            return Ok(Target::File(path.to_owned()));
        }
        Err(cause) => return Err(cause),
    };
    let Ok(data) = path.metadata() else {
        return refused("is a link that leads nowhere; allowed: a file");
    };
    if data.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder; allowed: a file",
        ));
    }
    // Names of the system, such as /dev/stdout, stay what they are, whatever is behind them.
    let of_system = ["/dev", "/proc"].iter().any(|root| path.starts_with(root));
    match data.is_file() {
        true if of_system => Ok(Target::InPlace),
        true if is_link => Ok(Target::File(path.canonicalize()?)),
        true => Ok(Target::File(path.to_owned())),
        false if is_disk_or_socket(&data) => refused("is a disk or socket; allowed: a file"),
        false => Ok(Target::InPlace),
    }
}

#[cfg(unix)]
fn is_disk_or_socket(data: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    data.file_type().is_block_device() || data.file_type().is_socket()
}

#[cfg(not(unix))]
fn is_disk_or_socket(_: &fs::Metadata) -> bool {
    false
}

/// A new file beside `path`, with the rights that any new file gets.
fn file_aside(path: &Path) -> io::Result<NamedTempFile> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".tmp-");
    let mut builder = Builder::new();
    builder.prefix(&name);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(parent(path))
}

/// The folder that a name stands in.
fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::super::read;
    use super::*;

    #[test]
    fn an_unwritable_path_is_named_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("a.png");
        // But for the temporary name, which is another each time.
        let said = |error: FileError| error.to_string().split(" at path").next().map(String::from);
        let text = said(write_aside(&path, b"x").unwrap_err()).unwrap();
        assert!(text.contains("a.png") && text.contains("write"), "{text}");
        assert_eq!(said(probe_file(&path).unwrap_err()).unwrap(), text);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_keeps_the_old_file_and_is_an_error() {
        // /dev/full answers every write with "no space left".
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_aside(&path, b"old").unwrap();
        let full = |file: &mut File| {
            file.write_all(b"half").unwrap();
            let full = OpenOptions::new().write(true).open("/dev/full");
            let cause = full.and_then(|mut full| full.write_all(b"new"));
            cause.map_err(|cause| FileError::new(&path, "write", cause))
        };
        let text = write_with(&path, full).unwrap_err().to_string();
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
        probe_file(&path).unwrap();
        assert_eq!(read(&path).unwrap(), b"short");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn a_device_and_a_pipe_stay_what_they_are_and_a_link_is_followed() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let [null, pipe, link, file] =
            ["null", "pipe", "link", "file"].map(|n| folder.path().join(n));
        symlink("/dev/null", &null).unwrap();
        write_aside(&null, b"x").unwrap();
        assert_eq!(fs::read_link(&null).unwrap(), Path::new("/dev/null"));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        write_aside(&pipe, b"through").unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        assert!(!pipe.symlink_metadata().unwrap().is_file());
        fs::write(&file, b"old").unwrap();
        symlink(&file, &link).unwrap();
        write_aside(&link, b"new").unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(read(&file).unwrap(), b"new");
    }

    #[test]
    fn a_folder_aside_is_gone_when_it_got_no_name() {
        let folder = tempfile::tempdir().unwrap();
        let to = folder.path().join("a");
        let aside = FolderAside::new(&to, "a.tmp-").unwrap();
        write_synced(&aside.path().join("x"), b"x").unwrap();
        assert!(write_synced(&aside.path().join("x"), b"y").is_err());
        drop(aside);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        let aside = FolderAside::new(&to, "a.tmp-").unwrap();
        write_synced(&aside.path().join("x"), b"x").unwrap();
        aside.persist(&to).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_eq!(read(&to.join("x")).unwrap(), b"x");
    }
}
