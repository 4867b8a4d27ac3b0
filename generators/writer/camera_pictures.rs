//! Camera-like pictures of the sum and of the views.

use std::path::Path;

use quadpixel::image::{Image, ImageError, raster};
use quadpixel_datasets::CameraPictures;

/// The bytes of a picture of `tiles`, `columns` of them in a row, each multiplied by `gain` first.
///
/// # Errors
/// What the encoder refuses.
pub(super) fn encode(
    path: &Path,
    how: &CameraPictures,
    (tiles, columns): (&[Image], usize),
    gain: f64,
) -> Result<Vec<u8>, ImageError> {
    let (width, height) = (tiles[0].width(), tiles[0].height());
    let rows = tiles.len() / columns;
    let mut codes = Vec::with_capacity(3 * width * height * tiles.len());
    for y in 0..rows * height {
        for x in 0..columns * width {
            let tile = &tiles[y / height * columns + x / width];
            let pixel = tile.pixel(x % width, y % height);
            let linear = std::array::from_fn(|c| gain * f64::from(pixel[c]));
            codes.extend(how.development.codes(linear));
        }
    }
    let size = (columns * width, rows * height);
    match how.jpeg_quality {
        Some(quality) => raster::encode_jpeg(path, &codes, size.0, size.1, quality),
        None => raster::encode_png8(path, &codes, size.0, size.1, 3),
    }
}
