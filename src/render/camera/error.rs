//! Why a camera cannot be put together.

use crate::lens::LensError;

/// Why a camera cannot be put together.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The lens fails at one of the wavelengths.
    #[error(transparent)]
    Lens(#[from] LensError),
    /// Part of the window gets no light.
    #[error(
        "sensor window: no light reaches the place ({x_mm:.3}, {y_mm:.3}) mm, {height_mm:.3} mm from the axis: it lies outside \
         the image circle of the lens; allowed: a window inside it"
    )]
    OutsideImageCircle {
        /// Sensor position, mm.
        x_mm: f64,
        /// Sensor position, mm.
        y_mm: f64,
        /// Distance from the axis, mm.
        height_mm: f64,
    },
    /// The response belongs to another pixel.
    #[error(
        "response: it has {response} sub-pixels and the sensor has {sensor}; allowed: the same m×n"
    )]
    SubpixelsDiffer {
        /// m×n of the response.
        response: String,
        /// m×n of the sensor.
        sensor: String,
    },
}
