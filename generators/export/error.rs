//! Why a dataset cannot be exported.

use std::path::{Path, PathBuf};

use quadpixel::file::FileError;
use quadpixel::image::ImageError;

/// Why a dataset cannot be exported.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Something of the dataset, or of what was asked for, does not fit.
    #[error("{place}: {what}")]
    Refused {
        /// The file, sample or argument.
        place: String,
        /// What is wrong with it.
        what: String,
    },
    /// A folder that is no finished dataset.
    #[error("{0}; allowed: the folder of a finished dataset")]
    NoDataset(FileError),
    /// A file of the dataset that cannot be read.
    #[error(transparent)]
    Read(FileError),
    /// A picture of the dataset that cannot be read.
    #[error(transparent)]
    Picture(ImageError),
    /// A picture that cannot be encoded.
    #[error(transparent)]
    Encode(#[from] ImageError),
    /// A map that cannot be written as an array.
    #[error(transparent)]
    Array(#[from] ndarray_npy::WriteNpyError),
    /// The observer asked to stop.
    #[error("stopped by a signal; nothing is left of the export")]
    Stopped,
    /// The disk.
    #[error(transparent)]
    File(#[from] FileError),
    /// The disk, where a file was not written as a whole.
    #[error("{}: cannot write: {cause}", path.display())]
    Disk {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
}

impl ExportError {
    /// What is wrong in a place.
    pub(super) fn refused(place: impl ToString, what: impl ToString) -> Self {
        Self::Refused {
            place: place.to_string(),
            what: what.to_string(),
        }
    }

    /// A disk that fails at `path`.
    pub(super) fn disk(path: impl AsRef<Path>, cause: std::io::Error) -> Self {
        Self::Disk {
            path: path.as_ref().to_owned(),
            cause,
        }
    }

    /// Whether the dataset or the arguments are at fault. Otherwise the machine failed.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Refused { .. } | Self::NoDataset(_) | Self::Read(_) | Self::Picture(_) => true,
            Self::Encode(_)
            | Self::Array(_)
            | Self::Stopped
            | Self::File(_)
            | Self::Disk { .. } => false,
        }
    }
}
