//! What makes a pixel impossible.

use crate::range::OutOfRange;

/// A pixel that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
