//! Maps of numbers (disparity, depth, confidence) read from files: EXR, NumPy's NPY, PFM, or any picture.
//!
//! PFM (Debevec): `Pf` or `PF`, columns rows, a scale whose sign says the byte order (negative: little-endian), then
//! rows from the bottom up. NaN stands for "no value" in all three.

use std::path::Path;

use ndarray::{ArrayD, IxDyn};
use ndarray_npy::{ViewElement, ViewNpyError};

use super::exr::{NamedLayer, read_layers};
use super::{Image, ImageError, raster};
use crate::{file, npy};

/// Reads maps: the layers of an EXR, a NPY of f32, f64 or whole numbers (rows, columns), with channels behind or maps
/// before them too, a PFM, or any picture.
///
/// What has no name in the file is called by its number: channels `0`, `1`, …, and so the maps of an NPY. NaN is
/// allowed.
///
/// # Errors
/// The file cannot be read, or is of none of these kinds.
pub fn read(path: &Path) -> Result<Vec<NamedLayer>, ImageError> {
    let bytes = file::read(path)?;
    let image = match bytes.as_slice() {
        [0x76, 0x2f, 0x31, 0x01, ..] => return read_layers(path),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => return read_npy(path, &bytes),
        [b'P', b'f' | b'F', b'\n' | b' ' | b'\r' | b'\t', ..] => read_pfm(path, &bytes)?,
        _ => raster::read(path)?,
    };
    Ok(vec![numbered(String::new(), image)])
}

/// A layer whose channels are called by their numbers.
fn numbered(name: String, image: Image) -> NamedLayer {
    NamedLayer {
        name,
        channels: (0..image.channels()).map(|c| c.to_string()).collect(),
        image,
    }
}

fn decode_error(path: &Path, cause: impl ToString) -> ImageError {
    ImageError::Decode {
        path: path.to_path_buf(),
        cause: cause.to_string(),
    }
}

fn read_npy(path: &Path, bytes: &[u8]) -> Result<Vec<NamedLayer>, ImageError> {
    // A view first takes the header's size against the file's, so that a garbled one asks for no memory.
    let array = numbers(path, bytes)?;
    let (maps, height, width, channels) = match *array.shape() {
        [h, w] => (None, h, w, 1),
        [h, w, c] => (None, h, w, c),
        [m, h, w, c] => (Some(m), h, w, c),
        _ => {
            let shape = array.shape();
            let text = format!(
                "shape {shape:?}: allowed are (rows, columns), then channels, and maps before them"
            );
            return Err(decode_error(path, text));
        }
    };
    // In logical order, also where the file is in Fortran's.
    let numbers: Vec<f32> = array.iter().copied().collect();
    let size = height * width * channels;
    if size == 0 || numbers.is_empty() {
        return Err(decode_error(path, "it holds no number"));
    }
    (numbers.chunks_exact(size).enumerate())
        .map(|(map, data)| {
            let name = maps.map_or(String::new(), |_| map.to_string());
            Image::from_vec(width, height, channels, data.to_vec())
                .map(|image| numbered(name, image))
                .ok_or_else(|| decode_error(path, "its size does not match its data"))
        })
        .collect()
}

/// The array of any kind of number that f32 can stand for.
fn numbers(path: &Path, bytes: &[u8]) -> Result<ArrayD<f32>, ImageError> {
    fn of<T: ViewElement + Copy>(
        bytes: &[u8],
        to: fn(T) -> f32,
    ) -> Option<Result<ArrayD<f32>, String>> {
        match npy::view::<T, IxDyn>(bytes) {
            Ok(array) => Some(Ok(array.mapv(to))),
            Err(ViewNpyError::WrongDescriptor(_)) => None,
            Err(error) => Some(Err(error.to_string())),
        }
    }
    of::<f32>(bytes, |v| v)
        .or_else(|| of::<f64>(bytes, |v| v as f32))
        .or_else(|| of::<u8>(bytes, f32::from))
        .or_else(|| of::<u16>(bytes, f32::from))
        .or_else(|| of::<i16>(bytes, f32::from))
        .or_else(|| of::<i32>(bytes, |v| v as f32))
        .or_else(|| of::<u32>(bytes, |v| v as f32))
        .unwrap_or_else(|| Err("NPY of f32, f64 or whole numbers of 8 to 32 bits".into()))
        .map_err(|e| decode_error(path, e))
}

fn read_pfm(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    let bad = |cause: &str| decode_error(path, cause);
    let mut rest = bytes;
    let mut word = || {
        let end = rest.iter().position(u8::is_ascii_whitespace)?;
        let (head, tail) = rest.split_at(end);
        rest = &tail[1..]; // exactly one byte of white space parts the header's words
        std::str::from_utf8(head).ok()
    };
    let header = "PFM: the header is not Pf or PF, columns, rows, scale";
    let channels = match word() {
        Some("Pf") => 1,
        Some("PF") => 3,
        _ => return Err(bad(header)),
    };
    let mut size = || word().and_then(|w| w.parse::<usize>().ok());
    let (Some(width), Some(height)) = (size(), size()) else {
        return Err(bad(header));
    };
    let scale = word().and_then(|w| w.parse::<f64>().ok());
    let Some(scale) = scale.filter(|s| s.is_finite() && *s != 0.0) else {
        return Err(bad(header));
    };
    let count = (width.checked_mul(height)).and_then(|n| n.checked_mul(channels));
    if count.and_then(|n| n.checked_mul(4)) != Some(rest.len()) || rest.is_empty() {
        return Err(bad("PFM: its size does not match its data"));
    }
    let number = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if scale < 0.0 {
            f32::from_le_bytes(bytes)
        } else {
            f32::from_be_bytes(bytes)
        }
    };
    let rows = rest.chunks_exact(4 * width * channels).rev();
    let data = rows.flat_map(|row| row.chunks_exact(4)).map(number);
    Image::from_vec(width, height, channels, data.collect())
        .ok_or_else(|| bad("PFM: its size does not match its data"))
}
