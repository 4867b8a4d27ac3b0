//! Reading files that others may have made: plain ones only, and no more of them than a stated size.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::memory;

/// Opens a plain file to read it. A pipe or device in its place, which may never end or never begin, is refused by its
/// type, unopened.
///
/// # Errors
/// The system's reason, or what is there instead of a plain file.
pub fn open(path: &Path) -> io::Result<File> {
    // Before it is opened: to open a pipe waits for who writes to it.
    let data = path.metadata()?;
    if data.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder; allowed: a plain file",
        ));
    }
    if !data.is_file() {
        let what = "is a pipe, socket or device; allowed: a plain file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    File::open(path)
}

/// Reads a plain file of at most `largest_bytes`.
///
/// # Errors
/// As [`open`], or its size.
pub fn read(path: &Path, largest_bytes: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let too_large = |bytes: u64| {
        let what = format!("holds {bytes} bytes or more; allowed: at most {largest_bytes}");
        io::Error::new(io::ErrorKind::FileTooLarge, what)
    };
    let length = file.metadata()?.len();
    if length > largest_bytes {
        return Err(too_large(length));
    }
    let no_room = |e| io::Error::new(io::ErrorKind::OutOfMemory, e);
    memory::check("the whole file", length).map_err(no_room)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length as usize).map_err(|_| {
        let what = format!("there is no memory for its {length} bytes");
        io::Error::new(io::ErrorKind::OutOfMemory, what)
    })?;
    // One byte more than allowed: it may grow while it is read.
    file.take(largest_bytes.saturating_add(1))
        .read_to_end(&mut bytes)?;
    match bytes.len() as u64 {
        length if length > largest_bytes => Err(too_large(length)),
        _ => Ok(bytes),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_the_stated_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, [7; 100]).unwrap();
        assert_eq!(read(&path, 100).unwrap(), [7; 100]);
        let text = read(&path, 99).unwrap_err().to_string();
        assert!(
            text.contains("100 bytes") && text.contains("at most 99"),
            "{text}"
        );
        assert!(
            read(folder.path(), 99)
                .unwrap_err()
                .to_string()
                .contains("folder")
        );
    }

    #[test]
    #[cfg(unix)]
    fn a_pipe_and_a_device_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [
            pipe.as_path(),
            Path::new("/dev/zero"),
            Path::new("/dev/null"),
        ] {
            let text = read(path, 1 << 20).unwrap_err().to_string();
            assert!(
                text.contains("pipe, socket or device"),
                "{}: {text}",
                path.display()
            );
        }
    }
}
