//! Linear pictures as sRGB PNG files.

use std::path::Path;

use quadpixel::image::raster::{self, Levels};
use quadpixel::image::{Image, srgb};

use super::error::ExportError;

/// A picture's PNG and how many of its values were above white (1), stored as white. Below 0 (noise) is stored as 0.
pub(super) struct Png {
    pub bytes: Vec<u8>,
    pub clipped: u64,
}

/// 16 bits: code = 65535 × sRGB value, rounded.
pub(super) fn sixteen_bit(path: &str, linear: &Image) -> Result<Png, ExportError> {
    let mut image = linear.clone();
    let clipped = encode(&mut image);
    let (bytes, _) = raster::encode_png16(Path::new(path), &image, Levels::full_range(1.0))?;
    Ok(Png { bytes, clipped })
}

/// 8 bits: code = 255 × sRGB value, rounded.
pub(super) fn eight_bit(path: &str, linear: &Image) -> Result<Png, ExportError> {
    let mut image = linear.clone();
    let clipped = encode(&mut image);
    let code = |v: &f32| (v * 255.0).round() as u8;
    let codes: Vec<u8> = image.data().iter().map(code).collect();
    let (width, height) = (image.width(), image.height());
    let bytes = raster::encode_png8(Path::new(path), &codes, width, height, image.channels())?;
    Ok(Png { bytes, clipped })
}

fn encode(image: &mut Image) -> u64 {
    let mut clipped = 0;
    for value in image.data_mut() {
        clipped += u64::from(*value > 1.0);
        *value = srgb::from_linear(*value);
    }
    clipped
}
