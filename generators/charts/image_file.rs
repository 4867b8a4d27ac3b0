//! Any image file as a chart.
//!
//! Code values are read as sRGB (8 and 16 bit) or linear (float TIFF); transparent parts show a grey of 0.2. The
//! largest centred square is cropped and resampled in linear light to the asked side by a triangle filter, as wide as
//! the coarser grid.

use super::error::{ChartError, side};
use image::{ColorType, DynamicImage, ImageReader, Rgb32FImage, imageops};
use quadpixel::file;
use quadpixel::image::raster::decoded;
use quadpixel::image::srgb::to_linear;
use quadpixel::scene::texture::Texture;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::Cursor;
use std::path::PathBuf;

/// Reflectance behind transparent parts.
const BACKDROP: f32 = 0.2;
/// What is made of a pixel: RGBA and RGB as floats, and the picture turned and cut.
const BYTES_PER_PIXEL: u64 = 4 * 4 + 4 * 3 + 2 * 8;

/// Parameters of the `image` chart; it does not depend on the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageFile {
    /// A PNG, JPEG or TIFF file of at most 16384 pixels per side.
    pub path: PathBuf,
}

impl ImageFile {
    pub(super) fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        side(size_px)?;
        let image = self.square()?;
        let size = size_px as u32;
        let image = if image.width() == size {
            image
        } else {
            imageops::resize(&image, size, size, imageops::FilterType::Triangle)
        };
        let texels = image.as_raw();
        Ok(Texture::from_fn(size_px, size_px, |x, y| {
            let i = 3 * (y * size_px + x);
            [texels[i], texels[i + 1], texels[i + 2]]
        })?)
    }

    /// The centred square in linear light, 0..=1.
    fn square(&self) -> Result<Rgb32FImage, ChartError> {
        let image = self.decoded()?;
        let side = image.width().min(image.height());
        let image = image.crop_imm(
            (image.width() - side) / 2,
            (image.height() - side) / 2,
            side,
            side,
        );
        let linear = matches!(image.color(), ColorType::Rgb32F | ColorType::Rgba32F);
        let rgba = image.into_rgba32f();
        let mut out = Rgb32FImage::new(side, side);
        out.par_chunks_mut(3)
            .zip(rgba.par_chunks(4))
            .for_each(|(out, texel)| {
                for (out, &v) in out.iter_mut().zip(texel) {
                    let v = if linear { v } else { to_linear(v) };
                    *out = BACKDROP + (unit(v) - BACKDROP) * unit(texel[3]);
                }
            });
        Ok(out)
    }

    fn decoded(&self) -> Result<DynamicImage, ChartError> {
        let fail = |reason: String| ChartError::File {
            path: self.path.clone(),
            reason,
        };
        let bytes =
            file::read(&self.path).map_err(|e| fail(format!("cannot be read: {}", e.cause)))?;
        let reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| fail(format!("cannot be read: {e}")))?;
        let not_an_image =
            |e: String| fail(format!("is not a readable PNG, JPEG or TIFF image: {e}"));
        let (mut image, orientation) = decoded(reader, BYTES_PER_PIXEL).map_err(not_an_image)?;
        let (width, height) = (image.width(), image.height());
        if width.max(height) as usize > Texture::MAX_SIDE_PX {
            return Err(fail(format!(
                "is {width}×{height}, too large: at most {} pixels a side",
                Texture::MAX_SIDE_PX
            )));
        }
        if width == 0 || height == 0 {
            return Err(fail("is an empty image".into()));
        }
        image.apply_orientation(orientation);
        Ok(image)
    }
}

/// The value within 0..=1; NaN, which a float TIFF may hold, becomes 0.
fn unit(value: f32) -> f32 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    }
}

/// Whether the name of a chart is the path of an image file.
pub(crate) fn is_image(name: &str) -> bool {
    let extension = std::path::Path::new(name)
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    ["png", "jpg", "jpeg", "tif", "tiff"].contains(&extension.as_str())
}
