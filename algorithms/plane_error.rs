//! Pictures that matching takes: one channel of finite numbers.

use quadpixel::image::Image;

/// A picture that is no plane of finite numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaneError {
    /// Not a single channel.
    #[error("{0} channels: matching takes one channel at a time")]
    Channels(usize),
    /// NaN or infinity.
    #[error("pixel (x {x}, y {y}) holds {value}: only finite numbers are allowed")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// NaN or ±∞.
        value: f32,
    },
}

impl PlaneError {
    /// Whether a picture is one channel of finite numbers.
    ///
    /// # Errors
    /// What it is instead, with the first pixel that is not finite.
    pub fn check(image: &Image) -> Result<(), Self> {
        if image.channels() != 1 {
            return Err(Self::Channels(image.channels()));
        }
        let bad = image.data().iter().position(|v| !v.is_finite());
        bad.map_or(Ok(()), |i| {
            Err(Self::NotFinite {
                x: i % image.width(),
                y: i / image.width(),
                value: image.data()[i],
            })
        })
    }
}
