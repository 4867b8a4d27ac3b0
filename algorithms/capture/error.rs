//! Files and folders that are no capture.

use std::path::PathBuf;

use crate::camera::CameraError;
use crate::load::LoadError;
use crate::sai::SaiError;

/// A file or folder that is no capture.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// A picture cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A description cannot be read.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A folder without a description.
    #[error("{}: {} is missing: allowed is a sample's folder, such as DATASET/samples/000000", path.display(), wanted.display())]
    Missing {
        /// The folder.
        path: PathBuf,
        /// What should be in it.
        wanted: PathBuf,
    },
    /// Levels without a slope.
    #[error("{}: raw: white_level {white} must be above black_level {black}", path.display())]
    Levels {
        /// The description.
        path: PathBuf,
        /// White level.
        white: u16,
        /// Black level.
        black: u16,
    },
    /// A mosaic that cannot be parted, or views that are no set.
    #[error("{}: {error}", path.display())]
    Views {
        /// The file.
        path: PathBuf,
        /// Why.
        error: SaiError,
    },
    /// An EXR of views without one of them.
    #[error("{}: it has no view {name}", path.display())]
    NoView {
        /// The file.
        path: PathBuf,
        /// Name of the sub-pixel.
        name: String,
    },
    /// An EXR of views of unlike channels.
    #[error("{}: view {name} has other channels", path.display())]
    Channels {
        /// The file.
        path: PathBuf,
        /// Name of the sub-pixel.
        name: String,
    },
    /// Views of another size than the description says.
    #[error("{}: views of {} × {} pixels where {} says {} × {}", path.display(), found[0], found[1], description.display(), expected[0], expected[1])]
    Size {
        /// The mosaic.
        path: PathBuf,
        /// Columns and rows of its views.
        found: [usize; 2],
        /// The description.
        description: PathBuf,
        /// Its columns and rows.
        expected: [usize; 2],
    },
    /// Neither a description nor names of views tell the sub-pixels.
    #[error("{}: no description of the camera lies beside it: its sub-pixels must be given, such as 2x2", path.display())]
    NoSubpixels {
        /// The mosaic.
        path: PathBuf,
    },
}
