//! Reports: files under names of the program's choosing, in a folder of the caller's choosing. A list beside them says
//! by name and hash which are the program's; only those are replaced.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use super::error::FileError;
use super::{create_folder, read, write_aside};

/// The list: of each file the hashes of what the program wrote there last, and before.
pub const WRITTEN: &str = "written.json";

type Written = BTreeMap<String, Vec<String>>;

/// Writes files into a folder, which is created where it is missing; each is written aside and renamed. What stands
/// under one of these names stays, and nothing is written, unless [`WRITTEN`] says that it is the program's own.
///
/// # Errors
/// The disk, with the file and what was tried; a file of others ([`FileError::is_of_others`]).
pub fn write_reports(
    folder: &Path,
    files: &[(impl AsRef<Path>, Vec<u8>)],
) -> Result<(), FileError> {
    create_folder(folder)?;
    let list = folder.join(WRITTEN);
    let mut written: Written = match there(&list)? {
        None => Written::new(),
        Some(bytes) => serde_json::from_slice(&bytes).map_err(|_| FileError::of_others(&list))?,
    };
    for (name, bytes) in files {
        let path = folder.join(name);
        let mut hashes = vec![hash(bytes)];
        if let Some(before) = there(&path)? {
            let before = hash(&before);
            let known = written.get(&key(name));
            if before != hashes[0] {
                if !known.is_some_and(|known| known.contains(&before)) {
                    return Err(FileError::of_others(&path));
                }
                hashes.push(before);
            }
        }
        written.insert(key(name), hashes);
    }
    // First: after a kill, what was and what is to be are both known as the program's.
    let text = serde_json::to_vec_pretty(&written);
    let text = text.map_err(|cause| FileError::new(&list, "write", io::Error::other(cause)))?;
    write_aside(&list, &text)?;
    (files.iter()).try_for_each(|(name, bytes)| write_aside(&folder.join(name), bytes))
}

fn key(name: impl AsRef<Path>) -> String {
    name.as_ref().to_string_lossy().into_owned()
}

fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// What stands under a name. What is no plain file is somebody's.
fn there(path: &Path) -> Result<Option<Vec<u8>>, FileError> {
    match fs::symlink_metadata(path) {
        Ok(data) if data.is_file() => read(path).map(Some),
        Ok(_) => Err(FileError::of_others(path)),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(cause) => Err(FileError::new(path, "read", cause)),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_replaced_and_what_others_wrote_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let write =
            |a: &str, b: &str| write_reports(&out, &[("a.csv", a.into()), ("b.csv", b.into())]);
        let is = |name: &str, text: &str| fs::read(out.join(name)).unwrap() == text.as_bytes();
        write("1", "1").unwrap();
        write("2", "1").unwrap();
        write("3", "3").unwrap();
        assert!(is("a.csv", "3") && is("b.csv", "3"));
        // Another's, beside others of ours: nothing is written.
        fs::write(out.join("b.csv"), "mine").unwrap();
        let error = write("4", "4").unwrap_err();
        assert!(
            error.is_of_others() && error.to_string().contains("b.csv"),
            "{error}"
        );
        assert!(is("a.csv", "3") && is("b.csv", "mine"));
        // As after a kill between two files: one new, one old, both known.
        fs::write(out.join("b.csv"), "3").unwrap();
        fs::write(out.join("a.csv"), "1").unwrap();
        assert!(
            write("5", "5").unwrap_err().is_of_others(),
            "1 was replaced two writes ago"
        );
        fs::write(out.join("a.csv"), "3").unwrap();
        write("5", "5").unwrap();
        // What is the same needs no list.
        fs::remove_file(out.join(WRITTEN)).unwrap();
        write("5", "5").unwrap();
        fs::write(out.join(WRITTEN), "my notes").unwrap();
        assert!(write("5", "5").unwrap_err().is_of_others());
    }

    #[test]
    #[cfg(unix)]
    fn a_link_or_folder_under_a_name_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [a, link, sub] = ["a", "link", "sub"].map(|name| folder.path().join(name));
        fs::write(&a, "mine").unwrap();
        std::os::unix::fs::symlink(&a, &link).unwrap();
        fs::create_dir(&sub).unwrap();
        for name in ["link", "sub"] {
            let error = write_reports(folder.path(), &[(name, b"x".to_vec())]).unwrap_err();
            assert!(error.is_of_others(), "{error}");
        }
        assert_eq!(fs::read(&a).unwrap(), b"mine");
    }
}
