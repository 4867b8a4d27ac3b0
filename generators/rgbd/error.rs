//! Why a picture with depth cannot be read.

use std::path::PathBuf;

use quadpixel::image::ImageError;
use quadpixel::rgbd::RgbdError;

/// Why a picture with depth cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// A file that is no picture or no map.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A file whose content does not serve, and what would.
    #[error("{}: {what}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what is allowed.
        what: String,
    },
    /// Picture and depth that do not go together, or cannot be converted.
    #[error("{} with {}: {cause}", image.display(), depth.display())]
    Pair {
        /// The picture.
        image: PathBuf,
        /// Its depth.
        depth: PathBuf,
        /// Why.
        cause: RgbdError,
    },
    /// Folders without pairs, or stems that are there twice.
    #[error("{0}")]
    Pairs(String),
}

impl PictureError {
    /// Whether the caller can mend it.
    pub fn is_input(&self) -> bool {
        true
    }
}
