//! The runs of a table that are done, on disk: a build that was killed goes on where it stopped.
//!
//! One line of JSON a run, after a line with the table's key; appended when the run ends. Numbers come back to the bit, so a table made
//! in several goes equals one made in one go. A last line that was torn by the kill is cut off. A journal is locked while it is open: a
//! second process that wants the same table waits for the first.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::ResponseError;
use super::symmetry::Node;

/// What a pixel model answers: per wavelength of the run the powers absorbed, and how well it was computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Answer {
    /// P per wavelength and sub-pixel, mean of s and p.
    pub absorbed: Vec<Vec<f64>>,
    /// Relative residual of the solution.
    pub residual: f64,
    /// Power found beyond (> 0) or short of (< 0) the incident one, the worst of the wavelengths.
    pub imbalance: f64,
    /// What is wrong with the run.
    pub warnings: Vec<String>,
}

/// A run by its first wavelength (its place in the table's list), its node, and its lens shift (its place in the table's grid; 0 for the
/// centred lens).
pub(super) type RunId = (usize, Node, usize);

#[derive(Serialize, Deserialize)]
struct Head {
    key: String,
}

#[derive(Serialize, Deserialize)]
struct Line {
    wavelength: usize,
    node: Node,
    #[serde(default)]
    shift: usize,
    answer: Answer,
}

/// The open journal of one table.
pub(super) struct Journal {
    path: PathBuf,
    file: Mutex<File>,
    /// Why the first run that could not be kept was not.
    trouble: Mutex<Option<String>>,
    done: BTreeMap<RunId, Answer>,
    /// Journals of parts whose runs are among these.
    joined: Vec<PathBuf>,
}

/// The runs in a journal's text, if it is that of the table `key`. A line that is no run is a run not done.
fn runs(text: &str, key: &str) -> Option<BTreeMap<RunId, Answer>> {
    let mut lines = text.lines();
    let head = serde_json::from_str::<Head>(lines.next()?).ok()?;
    let runs = lines.filter_map(|l| serde_json::from_str::<Line>(l).ok());
    (head.key == key).then(|| {
        runs.map(|l| ((l.wavelength, l.node, l.shift), l.answer))
            .collect()
    })
}

impl Journal {
    /// Opens or begins the journal of the table `key`; a file that is another table's is begun anew. Waits while another process has
    /// it open.
    pub fn open(path: &Path, key: &str) -> Result<Self, ResponseError> {
        let io = |source| ResponseError::Io {
            path: path.to_owned(),
            source,
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(io)?;
        }
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(path)
            .map_err(io)?;
        // A file system without locks: two processes may then do the same work; lines are written whole.
        let _ = file.lock();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        let text = String::from_utf8_lossy(&bytes);
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let done = match runs(whole, key) {
            Some(done) => {
                file.set_len(whole.len() as u64).map_err(io)?;
                done
            }
            None => {
                file.set_len(0).map_err(io)?;
                let head = Head {
                    key: key.to_owned(),
                };
                append(&file, &head).map_err(io)?;
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

    /// Adds the runs of another journal of the same table; one of another table adds none.
    pub fn join(&mut self, path: &Path, key: &str) {
        let Ok(bytes) = std::fs::read(path) else {
            return; // its runs are done again
        };
        if let Some(done) = runs(&String::from_utf8_lossy(&bytes), key) {
            self.done.extend(done);
            self.joined.push(path.to_owned());
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The answer of a run done earlier.
    pub fn answer(&self, id: RunId) -> Option<&Answer> {
        self.done.get(&id)
    }

    /// Keeps a run. It is with the system when this returns: a kill of the program loses nothing. A full disk is no failure of the
    /// build; [`Self::remove`] tells of it.
    pub fn keep(&self, (wavelength, node, shift): RunId, answer: &Answer) {
        let line = Line {
            wavelength,
            node,
            shift,
            answer: answer.clone(),
        };
        // A poisoned lock only means that another thread stopped; lines are written whole.
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(e) = append(&file, &line) {
            let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
            trouble.get_or_insert(format!("{}: {e}", self.path.display()));
        }
    }

    /// Forgets all of it, once the table is made; why a run could not be kept, if so.
    pub fn remove(self) -> Option<String> {
        for path in self.joined.iter().chain([&self.path]) {
            // One left over is only untidy: its table is found before it is looked at.
            let _ = std::fs::remove_file(path);
        }
        self.trouble()
    }

    /// Closes it for a later build; why a run could not be kept, if so.
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

    fn answer(p: f64) -> Answer {
        Answer {
            absorbed: vec![vec![p, 1.0 / 3.0]],
            residual: 1e-7,
            imbalance: -0.1 * p,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_torn_line_and_a_broken_one_are_runs_not_done() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/a.journal");
        let journal = Journal::open(&path, "k").unwrap();
        for i in 0..3 {
            journal.keep((0, (i, 1), 0), &answer(0.1 * i as f64));
        }
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap();
        let broken = text.replacen("\"node\":[1,1]", "\"node\":[1]", 1);
        std::fs::write(&path, &broken[..broken.len() - 5]).unwrap();
        let journal = Journal::open(&path, "k").unwrap();
        assert_eq!(journal.answer((0, (0, 1), 0)), Some(&answer(0.0)));
        assert_eq!(journal.answer((0, (1, 1), 0)), None);
        assert_eq!(journal.answer((0, (2, 1), 0)), None);
        journal.keep((0, (2, 1), 0), &answer(0.7));
        drop(journal);
        let journal = Journal::open(&path, "k").unwrap();
        assert_eq!(journal.answer((0, (2, 1), 0)), Some(&answer(0.7)));
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
            let part = Journal::open(path, key).unwrap();
            part.keep((0, (i as i64, 0), 0), &answer(i as f64));
            assert_eq!(part.trouble(), None);
        }
        // The last line of a part that still runs, or was killed, is not whole.
        let text = std::fs::read_to_string(&b).unwrap();
        std::fs::write(&b, format!("{text}{{\"wavel")).unwrap();
        let mut journal = Journal::open(&whole, "k").unwrap();
        for part in [&a, &b, &other, &folder.path().join("none")] {
            journal.join(part, "k");
        }
        assert_eq!(journal.answer((0, (0, 0), 0)), Some(&answer(0.0)));
        assert_eq!(journal.answer((0, (1, 0), 0)), Some(&answer(1.0)));
        assert_eq!(journal.answer((0, (2, 0), 0)), None);
        journal.remove();
        assert!(!a.exists() && !b.exists() && !whole.exists() && other.exists());
    }

    #[test]
    fn another_tables_journal_is_begun_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let journal = Journal::open(&path, "one").unwrap();
        journal.keep((0, (0, 0), 0), &answer(0.5));
        drop(journal);
        let journal = Journal::open(&path, "two").unwrap();
        assert_eq!(journal.answer((0, (0, 0), 0)), None);
    }
}
