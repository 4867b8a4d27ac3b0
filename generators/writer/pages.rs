//! Gallery, data card, plots and split lists in the folder of a dataset: only what this program wrote there is replaced
//! or removed, and a dataset that is whole stays so at every instant.
//!
//! What we wrote is what `dataset.json` lists, by path and hash. Pages that no manifest lists yet (of a run that is not
//! at its end, or between their writing and that of the manifest) are listed in `pages.json` before the first of them
//! is written; it goes when the manifest says it all. A reader takes a page by either hash.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel_datasets::{DatasetManifest, FileEntry, paths};

use super::error::WriteError;
use super::json::json;

/// What to do with files of others in the places of ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// They stay, and the command ends.
    Refuse,
    /// They are replaced or removed: the user said so.
    Replace,
}

/// The pages of a folder, which one process at a time writes.
#[derive(Debug)]
pub struct Pages {
    root: PathBuf,
    foreign: Foreign,
    /// Those that this program wrote, by path and hash.
    own: Vec<FileEntry>,
    /// Held until it is dropped; `None` where the system does not lock folders.
    _lock: Option<File>,
}

impl Pages {
    /// Opens them, waiting while another process writes pages there.
    ///
    /// # Errors
    /// A list of files that cannot be read.
    pub fn open(root: &Path, foreign: Foreign) -> Result<Self, WriteError> {
        let lock = File::open(root).ok().filter(|folder| folder.lock().is_ok());
        let mut own = Vec::new();
        if let Some(manifest) = read::<DatasetManifest>(&root.join(paths::DATASET))? {
            let pages = manifest.files.into_iter();
            own.extend(pages.filter(|entry| !entry.path.starts_with(paths::SAMPLES)));
        }
        own.extend(
            read::<Vec<FileEntry>>(&root.join(paths::PAGES))?
                .into_iter()
                .flatten(),
        );
        Ok(Self {
            root: root.to_owned(),
            foreign,
            own,
            _lock: lock,
        })
    }

    /// Refuses a file that is not ours where a page may go, before anything is done.
    ///
    /// # Errors
    /// What is there.
    pub fn check(&self) -> Result<(), WriteError> {
        for name in [paths::INDEX, paths::CARD] {
            self.check_one(name, None)?;
        }
        for folder in [paths::PLOTS, paths::SPLITS] {
            for name in self.in_folder(folder)? {
                self.check_one(&name, None)?;
            }
        }
        Ok(())
    }

    /// Writes pages (path and content); a page that has its content already is left alone. Call [`Self::end`] once a
    /// manifest lists them.
    ///
    /// # Errors
    /// A file of somebody else in the place of one, and the disk.
    pub fn write(&mut self, pages: &[(String, Vec<u8>)]) -> Result<Vec<FileEntry>, WriteError> {
        let entries: Vec<FileEntry> = (pages.iter())
            .map(|(path, bytes)| FileEntry::new(path, bytes))
            .collect();
        let mut changed = Vec::new();
        for ((path, bytes), entry) in pages.iter().zip(&entries) {
            if self.hash_of(path)?.as_deref() != Some(entry.blake3.as_str()) {
                self.check_one(path, Some(&entry.blake3))?;
                changed.push((path, bytes));
            }
        }
        for entry in &entries {
            if !self.own.contains(entry) {
                self.own.push(entry.clone());
            }
        }
        if changed.is_empty() {
            return Ok(entries);
        }
        self.record()?;
        for (path, bytes) in changed {
            let place = self.root.join(path);
            if let Some((folder, _)) = path.split_once('/') {
                self.own_folder(folder)?;
            }
            if !place.symlink_metadata().is_ok_and(|data| data.is_file()) {
                file::remove(&place)?; // a link or folder, which was allowed
            }
            file::write_aside(&place, bytes)?;
        }
        Ok(entries)
    }

    /// The manifest is written: what it lists not any more goes, and so do half-made files.
    ///
    /// # Errors
    /// A file of somebody else among them, and the disk.
    pub fn end(self, manifest: &DatasetManifest) -> Result<(), WriteError> {
        self.clear(manifest)?;
        Ok(file::remove(&self.root.join(paths::PAGES))?)
    }

    fn clear(&self, manifest: &DatasetManifest) -> Result<(), WriteError> {
        let listed: BTreeSet<&str> = manifest.files.iter().map(|e| e.path.as_str()).collect();
        for folder in [paths::PLOTS, paths::SPLITS] {
            for name in self.in_folder(folder)? {
                if !listed.contains(name.as_str()) {
                    self.check_one(&name, None)?;
                    file::remove(&self.root.join(&name))?;
                }
            }
        }
        Ok(())
    }

    /// Removes what a killed process was about to name; `also` are names in the folder itself beside those of pages.
    ///
    /// # Errors
    /// The disk.
    pub fn clear_half_made(&self, also: &[&str]) -> Result<(), WriteError> {
        for path in self.half_made(also)? {
            file::remove(&self.root.join(path))?;
        }
        Ok(())
    }

    /// What a killed process was about to name.
    ///
    /// # Errors
    /// The disk.
    pub fn half_made(&self, also: &[&str]) -> Result<Vec<String>, WriteError> {
        let ours = [paths::DATASET, paths::INDEX, paths::CARD, paths::PAGES];
        let mut found = Vec::new();
        for folder in ["", paths::PLOTS, paths::SPLITS] {
            for name in self.names(folder)? {
                let stem = half_made(&name);
                let own =
                    |stem: &str| !folder.is_empty() || ours.contains(&stem) || also.contains(&stem);
                match folder {
                    _ if !stem.is_some_and(own) => {}
                    "" => found.push(name),
                    folder => found.push(format!("{folder}/{name}")),
                }
            }
        }
        Ok(found)
    }

    /// Lists in `pages.json` what is ours: by old and by new hash.
    fn record(&self) -> Result<(), WriteError> {
        let path = self.root.join(paths::PAGES);
        Ok(file::write_aside(&path, &json(&path, &self.own)?)?)
    }

    /// A folder of pages: ours, or not there yet.
    fn own_folder(&self, folder: &str) -> Result<(), WriteError> {
        let path = self.root.join(folder);
        let other = path.symlink_metadata().is_ok_and(|data| !data.is_dir());
        match (other, self.foreign) {
            (true, Foreign::Refuse) => return Err(foreign(&path)),
            (true, Foreign::Replace) => file::remove(&path)?,
            (false, _) => {}
        }
        Ok(file::own_folder(&path)?)
    }

    /// A page's place is free, holds what we wrote or `wanted`, or may be written to nevertheless.
    fn check_one(&self, path: &str, wanted: Option<&str>) -> Result<(), WriteError> {
        let place = self.root.join(path);
        if place.symlink_metadata().is_err() || self.foreign == Foreign::Replace {
            return Ok(());
        }
        match self.hash_of(path)? {
            Some(hash) if wanted == Some(hash.as_str()) || self.is_own(path, &hash) => Ok(()),
            _ => Err(foreign(&place)),
        }
    }

    fn is_own(&self, path: &str, hash: &str) -> bool {
        self.own
            .iter()
            .any(|own| own.path == path && own.blake3 == hash)
    }

    /// Whether the plain file at a path below the folder is one that we wrote.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn wrote(&self, path: &str) -> Result<bool, WriteError> {
        Ok(self
            .hash_of(path)?
            .is_some_and(|hash| self.is_own(path, &hash)))
    }

    /// Hash of the plain file at a page's place.
    fn hash_of(&self, path: &str) -> Result<Option<String>, WriteError> {
        let place = self.root.join(path);
        match place.symlink_metadata() {
            Ok(data) if data.is_file() => Ok(Some(
                blake3::hash(&file::read(&place)?).to_hex().to_string(),
            )),
            _ => Ok(None),
        }
    }

    /// Paths of what is in a folder of pages, leftovers of killed processes aside.
    fn in_folder(&self, folder: &str) -> Result<Vec<String>, WriteError> {
        let path = self.root.join(folder);
        match path.symlink_metadata() {
            Ok(data) if data.is_dir() => {}
            Ok(_) if self.foreign == Foreign::Refuse => return Err(foreign(&path)),
            _ => return Ok(Vec::new()),
        }
        let names = self.names(folder)?.into_iter();
        let names = names.filter(|name| half_made(name).is_none());
        Ok(names.map(|name| format!("{folder}/{name}")).collect())
    }

    fn names(&self, folder: &str) -> Result<Vec<String>, WriteError> {
        let path = self.root.join(folder);
        if !path.symlink_metadata().is_ok_and(|data| data.is_dir()) {
            return Ok(Vec::new());
        }
        let failed = |cause| FileError::new(&path, "read", cause);
        let entries = fs::read_dir(&path).map_err(failed)?;
        let name = |entry: std::io::Result<fs::DirEntry>| {
            Ok(entry
                .map_err(failed)?
                .file_name()
                .to_string_lossy()
                .into_owned())
        };
        entries.map(name).collect()
    }
}

/// The name that a half-made file was to get: `NAME.tmp-` and letters or digits.
pub(crate) fn half_made(name: &str) -> Option<&str> {
    let (stem, end) = name.rsplit_once(".tmp-")?;
    (!end.is_empty() && end.bytes().all(|b| b.is_ascii_alphanumeric())).then_some(stem)
}

fn foreign(path: &Path) -> WriteError {
    WriteError::Occupied {
        path: path.to_owned(),
        what: "is not what qpgen wrote there; move it away, or give --force, which replaces it"
            .into(),
    }
}

/// A description; `None` if it is not there.
fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>, WriteError> {
    if !path.symlink_metadata().is_ok_and(|data| data.is_file()) {
        return Ok(None);
    }
    let bytes = file::read(path)?;
    let parsed = serde_json::from_slice(&bytes).map_err(|e| WriteError::Occupied {
        path: path.to_owned(),
        what: format!(
            "is not of this version of qpgen, or is damaged ({e}); allowed: another folder"
        ),
    });
    parsed.map(Some)
}
