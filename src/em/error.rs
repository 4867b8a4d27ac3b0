//! What makes a pixel impossible, and what solvers refuse.

use crate::range::OutOfRange;

/// A pixel that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StackError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A pixel file that is not understood.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: String,
        /// What is wrong in it.
        why: String,
    },
}

impl StackError {
    pub(crate) fn value(
        field: impl Into<String>,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Range(OutOfRange::new("pixel", field.into(), value, allowed))
    }
}

/// A plane wave that a solver has no answer to.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A pixel or a material that cannot be.
    #[error(transparent)]
    Pixel(#[from] StackError),
    /// A solution that was not found; the solver says why.
    #[error("{0}")]
    NotFound(String),
}

impl SolverError {
    pub(crate) fn value(
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Range(OutOfRange::new("response", field, value, allowed))
    }
}
