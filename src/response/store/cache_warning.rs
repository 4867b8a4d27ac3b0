//! What is wrong with a cache whose tables are right.

use std::path::PathBuf;

/// The table is right, but the cache is not.
#[derive(Debug)]
pub enum CacheWarning {
    /// A file was there and was no such table; it was simulated anew.
    Rebuilt {
        /// The file.
        path: PathBuf,
        /// What was wrong with it.
        why: String,
    },
    /// Results in a journal were damaged; they are made anew.
    DamagedResults {
        /// The journal.
        path: PathBuf,
        /// How many.
        count: usize,
    },
    /// Runs could not be kept while it was made.
    NoJournal(String),
    /// The table could not be kept.
    NotKept {
        /// The file.
        path: PathBuf,
        /// Why not.
        why: String,
    },
}

impl std::fmt::Display for CacheWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rebuilt { path, why } => {
                write!(
                    f,
                    "{}: not the table it should be ({why}); set aside as .npz.damaged and made anew",
                    path.display()
                )
            }
            Self::DamagedResults { path, count } => {
                write!(
                    f,
                    "{}: {count} results are damaged; made anew",
                    path.display()
                )
            }
            Self::NoJournal(why) => {
                write!(f, "{why}: a build that stops would begin anew")
            }
            Self::NotKept { path, why } => {
                write!(f, "{}: the table could not be kept ({why})", path.display())
            }
        }
    }
}
