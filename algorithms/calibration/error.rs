//! Captures that give no calibration, and files that are none.

use crate::disparity::MatchError;
use crate::field::FieldError;

/// A capture that gives no calibration, or a file that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// It cannot be matched.
    #[error("view {view}, channel {channel}: {error}")]
    Match {
        /// Sub-pixel.
        view: String,
        /// Channel.
        channel: String,
        /// Why.
        error: MatchError,
    },
    /// The sum shows no texture, or is too small.
    #[error(
        "sum of the views: {error}: is the chart textured, in focus and large enough (centroids need a hundred px; `--align texture` fewer)?"
    )]
    Reference {
        /// Why.
        error: FieldError,
    },
    /// No field fits.
    #[error(
        "view {view}, channel {channel}: {error}: is the chart textured, in focus and large enough (centroids need a hundred px; `--align texture` fewer)?"
    )]
    Field {
        /// Sub-pixel.
        view: String,
        /// Channel.
        channel: String,
        /// Why.
        error: FieldError,
    },
    /// Not such a file.
    #[error("no calibration: {0}")]
    File(String),
}
