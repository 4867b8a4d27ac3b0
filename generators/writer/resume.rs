//! What an earlier run left of a sample.

use std::fs;
use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError, FolderAside};
use quadpixel_datasets::{ParseError, SampleMeta, paths};

use super::error::WriteError;
use super::half_made_prefix;
use super::json::VERSION;

/// What is under a sample's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EarlierSample {
    /// Nothing.
    Nothing,
    /// The whole sample.
    Whole,
    /// Something that is not whole, in words: a disk or a person damaged it, for this program gives the name last. It
    /// was taken away.
    Broken(String),
}

/// Looks for a sample of an earlier run with the same configuration. Lengths are compared, not hashes: to go on with
/// many samples must not read them all; `qpgen check` does.
///
/// # Errors
/// It is of another configuration or version, or cannot be read or taken away.
pub fn earlier_sample(
    root: &Path,
    index: u32,
    configuration_blake3: &str,
) -> Result<EarlierSample, WriteError> {
    let name = paths::sample_name(index)?;
    let samples = root.join(paths::SAMPLES);
    let folder = samples.join(&name);
    let Ok(data) = folder.symlink_metadata() else {
        return Ok(EarlierSample::Nothing);
    };
    if !data.is_dir() {
        return Err(WriteError::Occupied {
            path: folder,
            what: "is a link or file; allowed: a sample's folder".into(),
        });
    }
    let broken = match whole(&folder) {
        Ok(meta)
            if meta.configuration_blake3 == configuration_blake3
                && meta.tool_version == VERSION =>
        {
            return Ok(EarlierSample::Whole);
        }
        Ok(_) => {
            return Err(WriteError::Occupied {
                path: folder,
                what: "holds a sample of another configuration or version: choose another output folder".into(),
            });
        }
        Err(NotWhole::OfAnotherRelease(error)) => {
            return Err(WriteError::Occupied {
                path: folder,
                what: error.to_string(),
            });
        }
        Err(NotWhole::Damaged(what)) => what,
    };
    if let Some(path) = foreign_file(&folder)? {
        let what = "is not what qpgen writes into a sample, which is damaged and would be made again: move it away";
        return Err(WriteError::Occupied {
            path,
            what: what.into(),
        });
    }
    let aside = FolderAside::new(&folder, half_made_prefix(&name))?;
    // A folder without a file takes no other's place.
    file::rename_synced(&folder, aside.path())?;
    file::remove(aside.path())?;
    Ok(EarlierSample::Broken(broken))
}

/// Whether a sample of the same configuration is there, as [`earlier_sample`] says; nothing is taken away.
pub fn is_whole_sample(root: &Path, name: &str, configuration_blake3: &str) -> bool {
    let folder = root.join(paths::SAMPLES).join(name);
    let plain = folder.symlink_metadata().is_ok_and(|data| data.is_dir());
    let same = |meta: SampleMeta| {
        meta.configuration_blake3 == configuration_blake3 && meta.tool_version == VERSION
    };
    plain && whole(&folder).is_ok_and(same)
}

/// Something in the folder of a sample that no sample has.
fn foreign_file(folder: &Path) -> Result<Option<PathBuf>, WriteError> {
    let failed = |cause| FileError::new(folder, "read", cause);
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let ours = (entry.file_name().to_str()).is_some_and(quadpixel_datasets::is_sample_file);
        if !ours || entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            return Ok(Some(entry.path()));
        }
    }
    Ok(None)
}

/// Why a folder is no whole sample.
enum NotWhole {
    /// Another release made it: not ours to take away.
    OfAnotherRelease(ParseError),
    /// A disk or a person damaged it, in words.
    Damaged(String),
}

/// The description, if all files that it names are there at their lengths; else what is wrong.
fn whole(folder: &Path) -> Result<SampleMeta, NotWhole> {
    let damaged = |what: String| NotWhole::Damaged(what);
    let path = folder.join(paths::META);
    let bytes = file::read(&path).map_err(|e| damaged(e.to_string()))?;
    let meta: SampleMeta =
        quadpixel_datasets::read_description(&bytes).map_err(|error| match error {
            ParseError::Earlier(_) | ParseError::Later(_) => NotWhole::OfAnotherRelease(error),
            _ => damaged(format!("{}: {error}", paths::META)),
        })?;
    for own in &meta.contents {
        let name = paths::checked_name(&own.path).map_err(|e| damaged(e.to_string()))?;
        let length = folder.join(name).symlink_metadata().map(|data| data.len());
        match length {
            Ok(length) if length == own.bytes => {}
            Ok(length) => {
                let what = format!("{name} has {length} bytes, not {}", own.bytes);
                return Err(damaged(what));
            }
            Err(e) => return Err(damaged(format!("{name}: {e}"))),
        }
    }
    Ok(meta)
}
