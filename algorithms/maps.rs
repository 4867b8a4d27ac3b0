//! Maps of numbers (disparity, depth, confidence) as files: EXR, NumPy's NPY and PFM, written and read.
//!
//! PFM (Debevec): `Pf` or `PF`, columns rows, a scale whose sign says the byte order (negative: little-endian), then
//! rows from the bottom up. NaN stands for "no value" in all three.

use std::io::Cursor;
use std::path::Path;

use ndarray::{ArrayD, IxDyn};
use ndarray_npy::WriteNpyExt;
use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers};
use quadpixel::image::{Image, ImageError};

pub use quadpixel::image::maps::read;

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
