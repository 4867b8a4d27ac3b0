//! PNG, JPEG and TIFF: integer pictures.
//!
//! A linear value v is stored in 16 bits as `code = black + v (white − black) / linear_at_white`, rounded; codes
//! outside 0..=65535 are clipped and counted, never silently.

use std::io::{BufRead, Cursor, Seek};
use std::path::Path;

use ::image::codecs::jpeg::JpegEncoder;
use ::image::metadata::Orientation;
use ::image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader};
use rayon::prelude::*;

use super::png_rows::{self, PngShape, big_endian};
use super::{Image, ImageError, exr};
use crate::{file, memory};

/// The line that ties linear values to 16-bit codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Code of the linear value 0.
    pub black: u16,
    /// Code of the linear value `linear_at_white`; above `black`.
    pub white: u16,
    /// The linear value at `white`.
    pub linear_at_white: f32,
}

/// Values that are coded at a time.
const BLOCK: usize = 1024;

impl Levels {
    /// Code 0 is 0 and code 65535 is `linear_at_white`.
    pub fn full_range(linear_at_white: f32) -> Self {
        Self {
            black: 0,
            white: u16::MAX,
            linear_at_white,
        }
    }

    /// The linear value of a code.
    pub fn linear(&self, code: u16) -> f32 {
        let span = f64::from(self.white) - f64::from(self.black);
        ((f64::from(code) - f64::from(self.black)) * f64::from(self.linear_at_white) / span) as f32
    }

    /// How many values are beyond the codes that there are, so that each is stored as the nearest of them.
    pub fn clipped(&self, values: &[f32]) -> u64 {
        let (black, gain) = (f64::from(self.black), self.gain());
        let beside = |values: &[f32]| {
            let codes = values.iter().map(|v| half_up(black, gain, *v));
            u64::from(codes.map(is_beside).sum::<u32>())
        };
        values.par_chunks(BLOCK).map(beside).sum()
    }

    /// Codes of linear values, and how many were clipped.
    ///
    /// # Errors
    /// Says why: a white level that is not above the black one, NaN.
    pub fn codes(&self, values: &[f32]) -> Result<(Vec<u16>, u64), &'static str> {
        let gain = self.gain();
        if !(gain > 0.0 && gain.is_finite()) {
            return Err("the white level must be above the black level");
        }
        let black = f64::from(self.black);
        let mut codes = vec![0; values.len()];
        let (mut clipped, mut is_nan) = (0u64, false);
        for (codes, values) in codes.chunks_mut(BLOCK).zip(values.chunks(BLOCK)) {
            let mut beside = 0u32;
            for (to, value) in codes.iter_mut().zip(values) {
                let code = half_up(black, gain, *value);
                beside += is_beside(code);
                is_nan |= code.is_nan();
                *to = code.clamp(0.0, 65535.0) as i32 as u16;
            }
            clipped += u64::from(beside);
        }
        if is_nan {
            return Err("NaN cannot be stored as an integer");
        }
        Ok((codes, clipped))
    }

    fn gain(&self) -> f64 {
        (f64::from(self.white) - f64::from(self.black)) / f64::from(self.linear_at_white)
    }
}

/// A value's code and half of one more, as what is behind the point is dropped.
#[inline(always)]
fn half_up(black: f64, gain: f64, value: f32) -> f64 {
    black + f64::from(value) * gain + 0.5
}

/// 1: such a code is clipped.
#[inline(always)]
fn is_beside(half_up: f64) -> u32 {
    u32::from(half_up < 0.0) + u32::from(half_up >= 65536.0)
}

/// Writes a 16-bit PNG (1 channel: gray, 3: RGB) and returns the number of values that were clipped.
///
/// Errors: NaN, another number of channels, levels without a positive slope, a disk error.
///
/// # Errors
/// As [`encode_png16`], and the disk.
pub fn write_png16(path: &Path, image: &Image, levels: Levels) -> Result<u64, ImageError> {
    let (bytes, clipped) = encode_png16(path, image, levels)?;
    file::write_aside(path, &bytes)?;
    Ok(clipped)
}

/// The bytes of [`write_png16`] and its count; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Shape`] for other than one or three channels or a white level that is not above the black one,
/// [`ImageError::Encode`] for what the encoder refuses.
pub fn encode_png16(
    path: &Path,
    image: &Image,
    levels: Levels,
) -> Result<(Vec<u8>, u64), ImageError> {
    let shape = |what: &str| ImageError::Shape {
        path: path.to_path_buf(),
        what: what.to_string(),
    };
    let (codes, clipped) = levels.codes(image.data()).map_err(shape)?;
    let shape = PngShape {
        width: image.width(),
        height: image.height(),
        channels: image.channels(),
        bits: 16,
    };
    Ok((png_rows::encode(path, shape, &big_endian(&codes))?, clipped))
}

/// Writes an 8-bit PNG from codes, row-major, interleaved (1 channel: gray, 3: RGB).
///
/// # Errors
/// As [`encode_png8`], and the disk.
pub fn write_png8(
    path: &Path,
    codes: &[u8],
    width: usize,
    height: usize,
    channels: usize,
) -> Result<(), ImageError> {
    let bytes = encode_png8(path, codes, width, height, channels)?;
    Ok(file::write_aside(path, &bytes)?)
}

/// The bytes of [`write_png8`]; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Shape`] for codes that do not fill the size, [`ImageError::Encode`] for what the encoder refuses.
pub fn encode_png8(
    path: &Path,
    codes: &[u8],
    width: usize,
    height: usize,
    channels: usize,
) -> Result<Vec<u8>, ImageError> {
    let shape = PngShape {
        width,
        height,
        channels,
        bits: 8,
    };
    png_rows::encode(path, shape, codes)
}

/// The bytes of a 16-bit grey PNG of whole numbers; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Shape`] for codes that do not fill the size, [`ImageError::Encode`] for what the encoder refuses.
pub fn encode_gray16(
    path: &Path,
    codes: &[u16],
    width: usize,
    height: usize,
) -> Result<Vec<u8>, ImageError> {
    let shape = PngShape {
        width,
        height,
        channels: 1,
        bits: 16,
    };
    png_rows::encode(path, shape, &big_endian(codes))
}

/// Writes a JPEG from sRGB codes, row-major RGB; `quality` 1 to 100.
///
/// # Errors
/// As [`encode_jpeg`], and the disk.
pub fn write_jpeg(
    path: &Path,
    rgb: &[u8],
    width: usize,
    height: usize,
    quality: u8,
) -> Result<(), ImageError> {
    let bytes = encode_jpeg(path, rgb, width, height, quality)?;
    Ok(file::write_aside(path, &bytes)?)
}

/// The bytes of [`write_jpeg`]; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Shape`] for codes that do not fill the size, [`ImageError::Encode`] for what the encoder refuses.
pub fn encode_jpeg(
    path: &Path,
    rgb: &[u8],
    width: usize,
    height: usize,
    quality: u8,
) -> Result<Vec<u8>, ImageError> {
    check_length(path, rgb, width, height, ExtendedColorType::Rgb8)?;
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(rgb, width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(|cause| encode_error(path, &cause))?;
    Ok(bytes)
}

fn encode_error(path: &Path, cause: &::image::ImageError) -> ImageError {
    ImageError::Encode {
        path: path.to_path_buf(),
        cause: cause.to_string(),
    }
}

fn check_length(
    path: &Path,
    codes: &[u8],
    width: usize,
    height: usize,
    colour: ExtendedColorType,
) -> Result<(), ImageError> {
    let bytes_a_pixel = usize::from(colour.bits_per_pixel()) / 8;
    let fits = |n: usize| (1..=u32::MAX as usize).contains(&n);
    if fits(width) && fits(height) && codes.len() == width * height * bytes_a_pixel {
        return Ok(());
    }
    Err(ImageError::Shape {
        path: path.to_path_buf(),
        what: format!("{} bytes are not {width} × {height} pixels", codes.len()),
    })
}

/// Reads PNG (8 or 16 bit), JPEG, TIFF (also float) or EXR (its unnamed layer, else its first), told apart by content.
///
/// Integers are divided by their full scale; the transfer function is not undone (see [`super::srgb`]). Gray gives 1
/// channel, colour 3; alpha is dropped.
///
/// # Errors
/// A file that cannot be read, or is no picture of a known kind.
pub fn read(path: &Path) -> Result<Image, ImageError> {
    let bytes = file::read(path)?;
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        let layers = exr::read_layers(path)?;
        return layers
            .into_iter()
            .next()
            .map(|layer| layer.image)
            .ok_or(ImageError::Decode {
                path: path.to_path_buf(),
                cause: "it holds no layer".into(),
            });
    }
    let decode = |cause: String| ImageError::Decode {
        path: path.to_path_buf(),
        cause,
    };
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|cause| decode(cause.to_string()))?;
    let picture = decoded(reader, FLOAT_BYTES).map_err(decode)?.0;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let (channels, data) = if picture.color().has_color() {
        (3, rgb_of(picture))
    } else {
        (1, gray_of(picture))
    };
    Image::from_vec(width, height, channels, data)
        .ok_or_else(|| decode("its size does not match its data".into()))
}

/// Bytes that a value of a picture takes as a float, in colour: three per pixel.
pub const FLOAT_BYTES: u64 = 12;

/// Decodes a picture, if there is memory for it and for `more_per_pixel` bytes that are made of each pixel; and how it
/// is to be turned.
///
/// # Errors
/// What is wrong with the picture, or more memory than is allowed.
pub fn decoded<R: BufRead + Seek>(
    mut reader: ImageReader<R>,
    more_per_pixel: u64,
) -> Result<(DynamicImage, Orientation), String> {
    reader.no_limits(); // the budget is the limit
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width).saturating_mul(u64::from(height));
    let more = pixels.saturating_mul(more_per_pixel);
    let needed = decoder.total_bytes().saturating_add(more);
    let what = format!("a picture of {width} × {height} px");
    memory::check(what, needed).map_err(|e| e.to_string())?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    Ok((picture, orientation))
}

fn rgb_of(picture: DynamicImage) -> Vec<f32> {
    picture.into_rgb32f().into_raw()
}

fn gray_of(picture: DynamicImage) -> Vec<f32> {
    match picture {
        DynamicImage::ImageLuma8(codes) => unit(codes.into_raw(), 255.0),
        DynamicImage::ImageLuma16(codes) => unit(codes.into_raw(), 65535.0),
        other => unit(other.into_luma16().into_raw(), 65535.0),
    }
}

fn unit<T: Into<f32>>(codes: Vec<T>, full_scale: f32) -> Vec<f32> {
    codes
        .into_iter()
        .map(|code| code.into() / full_scale)
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn sixteen_bit_codes_follow_the_black_and_white_levels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("raw.png");
        let values = vec![0.0, 0.25, 0.5, 1.0, 2.0, -0.5];
        let image = Image::from_vec(2, 3, 1, values).unwrap();
        let levels = Levels {
            black: 1000,
            white: 61000,
            linear_at_white: 1.0,
        };
        let clipped = write_png16(&path, &image, levels).unwrap();
        assert_eq!(clipped, 2); // 2.0 above 65535 and −0.5 below 0
        let read = read(&path).unwrap();
        let codes: Vec<u16> = read
            .data()
            .iter()
            .map(|v| (v * 65535.0).round() as u16)
            .collect();
        assert_eq!(codes, [1000, 16000, 31000, 61000, 65535, 0]);
        assert_eq!(levels.linear(16000), 0.25);
    }

    #[test]
    fn nan_and_levels_without_a_slope_are_refused() {
        let path = Path::new("raw.png");
        let nan = Image::from_vec(1, 1, 1, vec![f32::NAN]).unwrap();
        assert!(encode_png16(path, &nan, Levels::full_range(1.0)).is_err());
        let one = Image::from_vec(1, 1, 1, vec![1.0]).unwrap();
        assert!(encode_png16(path, &one, Levels::full_range(0.0)).is_err());
        assert!(encode_png16(path, &one, Levels::full_range(f32::NAN)).is_err());
    }

    #[test]
    fn eight_bit_colour_keeps_its_order_and_a_wrong_length_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png8(&path, &[255, 0, 0, 0, 0, 51], 2, 1, 3).unwrap();
        assert_eq!(read(&path).unwrap().data(), [1.0, 0.0, 0.0, 0.0, 0.0, 0.2]);
        assert!(write_png8(&path, &[0; 5], 2, 1, 3).is_err());
        let jpeg = folder.path().join("a.jpg");
        write_jpeg(&jpeg, &[128; 48], 4, 4, 90).unwrap();
        let gray = read(&jpeg).unwrap();
        assert!(gray.data().iter().all(|v| (v - 128.0 / 255.0).abs() < 0.01));
    }

    #[test]
    fn tiff_float_comes_back_as_written_and_garbage_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        let values = vec![0.5f32, 1.5, -2.0, 0.0, 4.0, 8.0];
        let picture = ::image::Rgb32FImage::from_raw(2, 1, values.clone()).unwrap();
        DynamicImage::ImageRgb32F(picture).save(&path).unwrap();
        assert_eq!(read(&path).unwrap().data(), values);
        std::fs::write(&path, b"II*\0garbage").unwrap();
        assert!(matches!(read(&path), Err(ImageError::Decode { .. })));
        assert!(matches!(
            read(&folder.path().join("none")),
            Err(ImageError::File(_))
        ));
    }
}
