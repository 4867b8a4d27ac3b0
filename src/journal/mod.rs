//! Results of a long computation that are done, on disk: one that was killed goes on where it stopped.
//!
//! One line of JSON per result, after a line with the key of what is computed; appended when the result is there. It
//! begins with the hash of key and result: `{"blake3":"…","id":…,"outcome":…}`; a line with another hash is no result.
//! Numbers come back to the bit, so what is made in several goes equals what is made in one go. A last line that was
//! torn by the kill is cut off. A journal is locked while it is open: a second process that wants the same waits for
//! the first, and says so.

mod lock;
mod seal;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::progress::Progress;
use lock::lock;
use seal::{sealed, unsealed};

#[derive(Serialize, Deserialize)]
struct Head {
    key: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line<Id, Outcome> {
    id: Id,
    outcome: Outcome,
}

/// A journal that cannot be kept, or was not waited for.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The disk.
    #[error("{}: {source}", path.display())]
    Disk {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The caller asked to stop while another process had it open.
    #[error("{}: stopped while waiting for another process that has it open", path.display())]
    Stopped {
        /// The file.
        path: PathBuf,
    },
}

/// The largest journal that is read, bytes.
const LARGEST_BYTES: u64 = 4 << 30;

/// The open journal of one computation: outcomes by their ids.
pub struct Journal<Id, Outcome> {
    path: PathBuf,
    key: String,
    file: Mutex<File>,
    /// Why the first result that could not be kept was not.
    trouble: Mutex<Option<String>>,
    done: BTreeMap<Id, Outcome>,
    /// Journals of parts whose results are among these.
    joined: Vec<PathBuf>,
    /// The first file with damaged results, and how many there are in all.
    damaged: Option<(PathBuf, usize)>,
}

/// A journal's results, and how many of its lines are none.
type Results<Id, Outcome> = (BTreeMap<Id, Outcome>, usize);

/// The results in a journal's text, if it is that of `key`. A line that is no result is a result not done.
fn results<Id, Outcome>(text: &str, key: &str) -> Option<Results<Id, Outcome>>
where
    Id: Ord + DeserializeOwned,
    Outcome: DeserializeOwned,
{
    let mut lines = text.lines();
    let head = serde_json::from_str::<Head>(lines.next()?).ok()?;
    if head.key != key {
        return None;
    }
    let (mut done, mut damaged) = (BTreeMap::new(), 0);
    for line in lines {
        let result = unsealed(line, key);
        match result.and_then(|text| serde_json::from_str::<Line<Id, Outcome>>(&text).ok()) {
            Some(line) => drop(done.insert(line.id, line.outcome)),
            None => damaged += 1,
        }
    }
    Some((done, damaged))
}

impl<Id, Outcome> Journal<Id, Outcome>
where
    Id: Ord + Serialize + DeserializeOwned,
    Outcome: Serialize + DeserializeOwned,
{
    /// Opens or begins the journal of `key`; a file of another key is begun anew. Waits while another process has it
    /// open; `progress` hears of it and may end it.
    ///
    /// # Errors
    /// A file that cannot be read or written or is no plain file, a folder that cannot be made, or a wait that ended.
    pub fn open(path: &Path, key: &str, progress: &dyn Progress) -> Result<Self, JournalError> {
        let failed = |source| JournalError::Disk {
            path: path.to_owned(),
            source,
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        if path.symlink_metadata().is_ok_and(|data| !data.is_file()) {
            let what = "is a link, folder, pipe or device; allowed: a plain file";
            return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, what)));
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(path)
            .map_err(failed)?;
        lock(&file, path, progress)?;
        let mut bytes = Vec::new();
        (&file)
            .take(LARGEST_BYTES)
            .read_to_end(&mut bytes)
            .map_err(failed)?;
        // Of bytes, not of text: a damaged byte may be no UTF-8.
        let whole = bytes
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |end| end + 1);
        let mut damaged = 0;
        let done = match results(&String::from_utf8_lossy(&bytes[..whole]), key) {
            Some((done, bad)) => {
                file.set_len(whole as u64).map_err(failed)?;
                damaged = bad;
                done
            }
            None => {
                file.set_len(0).map_err(failed)?;
                let head = Head {
                    key: key.to_owned(),
                };
                append(&file, &head).map_err(failed)?;
                BTreeMap::new()
            }
        };
        Ok(Self {
            path: path.to_owned(),
            key: key.to_owned(),
            file: Mutex::new(file),
            trouble: Mutex::new(None),
            done,
            joined: Vec::new(),
            damaged: (damaged > 0).then(|| (path.to_owned(), damaged)),
        })
    }

    /// The first file with damaged results, and how many are in all; they count as not done.
    pub fn damaged(&self) -> Option<(&Path, usize)> {
        self.damaged
            .as_ref()
            .map(|(path, count)| (path.as_path(), *count))
    }

    /// Adds the results of another journal of the same key; one of another key adds none.
    pub fn join(&mut self, path: &Path, key: &str) {
        let Ok(bytes) = crate::file::read(path) else {
            return; // its results are computed again
        };
        // The last line of a part that still runs, or was killed, is not whole.
        let whole = bytes
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |end| end + 1);
        if let Some((done, damaged)) = results(&String::from_utf8_lossy(&bytes[..whole]), key) {
            self.done.extend(done);
            self.joined.push(path.to_owned());
            if damaged > 0 {
                self.damaged.get_or_insert((path.to_owned(), 0)).1 += damaged;
            }
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A result of an earlier run.
    pub fn outcome(&self, id: &Id) -> Option<&Outcome> {
        self.done.get(id)
    }

    /// Keeps a result. It is with the system when this returns: a kill of the program loses nothing. A full disk is no
    /// failure of the computation; [`Self::remove`] tells of it.
    pub fn keep(&self, id: Id, outcome: &Outcome) {
        let line = serde_json::to_string(&Line { id, outcome });
        // A poisoned lock only means that another thread stopped; lines are written whole.
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let sealed = line
            .map_err(io::Error::from)
            .map(|line| sealed(&self.key, &line) + "\n");
        if let Err(e) = sealed.and_then(|line| file.write_all(line.as_bytes())) {
            let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
            trouble.get_or_insert(format!("{}: {e}", self.path.display()));
        }
    }

    /// Forgets all of it, once what it is for is made; why a result could not be kept, if so.
    pub fn remove(self) -> Option<String> {
        for path in self.joined.iter().chain([&self.path]) {
            // One left over is only untidy: what it was for is found before it is looked at.
            let _ = std::fs::remove_file(path);
        }
        self.trouble()
    }

    /// Closes it for a later run; why a result could not be kept, if so.
    pub fn trouble(self) -> Option<String> {
        self.trouble
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

fn append(mut file: &File, line: &impl Serialize) -> std::io::Result<()> {
    let mut text = serde_json::to_string(line)?;
    text.push('\n');
    file.write_all(text.as_bytes())
}
