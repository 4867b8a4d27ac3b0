//! Why a camera could not be fitted.

use std::path::PathBuf;

use quadpixel::em::{SolverError, StackError};
use quadpixel::file::FileError;
use quadpixel::image::ImageError;
use quadpixel::range::OutOfRange;

/// Why a camera could not be fitted. [`Self::is_input`] tells whose fault it is.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// The pixel that the fit starts from.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// The solver of the pixel.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// A capture that cannot be used, with what would do.
    #[error("{}: {what}", path.display())]
    Capture {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what is allowed.
        what: String,
    },
    /// Fewer numbers than what is asked of them.
    #[error("too little data: {0}")]
    TooLittle(String),
    /// A picture that cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// What was asked of the observer.
    #[error("stopped before the fit had ended")]
    Stopped,
}

impl FitError {
    /// Of a file, and what is wrong with it.
    pub(super) fn capture(path: impl Into<PathBuf>, what: impl Into<String>) -> Self {
        Self::Capture {
            path: path.into(),
            what: what.into(),
        }
    }

    /// Whether other data or settings mend it. Otherwise the machine failed.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::File(_) | Self::Stopped)
    }
}
