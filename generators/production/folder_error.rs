//! Why the folder of a dataset or of a part of one cannot be used.

use std::path::PathBuf;

use quadpixel::file::FileError;
use quadpixel_datasets::paths::PathError;

/// Why the folder of a dataset or of a part of one cannot be used.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// What is there, or was asked for, does not fit.
    #[error("{place}: {what}")]
    Refused {
        /// The folder, file or argument.
        place: String,
        /// What is wrong with it, and what is allowed.
        what: String,
    },
    /// A dataset may grow, but not shrink: samples would be left over.
    #[error("--count is {count}; {} holds sample {largest} already; allowed: at least {}, or a new folder", folder.display(), largest + 1)]
    Fewer {
        /// The folder of the dataset.
        folder: PathBuf,
        /// The number of samples that was asked for.
        count: usize,
        /// The largest number of a sample that is there.
        largest: usize,
    },
    /// More samples than a dataset can have.
    #[error(transparent)]
    Path(#[from] PathError),
    /// Another process writes there.
    #[error("{}: another run is writing to this folder", path.display())]
    Busy {
        /// The locked file.
        path: PathBuf,
    },
    /// The folder is not the one that was opened.
    #[error("{}: the folder that this run wrote to has gone from there (unmounted, moved or removed?)", folder.display())]
    Gone {
        /// Its name.
        folder: PathBuf,
    },
    /// Parts of the dataset are not there.
    #[error("{}: not whole\n  {missing}", folder.display())]
    Incomplete {
        /// The folder of the dataset.
        folder: PathBuf,
        /// Which, one line per part.
        missing: String,
    },
    /// The disk.
    #[error(transparent)]
    File(#[from] FileError),
    /// The disk, where a file was not read or written as a whole.
    #[error("{}: {cause}", path.display())]
    Disk {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A record that cannot be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

impl FolderError {
    /// What is wrong in a place, and what is allowed.
    pub(crate) fn refused(place: impl ToString, what: impl ToString) -> Self {
        Self::Refused {
            place: place.to_string(),
            what: what.to_string(),
        }
    }

    /// A disk that fails at `path`.
    pub(crate) fn disk(path: &std::path::Path, cause: std::io::Error) -> Self {
        Self::Disk {
            path: path.to_owned(),
            cause,
        }
    }

    /// Whether the caller can mend it with another folder or other arguments. Otherwise the machine failed, or parts
    /// are not there yet.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Refused { .. } | Self::Fewer { .. } | Self::Path(_)
        )
    }
}
