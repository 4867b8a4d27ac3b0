//! Why a sample or dataset could not be written.

use std::path::PathBuf;

use quadpixel::file::FileError;
use quadpixel::image::ImageError;
use quadpixel_datasets::paths;

/// Why a sample or dataset could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// A picture could not be stored.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A name or number that is not allowed.
    #[error(transparent)]
    Path(#[from] paths::PathError),
    /// An input does not have the shape that the sensor asks for.
    #[error("sample {sample}: {what}")]
    Input {
        /// Name of the sample.
        sample: String,
        /// What does not fit, and what would.
        what: String,
    },
    /// Something is there already that this run may not replace.
    #[error("{}: {what}", path.display())]
    Occupied {
        /// The file or folder.
        path: PathBuf,
        /// Why it is in the way.
        what: String,
    },
    /// The gallery cannot be made of its template.
    #[error("gallery: {0}")]
    Gallery(#[from] minijinja::Error),
    /// A description cannot be written as JSON.
    #[error("{}: cannot be written as JSON: {cause}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The reason.
        cause: serde_json::Error,
    },
}

impl WriteError {
    /// Whether the caller can mend it: another folder or another sample.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Occupied { .. } | Self::Input { .. } | Self::Path(_) => true,
            Self::File(_) | Self::Image(_) | Self::Gallery(_) | Self::Json { .. } => false,
        }
    }
}
