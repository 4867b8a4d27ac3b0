//! The folder that a run writes to. `run.json` in it says what was asked for, from the first moment until the dataset
//! is whole, and is locked while the run lasts: nobody else writes there, and nothing of another configuration gets in.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel::shard::{Shard, ShardError};
use quadpixel_datasets::{DatasetManifest, SCHEMA_VERSION, paths};
use serde::{Deserialize, Serialize};

use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;

/// The content of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    schema_version: u32,
    version: String,
    configuration: serde_json::Value,
    inputs: BTreeMap<String, String>,
    /// `i/n`; absent: all of the dataset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shard: Option<String>,
}

impl Record {
    fn new(identity: &Identity, shard: Shard) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            version: identity.version.clone(),
            configuration: identity.configuration.clone(),
            inputs: identity.inputs.clone(),
            shard: (!shard.is_whole()).then(|| shard.to_string()),
        }
    }

    fn identity(self) -> Identity {
        Identity {
            version: self.version,
            configuration: self.configuration,
            inputs: self.inputs,
        }
    }
}

/// A folder that this process alone writes to.
#[derive(Debug)]
pub struct RunFolder {
    folder: PathBuf,
    /// The locked `run.json`.
    lock: File,
}

impl RunFolder {
    /// Creates the folder, or takes up the run in it.
    ///
    /// # Errors
    /// Another identity (2), shown by its differences; another process that writes there, or the disk (1).
    pub fn open(folder: &Path, identity: &Identity, shard: Shard) -> Result<Self, FolderError> {
        if let Some(there) = identity_in(folder)? {
            refuse_other(folder, &there, identity)?;
        }
        file::create_folder(folder)?;
        let path = folder.join(paths::RUN);
        let record = Record::new(identity, shard);
        let text = serde_json::to_vec_pretty(&record)?;
        if path.symlink_metadata().is_err() {
            file::write_aside(&path, &text)?;
        }
        let mut lock = locked(&path)?;
        // A dataset that grows.
        if read(&path)? != record {
            file::write_aside(&path, &text)?;
            lock = locked(&path)?;
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            lock,
        })
    }

    /// Takes up what is there, for a merge.
    ///
    /// # Errors
    /// There is nothing (2), or another process writes to it (1).
    pub fn existing(folder: &Path) -> Result<(Self, Identity, Shard), FolderError> {
        let path = folder.join(paths::RUN);
        if !path.is_file() {
            let what = "holds no shard; allowed: a folder of qpgen dataset --shard";
            return Err(FolderError::refused(folder.display(), what));
        }
        let lock = locked(&path)?;
        let record = read(&path)?;
        let shard = record.shard.as_deref().map(str::parse).transpose();
        let shard = shard.map_err(|e: ShardError| FolderError::refused(path.display(), e))?;
        if shard.is_some_and(|shard: Shard| shard.count() > paths::MAX_SAMPLES as usize) {
            let what = format!(
                "more shards than a dataset has samples; allowed: up to {}",
                paths::MAX_SAMPLES
            );
            return Err(FolderError::refused(path.display(), what));
        }
        let folder = folder.to_path_buf();
        Ok((
            Self { folder, lock },
            record.identity(),
            shard.unwrap_or(Shard::WHOLE),
        ))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Is it still the folder that was opened? A mount that went away would leave an empty folder under the same name.
    ///
    /// # Errors
    /// It is not (1).
    pub fn still_there(&self) -> Result<(), FolderError> {
        if same_file(&self.lock, &self.folder.join(paths::RUN)) {
            return Ok(());
        }
        Err(FolderError::Gone {
            folder: self.folder.clone(),
        })
    }

    /// The dataset is whole.
    ///
    /// # Errors
    /// The disk.
    pub fn end(self) -> Result<(), FolderError> {
        Ok(file::remove(&self.folder.join(paths::RUN))?)
    }
}

/// What the run in a folder was asked for, or what its dataset was made of; `None` if neither is there.
///
/// # Errors
/// A file that is damaged or of another version (2).
pub fn identity_in(folder: &Path) -> Result<Option<Identity>, FolderError> {
    let path = folder.join(paths::RUN);
    if path.is_file() {
        return Ok(Some(read(&path)?.identity()));
    }
    let path = folder.join(paths::DATASET);
    if !path.is_file() {
        return Ok(None);
    }
    let manifest: DatasetManifest = parsed(&path)?;
    Ok(Some(Identity {
        version: manifest.tool.version,
        configuration: manifest.configuration,
        inputs: manifest.inputs,
    }))
}

/// Refuses to mix `wanted` with what is `there` in a folder. One that holds no sample yet (of a run that a faulty
/// configuration ended, say) has nothing to mix with.
///
/// # Errors
/// They differ (2).
pub fn refuse_other(folder: &Path, there: &Identity, wanted: &Identity) -> Result<(), FolderError> {
    let differences = there.differences(wanted);
    let samples = std::fs::read_dir(folder.join(paths::SAMPLES));
    let any = samples.is_ok_and(|mut entries| entries.next().is_some());
    if differences.is_empty() || !(any || folder.join(paths::DATASET).exists()) {
        return Ok(());
    }
    let what = format!(
        "holds a dataset of another configuration; allowed: the same, or another folder\n  {}",
        differences.join("\n  ")
    );
    Err(FolderError::refused(folder.display(), what))
}

fn read(path: &Path) -> Result<Record, FolderError> {
    parsed(path)
}

fn parsed<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, FolderError> {
    let bytes = file::read(path)?;
    serde_json::from_slice(&bytes).map_err(|e| {
        let what = format!(
            "is not of this version of qpgen, or is damaged ({e}); allowed: another folder"
        );
        FolderError::refused(path.display(), what)
    })
}

fn locked(path: &Path) -> Result<File, FolderError> {
    let plain = path.symlink_metadata().is_ok_and(|data| data.is_file());
    if !plain {
        let what = "is a link or folder; allowed: a file of qpgen";
        return Err(FolderError::refused(path.display(), what));
    }
    let open = OpenOptions::new().read(true).append(true).open(path);
    let file = open.map_err(|cause| FileError::new(path, "write", cause))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(FolderError::Busy {
            path: path.to_owned(),
        }),
        // A file system without locks: the user sees to it that only one run writes.
        Err(TryLockError::Error(_)) => Ok(file),
    }
}

#[cfg(unix)]
fn same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), path.metadata()) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn same_file(_: &File, path: &Path) -> bool {
    path.is_file()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn identity(seed: u64) -> Identity {
        Identity {
            version: "0".into(),
            configuration: serde_json::json!({ "count": 3, "seed": seed }),
            inputs: BTreeMap::new(),
        }
    }

    #[test]
    fn a_folder_has_one_writer_and_one_identity() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let run = RunFolder::open(&out, &identity(1), Shard::WHOLE).unwrap();
        let second = RunFolder::open(&out, &identity(1), Shard::WHOLE).unwrap_err();
        assert!(!second.is_input(), "{second}");
        drop(run);
        // Nothing is there yet that another configuration would mix with.
        drop(RunFolder::open(&out, &identity(3), Shard::WHOLE).unwrap());
        drop(RunFolder::open(&out, &identity(1), Shard::WHOLE).unwrap());
        std::fs::create_dir_all(out.join("samples/000000")).unwrap();
        let other = RunFolder::open(&out, &identity(2), Shard::WHOLE).unwrap_err();
        let text = other.to_string();
        assert!(text.contains("seed: 1 there, 2 asked for"), "{text}");
        assert!(other.is_input());
        RunFolder::open(&out, &identity(1), Shard::WHOLE)
            .unwrap()
            .end()
            .unwrap();
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn a_folder_that_was_moved_away_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let run = RunFolder::open(&out, &identity(1), Shard::WHOLE).unwrap();
        run.still_there().unwrap();
        std::fs::rename(&out, folder.path().join("elsewhere")).unwrap();
        std::fs::create_dir(&out).unwrap();
        assert!(!run.still_there().unwrap_err().is_input());
        std::fs::write(out.join("run.json"), b"{}").unwrap();
        assert!(run.still_there().is_err());
    }

    #[test]
    fn a_damaged_record_is_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("run.json"), b"{\"seed\":").unwrap();
        let error = RunFolder::open(folder.path(), &identity(1), Shard::WHOLE).unwrap_err();
        assert!(error.to_string().contains("run.json"), "{error}");
    }
}
