//! Why a picture has no sharpness.

/// A picture or preset that has no sharpness.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SharpnessError {
    /// No such preset.
    #[error("preset: {0:?} is not one of wee-abstract, table-2")]
    Preset(String),
    /// No pixel.
    #[error("the image has no pixel")]
    Empty,
    /// No pixel in the middle is valid.
    #[error(
        "of {width} x {height} px no rectangle in the middle is valid in every view and channel after the correction; allowed: larger views"
    )]
    NoneValid {
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// No such channel.
    #[error("channel {channel}: the image has {channels}")]
    Channel {
        /// The one asked for.
        channel: usize,
        /// The number there is.
        channels: usize,
    },
    /// NaN or an infinity.
    #[error("pixel (x {x}, y {y}) holds {value}: only finite numbers are allowed")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// NaN or ±∞.
        value: f64,
    },
    /// A scale or k without meaning.
    #[error("{field}: {value} must be above 0 and finite")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The singular values did not converge.
    #[error("the singular values did not converge")]
    Singular,
}
