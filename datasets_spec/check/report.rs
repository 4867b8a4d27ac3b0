//! What a check finds, how far it has come, and how far it goes.

use std::collections::BTreeMap;

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The file or folder, below the dataset's folder.
    pub path: String,
    /// What is wrong with it, and what it should be.
    pub what: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.path, self.what)
    }
}

/// How far a check has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Files checked.
    pub done: usize,
    /// Files listed.
    pub total: usize,
}

/// The outcome of a check.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// What is wrong; empty for a sound dataset.
    pub findings: Vec<Finding>,
    /// Samples listed.
    pub samples: usize,
    /// Files that were read.
    pub files: usize,
    /// Their bytes.
    pub bytes: u64,
}

impl Report {
    /// Takes over what another one found.
    pub(super) fn merge(&mut self, other: Self) {
        self.files += other.files;
        self.bytes += other.bytes;
        self.findings.extend(other.findings);
    }

    pub(super) fn add(&mut self, path: &str, what: impl Into<String>) {
        self.findings.push(Finding {
            path: path.to_string(),
            what: what.into(),
        });
    }
}

/// The listed files of one folder, by their name there; `None` where a file is missing or differs from its hash (which
/// has been reported, so its content is not looked at).
pub(super) type Contents = BTreeMap<String, Option<Vec<u8>>>;

/// How far a check goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    Hashes,
    Pixels,
}
