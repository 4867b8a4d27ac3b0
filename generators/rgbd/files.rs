//! Numbers of a file as they are stored, and of what kind they are.

use std::io::{BufReader, Cursor};
use std::path::Path;

use image::{DynamicImage, ImageReader};
use quadpixel::file;
use quadpixel::image::exr::NamedLayer;
use quadpixel::image::raster::{FLOAT_BYTES, decoded};
use quadpixel::image::{Image, ImageError, maps};

/// Numbers of a picture or of its depth as they are stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    pub(super) image: Image,
    /// Names of the channels of an EXR; else numbers.
    pub(super) channels: Vec<String>,
    /// The largest that a whole number may be; `None` for floats.
    pub(super) full_scale: Option<f32>,
}

impl Stored {
    /// Numbers in memory; `full_scale`: the largest of their type for whole numbers, `None` for floats.
    pub fn array(image: Image, full_scale: Option<f32>) -> Self {
        let channels = (0..image.channels()).map(|c| c.to_string()).collect();
        Self {
            image,
            channels,
            full_scale,
        }
    }

    /// Hash of the numbers, 64 hexadecimal digits.
    fn hash(&self) -> String {
        let mut hash = blake3::Hasher::new();
        let size = [
            self.image.width(),
            self.image.height(),
            self.image.channels(),
        ];
        let scale = self.full_scale.unwrap_or(0.0);
        hash.update(format!("{size:?} {scale}").as_bytes());
        for part in self.image.data().chunks(4096) {
            let bytes: Vec<u8> = part.iter().flat_map(|v| v.to_le_bytes()).collect();
            hash.update(&bytes);
        }
        hash.finalize().to_hex().to_string()
    }

    /// What arrays are called where files have their names.
    pub(super) fn name(&self) -> String {
        format!("array-{}", &self.hash()[..16])
    }
}

/// Reads PNG, JPEG, TIFF, EXR, PFM or NPY, told apart by content; alpha is dropped.
pub(super) fn read(path: &Path) -> Result<Stored, ImageError> {
    let bytes = file::read(path)?;
    match bytes.as_slice() {
        [0x76, 0x2f, 0x31, 0x01, ..] | [b'P', b'f' | b'F', ..] => map(path, None),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => map(path, npy_full_scale(&bytes)),
        _ => picture(path, bytes),
    }
}

/// Columns and rows, by the header of a picture; other files are read whole.
pub(super) fn size(path: &Path) -> Result<(usize, usize), ImageError> {
    // A pipe is refused here: to open it would wait for who writes to it.
    let opened = BufReader::new(file::open(path)?);
    let header = ImageReader::new(opened).with_guessed_format();
    let size = header.ok().and_then(|reader| reader.into_dimensions().ok());
    if let Some((width, height)) = size {
        return Ok((width as usize, height as usize));
    }
    let stored = read(path)?;
    Ok((stored.image.width(), stored.image.height()))
}

fn map(path: &Path, full_scale: Option<f32>) -> Result<Stored, ImageError> {
    let layers: Vec<NamedLayer> = maps::read(path)?;
    let first = layers
        .into_iter()
        .next()
        .ok_or_else(|| ImageError::Decode {
            path: path.to_owned(),
            cause: "it holds no layer".into(),
        })?;
    Ok(Stored {
        image: first.image,
        channels: first.channels,
        full_scale,
    })
}

/// Of the type that an NPY's header names.
fn npy_full_scale(bytes: &[u8]) -> Option<f32> {
    let header = &bytes[..bytes.len().min(256)];
    let names = |kind: &[u8]| header.windows(kind.len()).any(|w| w == kind);
    let kinds: [(&[u8], f32); 5] = [
        (b"|u1'", 255.0),
        (b"u2'", 65535.0),
        (b"i2'", 32767.0),
        (b"u4'", u32::MAX as f32),
        (b"i4'", i32::MAX as f32),
    ];
    let kind = kinds.iter().find(|(kind, _)| names(kind));
    kind.map(|(_, full)| *full)
}

fn picture(path: &Path, bytes: Vec<u8>) -> Result<Stored, ImageError> {
    let failed = |cause: String| ImageError::Decode {
        path: path.to_owned(),
        cause,
    };
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|e| failed(e.to_string()))?;
    let (picture, _) = decoded(reader, FLOAT_BYTES).map_err(failed)?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let whole = |codes: Vec<u8>| codes.into_iter().map(f32::from).collect();
    let wide = |codes: Vec<u16>| codes.into_iter().map(f32::from).collect();
    let (channels, full_scale, data): (usize, Option<f32>, Vec<f32>) = match picture {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            (1, Some(255.0), whole(picture.into_luma8().into_raw()))
        }
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {
            (1, Some(65535.0), wide(picture.into_luma16().into_raw()))
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            (3, Some(65535.0), wide(picture.into_rgb16().into_raw()))
        }
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            (3, None, picture.into_rgb32f().into_raw())
        }
        other => (3, Some(255.0), whole(other.into_rgb8().into_raw())),
    };
    let image = Image::from_vec(width, height, channels, data);
    let image = image.ok_or_else(|| failed("its size does not match its data".into()))?;
    Ok(Stored::array(image, full_scale))
}
