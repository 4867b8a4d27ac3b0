//! Results of a long computation that are done, on disk: one that was killed goes on where it stopped.
//!
//! One line of JSON per result, after a line with the key of what is computed; appended when the result is there.
//! Numbers come back to the bit, so what is made in several goes equals what is made in one go. A last line that was
//! torn by the kill is cut off. A journal is locked while it is open: a second process that wants the same waits for
//! the first.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

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

/// A journal that cannot be kept.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub struct JournalError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub source: std::io::Error,
}

/// The open journal of one computation: outcomes by their ids.
pub struct Journal<Id, Outcome> {
    path: PathBuf,
    file: Mutex<File>,
    /// Why the first result that could not be kept was not.
    trouble: Mutex<Option<String>>,
    done: BTreeMap<Id, Outcome>,
    /// Journals of parts whose results are among these.
    joined: Vec<PathBuf>,
}

/// The results in a journal's text, if it is that of `key`. A line that is no result is a result not done.
fn results<Id, Outcome>(text: &str, key: &str) -> Option<BTreeMap<Id, Outcome>>
where
    Id: Ord + DeserializeOwned,
    Outcome: DeserializeOwned,
{
    let mut lines = text.lines();
    let head = serde_json::from_str::<Head>(lines.next()?).ok()?;
    let results = lines.filter_map(|l| serde_json::from_str::<Line<Id, Outcome>>(l).ok());
    (head.key == key).then(|| results.map(|l| (l.id, l.outcome)).collect())
}

impl<Id, Outcome> Journal<Id, Outcome>
where
    Id: Ord + Serialize + DeserializeOwned,
    Outcome: Serialize + DeserializeOwned,
{
    /// Opens or begins the journal of `key`; a file of another key is begun anew. Waits while another process has it
    /// open.
    ///
    /// # Errors
    /// A file that cannot be read or written, or a folder that cannot be made.
    pub fn open(path: &Path, key: &str) -> Result<Self, JournalError> {
        let failed = |source| JournalError {
            path: path.to_owned(),
            source,
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(path)
            .map_err(failed)?;
        // A file system without locks: two processes may then do the same work; lines are written whole.
        let _ = file.lock();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let text = String::from_utf8_lossy(&bytes);
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let done = match results(whole, key) {
            Some(done) => {
                file.set_len(whole.len() as u64).map_err(failed)?;
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
            file: Mutex::new(file),
            trouble: Mutex::new(None),
            done,
            joined: Vec::new(),
        })
    }

    /// Adds the results of another journal of the same key; one of another key adds none.
    pub fn join(&mut self, path: &Path, key: &str) {
        let Ok(bytes) = std::fs::read(path) else {
            return; // its results are computed again
        };
        if let Some(done) = results(&String::from_utf8_lossy(&bytes), key) {
            self.done.extend(done);
            self.joined.push(path.to_owned());
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
        let line = Line { id, outcome };
        // A poisoned lock only means that another thread stopped; lines are written whole.
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(e) = append(&file, &line) {
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    type Runs = Journal<(usize, (i64, i64), usize), Vec<f64>>;

    fn answer(p: f64) -> Vec<f64> {
        vec![p, 1.0 / 3.0, -0.1 * p]
    }

    #[test]
    fn a_torn_line_and_a_broken_one_are_runs_not_done() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/a.journal");
        let journal = Runs::open(&path, "k").unwrap();
        for i in 0..3 {
            journal.keep((0, (i, 1), 0), &answer(0.1 * i as f64));
        }
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap();
        let broken = text.replacen("\"id\":[0,[1,1],0]", "\"id\":[0,[1],0]", 1);
        std::fs::write(&path, &broken[..broken.len() - 5]).unwrap();
        let journal = Runs::open(&path, "k").unwrap();
        assert_eq!(journal.outcome(&(0, (0, 1), 0)), Some(&answer(0.0)));
        assert_eq!(journal.outcome(&(0, (1, 1), 0)), None);
        assert_eq!(journal.outcome(&(0, (2, 1), 0)), None);
        journal.keep((0, (2, 1), 0), &answer(0.7));
        drop(journal);
        let journal = Runs::open(&path, "k").unwrap();
        assert_eq!(journal.outcome(&(0, (2, 1), 0)), Some(&answer(0.7)));
        assert_eq!(journal.remove(), None);
        assert!(!path.exists());
    }

    #[test]
    fn journals_of_parts_are_joined_and_go_with_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, other, whole] = ["a", "b", "other", "whole"].map(|n| folder.path().join(n));
        for (i, (path, key)) in [(&a, "k"), (&b, "k"), (&other, "x")]
            .into_iter()
            .enumerate()
        {
            let part = Runs::open(path, key).unwrap();
            part.keep((0, (i as i64, 0), 0), &answer(i as f64));
            assert_eq!(part.trouble(), None);
        }
        // The last line of a part that still runs, or was killed, is not whole.
        let text = std::fs::read_to_string(&b).unwrap();
        std::fs::write(&b, format!("{text}{{\"id")).unwrap();
        let mut journal = Runs::open(&whole, "k").unwrap();
        for part in [&a, &b, &other, &folder.path().join("none")] {
            journal.join(part, "k");
        }
        assert_eq!(journal.outcome(&(0, (0, 0), 0)), Some(&answer(0.0)));
        assert_eq!(journal.outcome(&(0, (1, 0), 0)), Some(&answer(1.0)));
        assert_eq!(journal.outcome(&(0, (2, 0), 0)), None);
        journal.remove();
        assert!(!a.exists() && !b.exists() && !whole.exists() && other.exists());
    }

    #[test]
    fn another_tables_journal_is_begun_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let journal = Runs::open(&path, "one").unwrap();
        journal.keep((0, (0, 0), 0), &answer(0.5));
        drop(journal);
        let journal = Runs::open(&path, "two").unwrap();
        assert_eq!(journal.outcome(&(0, (0, 0), 0)), None);
    }
}
