//! Maps of numbers (disparity, depth, confidence) as files: EXR, NumPy's NPY and PFM, written and read.
//!
//! PFM (Debevec): `Pf` or `PF`, columns rows, a scale whose sign says the byte order (negative: little-endian), then
//! rows from the bottom up. NaN stands for "no value" in all three.

use std::io::Cursor;
use std::path::Path;

use ndarray::{ArrayD, ArrayViewD, IxDyn};
use ndarray_npy::{ViewNpyError, ViewNpyExt, WriteNpyExt};
use quadpixel::file;
use quadpixel::image::exr::{Compression, Layer, NamedLayer, Sample, encode_layers, read_layers};
use quadpixel::image::{Image, ImageError, raster};

/// Kind of file for numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// OpenEXR, 32-bit float: one layer per map, named channels.
    Exr,
    /// NumPy: f32 of shape (maps, rows, columns, channels); axes of a single unnamed map and of a single channel are
    /// left out.
    Npy,
    /// Portable float map: one file per map, its one channel as gray or its first three as red, green, blue.
    Pfm,
}

/// Maps of one size to be written together, each with a name (empty where there is but one) and the same channels.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    /// File name without its extension.
    pub stem: &'a str,
    /// Names of the channels.
    pub channels: &'a [&'a str],
    /// Name and numbers of each map.
    pub maps: &'a [(String, Image)],
}

impl Maps<'_> {
    /// The files' names and contents.
    ///
    /// # Errors
    /// No map, or numbers that the format cannot hold.
    pub fn encode(&self, format: MapFormat) -> Result<Vec<(String, Vec<u8>)>, ImageError> {
        match format {
            MapFormat::Exr => {
                let layers: Vec<Layer<'_>> = (self.maps.iter())
                    .map(|(name, image)| Layer {
                        name,
                        channels: self.channels,
                        image,
                        sample: Sample::Float,
                    })
                    .collect();
                let name = format!("{}.exr", self.stem);
                let bytes = encode_layers(Path::new(&name), &layers, Compression::Zip)?;
                Ok(vec![(name, bytes)])
            }
            MapFormat::Npy => {
                let name = format!("{}.npy", self.stem);
                let bytes = self.npy(&name)?;
                Ok(vec![(name, bytes)])
            }
            MapFormat::Pfm => Ok((self.maps.iter())
                .map(|(map, image)| {
                    let parted = if map.is_empty() { "" } else { "_" };
                    let map = map.replace('.', "_");
                    (format!("{}{parted}{map}.pfm", self.stem), pfm(image))
                })
                .collect()),
        }
    }

    fn npy(&self, name: &str) -> Result<Vec<u8>, ImageError> {
        let bad = |cause: String| ImageError::Encode {
            path: name.into(),
            cause,
        };
        let Some((first_name, first)) = self.maps.first() else {
            return Err(bad("no map".to_owned()));
        };
        let mut shape = vec![first.height(), first.width()];
        if !first_name.is_empty() {
            shape.insert(0, self.maps.len());
        }
        if first.channels() > 1 {
            shape.push(first.channels());
        }
        let numbers = (self.maps.iter()).flat_map(|(_, image)| image.data().iter().copied());
        let array = ArrayD::from_shape_vec(IxDyn(&shape), numbers.collect())
            .map_err(|e| bad(e.to_string()))?;
        let mut bytes = Vec::new();
        array
            .write_npy(Cursor::new(&mut bytes))
            .map_err(|e| bad(e.to_string()))?;
        Ok(bytes)
    }
}

/// Rows from the bottom up, little-endian; more than three channels are cut, two are filled up with NaN.
fn pfm(image: &Image) -> Vec<u8> {
    let (width, height) = (image.width(), image.height());
    let (kind, stored) = if image.channels() == 1 {
        ("Pf", 1)
    } else {
        ("PF", 3)
    };
    let mut bytes = format!("{kind}\n{width} {height}\n-1.0\n").into_bytes();
    for y in (0..height).rev() {
        for x in 0..width {
            let pixel = image.pixel(x, y).iter().copied();
            let filled = pixel.chain(std::iter::repeat(f32::NAN)).take(stored);
            bytes.extend(filled.flat_map(f32::to_le_bytes));
        }
    }
    bytes
}

/// Reads maps: the layers of an EXR, a NPY of f32 or f64 (rows, columns), with channels behind or maps before them too,
/// a PFM, or any picture.
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
    let array = match ArrayViewD::<f32>::view_npy(bytes) {
        Ok(array) => array.to_owned(),
        Err(ViewNpyError::WrongDescriptor(_)) => ArrayViewD::<f64>::view_npy(bytes)
            .map_err(|e| decode_error(path, format!("NPY of f32 or f64 numbers: {e}")))?
            .mapv(|v| v as f32),
        Err(error) => return Err(decode_error(path, error)),
    };
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn map(channels: usize) -> Image {
        let data = (0..5 * 3 * channels).map(|i| i as f32 - 7.5).collect();
        let mut image = Image::from_vec(5, 3, channels, data).unwrap();
        image.pixel_mut(4, 1)[0] = f32::NAN;
        image
    }

    fn bits(image: &Image) -> Vec<u32> {
        image.data().iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn every_format_reads_back_as_written_nan_included() {
        let folder = tempfile::tempdir().unwrap();
        for channels in [1, 3] {
            let names = &["x", "y", "z"][..channels];
            let maps = [(String::new(), map(channels))];
            for format in [MapFormat::Exr, MapFormat::Npy, MapFormat::Pfm] {
                let maps = Maps {
                    stem: "m",
                    channels: names,
                    maps: &maps,
                };
                for (name, bytes) in maps.encode(format).unwrap() {
                    let path = folder.path().join(name);
                    std::fs::write(&path, bytes).unwrap();
                    let read = read(&path).unwrap();
                    assert_eq!(bits(&read[0].image), bits(&map(channels)), "{path:?}");
                    assert_eq!(read[0].image.width(), 5);
                }
            }
        }
    }

    #[test]
    fn several_maps_of_an_npy_read_as_layers_by_number() {
        let folder = tempfile::tempdir().unwrap();
        let maps = [("R".to_owned(), map(4)), ("G".to_owned(), map(4))];
        let maps = Maps {
            stem: "m",
            channels: &["a", "b", "c", "d"],
            maps: &maps,
        };
        for (name, bytes) in maps.encode(MapFormat::Npy).unwrap() {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let read = read(&path).unwrap();
            assert_eq!((read.len(), read[1].name.as_str()), (2, "1"));
            assert_eq!(bits(&read[1].image), bits(&map(4)));
        }
    }

    #[test]
    fn a_big_endian_pfm_and_an_npy_in_fortran_order_read_right() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let mut bytes = b"Pf 2 2 1.0\n".to_vec();
        for v in [3.0f32, 4.0, 1.0, 2.0] {
            bytes.extend(v.to_be_bytes()); // the lowest row first
        }
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(read(&path).unwrap()[0].image.data(), [1.0, 2.0, 3.0, 4.0]);

        let mut header = "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 2), }".to_owned();
        header += &" ".repeat(128 - 10 - header.len() - 1);
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend([1.0f64, 3.0, 2.0, 4.0].iter().flat_map(|v| v.to_le_bytes()));
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(read(&path).unwrap()[0].image.data(), [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn broken_files_are_errors_that_name_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken");
        for bytes in [
            &b""[..],
            b"Pf\n2 2\n-1.0\n1234",
            b"Pf\n2 -2\n-1.0\n1234",
            b"Pf\n2 2\n0\n1234123412341234",
            b"PF\n99999999999 99999999999\n-1\n",
            b"\x93NUMPY\x01\x00\x76\x00{",
            b"\x93NUMPY\x01\x00\x46\x00{'descr': '<f4', 'fortran_order': False, 'shape': (999999999999, 9), }\n    ",
        ] {
            std::fs::write(&path, bytes).unwrap();
            let text = read(&path).unwrap_err().to_string();
            assert!(text.contains("broken"), "{text}");
        }
    }
}
