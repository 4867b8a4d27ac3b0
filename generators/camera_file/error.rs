//! Why a camera file is not taken.

use quadpixel::em::StackError;
use quadpixel::file::FileError;
use quadpixel::lens::LensError;
use quadpixel::range::OutOfRange;

/// Why a camera file is not taken.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It is no such TOML.
    #[error("{file}: {cause}")]
    Toml {
        /// The file.
        file: String,
        /// What is wrong, and where.
        cause: Box<toml::de::Error>,
    },
    /// A number of it.
    #[error("{file}: {cause}")]
    Value {
        /// The file.
        file: String,
        /// Which number, and what is allowed.
        cause: OutOfRange,
    },
    /// Its pixel.
    #[error("{file}: {cause}")]
    Pixel {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: StackError,
    },
    /// Its lens.
    #[error("{file}: {cause}")]
    Lens {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: LensError,
    },
}
