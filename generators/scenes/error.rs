//! Why a world cannot be generated or read from a file.

use quadpixel::scene::import::ImportError;
use quadpixel::scene::texture::TextureError;

use crate::charts::ChartError;
use crate::field_error::FieldError;

/// Why a world cannot be generated or read from a file.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A field out of its range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A sensor window that does not see the scene.
    #[error("sensor window: no light reaches one of its edges")]
    Dark,
    /// A picture on a surface.
    #[error(transparent)]
    Picture(#[from] ChartError),
    /// A texture of a surface.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// A scene file or panorama.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A scene file that cannot be read.
    #[error("{path}: {cause}")]
    File {
        /// The file.
        path: String,
        /// Why.
        cause: std::io::Error,
    },
    /// A scene file that is not the one of the recipe.
    #[error("{path}: its BLAKE3 hash is {hash}, the recipe was made with {expected}")]
    Changed {
        /// The file.
        path: String,
        /// Its hash.
        hash: String,
        /// The hash that the recipe records.
        expected: String,
    },
    /// A scene file without a triangle.
    #[error("{path}: has no triangle to show")]
    Empty {
        /// The file.
        path: String,
    },
    /// No distance is given, and nothing to take it from.
    #[error("distance_mm is absent; the lens is focused at infinity and the file has no camera")]
    NoDistance,
    /// Angles that are not finite.
    #[error("yaw_deg, pitch_deg: allowed: finite angles")]
    Angles,
}

impl SceneError {
    /// Whether the caller can mend it: always.
    pub fn is_input(&self) -> bool {
        true
    }
}
