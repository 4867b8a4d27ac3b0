//! Why a picture with depth cannot be converted.

use crate::render::kernels::KernelError;

/// Why a picture with depth cannot be converted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RgbdError {
    /// Picture and depth are not of one size, or not of the channels that they should have.
    #[error(
        "picture of {picture}, depth of {depth}; allowed: one size, a picture of 3 channels and a depth of 1"
    )]
    Sizes {
        /// Columns × rows × channels.
        picture: String,
        /// Columns × rows × channels.
        depth: String,
    },
    /// A value of the picture that is no light.
    #[error("the picture has {value} at ({x}, {y}); allowed: finite light, not negative")]
    Light {
        /// The value.
        value: f32,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// A depth that is none.
    #[error(
        "the depth has {value} mm at ({x}, {y}); allowed: above 0, +inf, NaN where it is not known"
    )]
    Depth {
        /// The value, mm.
        value: f32,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// No depth is known.
    #[error(
        "every depth is invalid; allowed: at least one; is the unit, or the value that marks holes, right?"
    )]
    NoDepth,
    /// A blur larger than the picture.
    #[error(
        "the nearest depth, {nearest_m:.4} m, is blurred over {reach_px} px to each side of a picture of {width} × {height} px; \
         allowed: less than half its shorter side; is the unit right? Else focus nearer, stop the lens down, or set depths \
         that are too near to holes"
    )]
    Blur {
        /// Nearest depth, m.
        nearest_m: f64,
        /// How far its kernel reaches, px.
        reach_px: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The camera's window is not of the picture's size.
    #[error("the sensor window is {sensor} pixels, the picture {picture}; allowed: one size")]
    Window {
        /// Columns × rows.
        sensor: String,
        /// Columns × rows.
        picture: String,
    },
    /// More sub-pixels than are converted.
    #[error("{subpixels} sub-pixels per pixel; allowed: at most 16")]
    Subpixels {
        /// How many.
        subpixels: usize,
    },
    /// Part of the window gets no light.
    #[error(
        "part of the sensor window is dark; allowed: a window inside the image circle of the lens"
    )]
    Dark,
    /// It would take more memory than is allowed.
    #[error(transparent)]
    Memory(#[from] crate::memory::MemoryError),
}

impl From<KernelError> for RgbdError {
    fn from(error: KernelError) -> Self {
        match error {
            KernelError::Memory(error) => Self::Memory(error),
            KernelError::Dark => Self::Dark,
        }
    }
}
