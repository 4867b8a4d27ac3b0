//! What can be wrong with a response.

use std::path::PathBuf;

use crate::em::StackError;
use crate::em::light::SolverError;
use crate::journal::JournalError;
use crate::range::OutOfRange;

/// A response that cannot be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The caller asked to stop while another process made the table.
    #[error("{}: stopped while waiting for another process that makes this table", path.display())]
    Stopped {
        /// The journal that it has open.
        path: PathBuf,
    },
    /// A file that is no response.
    #[error("{}: {why}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong in it.
        why: String,
    },
    /// The pixel solver refused the pixel or found no solution.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

impl ResponseError {
    pub(super) fn value(
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Range(OutOfRange::new("response", field, value, allowed))
    }
}

impl From<StackError> for ResponseError {
    fn from(error: StackError) -> Self {
        Self::Solver(error.into())
    }
}

impl From<JournalError> for ResponseError {
    fn from(error: JournalError) -> Self {
        match error {
            JournalError::Disk { path, source } => Self::Io { path, source },
            JournalError::Stopped { path } => Self::Stopped { path },
        }
    }
}
