//! A texture as an sRGB picture, to look at.

use super::error::ChartError;
use image::{ImageFormat, RgbImage};
use quadpixel::scene::color::srgb8_from_linear;
use quadpixel::scene::texture::Texture;
use std::fs;
use std::path::Path;

/// Writes `texture` as an 8-bit sRGB PNG (values above 1 become white); written aside and renamed. The error names the file.
pub fn write_png(texture: &Texture, path: &Path) -> Result<(), ChartError> {
    let fail = |reason: String| ChartError::File {
        path: path.to_path_buf(),
        reason: format!("cannot be written: {reason}"),
    };
    let picture = RgbImage::from_fn(texture.width() as u32, texture.height() as u32, |x, y| {
        image::Rgb(texture.texel(x as usize, y as usize).map(srgb8_from_linear))
    });
    let mut aside = path.as_os_str().to_owned();
    aside.push(format!(".tmp-{}", std::process::id()));
    let written = picture
        .save_with_format(&aside, ImageFormat::Png)
        .map_err(|e| fail(e.to_string()))
        .and_then(|()| fs::rename(&aside, path).map_err(|e| fail(e.to_string())));
    if written.is_err() {
        // The file may not be there; the first error is the one to tell.
        let _ = fs::remove_file(&aside);
    }
    written
}
