//! Environment maps: equirectangular radiance from an OpenEXR or Radiance HDR file.

use std::io::Cursor;
use std::path::Path;

use super::ImportError;
use super::folder::read_limited;
use crate::image::Image;
use crate::image::exr::NamedLayer;
use crate::image::raster::{self, FLOAT_BYTES};

/// Reads an equirectangular panorama (`.exr` with channels R, G, B, or `.hdr`), linear, 3 channels.
///
/// # Errors
/// A file that cannot be read, of another kind, without R, G and B, or with a value that is negative or not finite.
pub fn read_panorama(path: &Path) -> Result<Image, ImportError> {
    let broken = |place: &str, what: String| ImportError::Broken {
        file: path.display().to_string(),
        place: place.into(),
        what,
    };
    let extension = path.extension().and_then(|e| e.to_str());
    let image = match extension.unwrap_or_default().to_ascii_lowercase().as_str() {
        "exr" => {
            let layers = crate::image::exr::read_layers(path)
                .map_err(|e| broken("picture", e.to_string()))?;
            rgb(layers).ok_or_else(|| broken("channels", "has no R, G and B".into()))?
        }
        "hdr" => {
            let bytes = read_limited(path)?;
            let reader =
                image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Hdr);
            let picture = raster::decoded(reader, FLOAT_BYTES).map_err(|e| broken("picture", e))?;
            let picture = picture.0.into_rgb32f();
            let (width, height) = (picture.width() as usize, picture.height() as usize);
            Image::from_vec(width, height, 3, picture.into_raw())
                .ok_or_else(|| broken("picture", "is not whole".into()))?
        }
        other => {
            return Err(broken(
                "extension",
                format!("is `{other}`; allowed: exr, hdr"),
            ));
        }
    };
    match image.data().iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
        Some(v) => Err(broken(
            "radiance",
            format!("{v}; allowed: finite, not negative"),
        )),
        None => Ok(image),
    }
}

/// The first layer with R, G and B, and of it these three.
fn rgb(layers: Vec<NamedLayer>) -> Option<Image> {
    let layer = layers
        .into_iter()
        .find(|l| l.channels.len() >= 3 && l.channels[..3] == ["R", "G", "B"])?;
    let image = layer.image;
    let texels = image.data().chunks_exact(image.channels());
    let data = texels.flat_map(|t| [t[0], t[1], t[2]]).collect();
    Image::from_vec(image.width(), image.height(), 3, data)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_panorama_of_10000_by_5000_is_read() {
        let (width, height) = (10_000_usize, 5_000);
        let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        // Each row the same: four planes of runs, mantissa 128 by exponent 129, so 1.
        let mut row = vec![2, 2, (width >> 8) as u8, width as u8];
        for value in [128, 128, 128, 129] {
            for first in (0..width).step_by(127) {
                row.extend([128 + (width - first).min(127) as u8, value]);
            }
        }
        let mut bytes = head.into_bytes();
        (0..height).for_each(|_| bytes.extend(&row));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.hdr");
        std::fs::write(&path, bytes).unwrap();
        let image = read_panorama(&path).unwrap();
        assert_eq!((image.width(), image.height()), (width, height));
        assert!(image.data().iter().all(|v| (*v - 1.0).abs() < 0.01));
    }
}
