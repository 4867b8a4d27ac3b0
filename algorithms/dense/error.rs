//! Why a pair has no dense map.

use super::network::NetworkError;
use crate::plane_error::PlaneError;

/// Pictures or settings without a dense map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DenseError {
    /// Not one channel of finite numbers.
    #[error(transparent)]
    Plane(#[from] PlaneError),
    /// The views, or what is known of them at each pixel, differ in size.
    #[error("left has {} × {} pixels and right {} × {}: both must be of one size", .left.0, .left.1, .right.0, .right.1)]
    Size {
        /// Columns and rows of the left view.
        left: (usize, usize),
        /// Columns and rows of the right view.
        right: (usize, usize),
    },
    /// A ratio of disparity to blur at each pixel of other views.
    #[error("the ratio of disparity to blur has {} × {} pixels and the views {} × {}: both must be of one size", .field.0, .field.1, .views.0, .views.1)]
    RatioSize {
        /// Columns and rows of the views.
        views: (usize, usize),
        /// Of the ratio.
        field: (usize, usize),
    },
    /// A picture whose edges count, of other views.
    #[error("the picture has {} × {} pixels and the views {} × {}: both must be of one size", .picture.0, .picture.1, .views.0, .views.1)]
    PictureSize {
        /// Columns and rows of the views.
        views: (usize, usize),
        /// Of the picture.
        picture: (usize, usize),
    },
    /// Too small for windows.
    #[error("{width} × {height} pixels: dense matching needs at least {least} × {least}")]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Smallest side.
        least: usize,
    },
    /// One sub-pixel.
    #[error("one sub-pixel: dense matching needs two columns or two rows")]
    NoPair,
    /// A network that does not fit.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// A ratio of disparity to blur that no pupil has.
    #[error("ratio of disparity to blur {0}: allowed is 0.01 to 4/(3π) = 0.424")]
    Ratio(f64),
}
