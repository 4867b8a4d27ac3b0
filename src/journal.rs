//! Results of a long computation that are done, on disk: one that was killed goes on where it stopped.
//!
//! One line of JSON per result, after a line with the key of what is computed; appended when the result is there. It
//! begins with the hash of key and result: `{"blake3":"…","id":…,"outcome":…}`; a line with another hash is no result.
//! Numbers come back to the bit, so what is made in several goes equals what is made in one go. A last line that was
//! torn by the kill is cut off. A journal is locked while it is open: a second process that wants the same waits for
//! the first, and says so.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::progress::Progress;

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

/// How often a journal that is open elsewhere is tried, and how often that is told.
const TRY_EVERY: Duration = Duration::from_millis(50);
const TELL_EVERY: Duration = Duration::from_secs(10);
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

/// What a sealed line begins with, before the hash and after it.
const SEAL: [&str; 2] = ["{\"blake3\":\"", "\","];

fn hash(key: &str, result: &str) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(key.as_bytes());
    hash.update(b"\n");
    hash.update(result.as_bytes());
    hash.finalize().to_hex().to_string()
}

/// `{…}` of a result with its hash as the first field.
fn sealed(key: &str, result: &str) -> String {
    let fields = result.strip_prefix('{').unwrap_or(result);
    format!("{}{}{}{fields}", SEAL[0], hash(key, result), SEAL[1])
}

/// The result in a line whose hash is that of its content.
fn unsealed(line: &str, key: &str) -> Option<String> {
    let (stated, fields) = line.strip_prefix(SEAL[0])?.split_once(SEAL[1])?;
    let result = format!("{{{fields}");
    (hash(key, &result) == stated).then_some(result)
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

/// Waits until no other process has it open.
fn lock(file: &File, path: &Path, progress: &dyn Progress) -> Result<(), JournalError> {
    let began = Instant::now();
    let mut told: Option<Instant> = None;
    // A file system without locks: two processes may then do the same work; lines are written whole.
    while matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        if progress.stop_asked() {
            return Err(JournalError::Stopped {
                path: path.to_owned(),
            });
        }
        if told.is_none_or(|at| at.elapsed() > TELL_EVERY) {
            told = Some(Instant::now());
            progress.waiting(path, began.elapsed());
        }
        std::thread::sleep(TRY_EVERY);
    }
    Ok(())
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
        let journal = Runs::open(&path, "k", &()).unwrap();
        for i in 0..3 {
            journal.keep((0, (i, 1), 0), &answer(0.1 * i as f64));
        }
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap();
        let broken = text.replacen("\"id\":[0,[1,1],0]", "\"id\":[0,[1],0]", 1);
        std::fs::write(&path, &broken[..broken.len() - 5]).unwrap();
        let journal = Runs::open(&path, "k", &()).unwrap();
        assert_eq!(journal.outcome(&(0, (0, 1), 0)), Some(&answer(0.0)));
        assert_eq!(journal.outcome(&(0, (1, 1), 0)), None);
        assert_eq!(journal.outcome(&(0, (2, 1), 0)), None);
        journal.keep((0, (2, 1), 0), &answer(0.7));
        drop(journal);
        let journal = Runs::open(&path, "k", &()).unwrap();
        assert_eq!(journal.outcome(&(0, (2, 1), 0)), Some(&answer(0.7)));
        assert_eq!(journal.remove(), None);
        assert!(!path.exists());
    }

    #[test]
    fn a_changed_number_is_no_result_and_neither_is_one_of_another_key() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let journal = Runs::open(&path, "one", &()).unwrap();
        journal.keep((0, (0, 0), 0), &answer(0.5));
        journal.keep((0, (1, 0), 0), &answer(0.5));
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap();
        // Still JSON, and a number that might have been computed.
        let changed = text.replacen("[0.5,", "[0.6,", 1);
        assert_ne!(changed, text);
        std::fs::write(&path, &changed).unwrap();
        let journal = Runs::open(&path, "one", &()).unwrap();
        assert_eq!(journal.outcome(&(0, (0, 0), 0)), None);
        assert_eq!(journal.outcome(&(0, (1, 0), 0)), Some(&answer(0.5)));
        assert_eq!(journal.damaged(), Some((path.as_path(), 1)));
        drop(journal);
        // The lines of one table under the key of another.
        std::fs::write(&path, text.replace("\"key\":\"one\"", "\"key\":\"two\"")).unwrap();
        let journal = Runs::open(&path, "two", &()).unwrap();
        assert_eq!(journal.damaged(), Some((path.as_path(), 2)));
    }

    #[test]
    fn who_waits_for_another_process_is_told_and_may_stop() {
        struct Impatient(std::sync::atomic::AtomicUsize);
        impl Progress for Impatient {
            fn waiting(&self, path: &Path, _: Duration) {
                assert!(path.ends_with("a.journal"));
                self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            }
            fn stop_asked(&self) -> bool {
                self.0.load(std::sync::atomic::Ordering::Relaxed) > 0
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let first = Runs::open(&path, "k", &()).unwrap();
        let second = Runs::open(&path, "k", &Impatient(0.into())).err().unwrap();
        assert!(matches!(second, JournalError::Stopped { .. }), "{second}");
        drop(first);
        Runs::open(&path, "k", &Impatient(0.into())).unwrap();
    }

    #[test]
    fn journals_of_parts_are_joined_and_go_with_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, other, whole] = ["a", "b", "other", "whole"].map(|n| folder.path().join(n));
        for (i, (path, key)) in [(&a, "k"), (&b, "k"), (&other, "x")]
            .into_iter()
            .enumerate()
        {
            let part = Runs::open(path, key, &()).unwrap();
            part.keep((0, (i as i64, 0), 0), &answer(i as f64));
            assert_eq!(part.trouble(), None);
        }
        // The last line of a part that still runs, or was killed, is not whole.
        let text = std::fs::read_to_string(&b).unwrap();
        std::fs::write(&b, format!("{text}{{\"id")).unwrap();
        let mut journal = Runs::open(&whole, "k", &()).unwrap();
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
        let journal = Runs::open(&path, "one", &()).unwrap();
        journal.keep((0, (0, 0), 0), &answer(0.5));
        drop(journal);
        let journal = Runs::open(&path, "two", &()).unwrap();
        assert_eq!(journal.outcome(&(0, (0, 0), 0)), None);
    }
}
