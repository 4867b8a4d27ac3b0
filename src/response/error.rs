//! What can be wrong with a response.

use std::path::PathBuf;

/// A response that cannot be made, read or written.
#[derive(Debug, thiserror::Error)]
pub enum ResponseError {
    /// A value out of its range.
    #[error("response: {field} is {value}; allowed: {allowed}")]
    Value {
        /// The field.
        field: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file that is no response.
    #[error("{}: {why}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong in it.
        why: String,
    },
    /// The pixel model refused the pixel.
    #[error(transparent)]
    Pixel(#[from] crate::em::StackError),
    /// The FDTD model refused its settings or the machine.
    #[error(transparent)]
    Fdtd(#[from] crate::em::fdtd::FdtdError),
    /// The Fourier modal model refused its settings, or found no modes.
    #[error(transparent)]
    Rcwa(#[from] crate::em::rcwa::RcwaError),
}

impl ResponseError {
    pub(super) fn value(
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Value {
            field,
            value: value.to_string(),
            allowed,
        }
    }
}
