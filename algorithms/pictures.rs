//! Pictures to be written: named, encoded in the kind that the user wants, and kept until all of them are made.

use std::path::Path;

use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers};
use quadpixel::image::raster::{Levels, encode_png16};
use quadpixel::image::{Image, ImageError};

/// Kind of file to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// OpenEXR, 32-bit float: linear, nothing clipped, the sums are sums.
    Exr,
    /// PNG, 16 bits (1 or 3 channels): 65535 is the mosaic's white in a view, and in a sum that times the views in it.
    Png,
}

/// Files of one command, with the names of their colour channels.
#[derive(Clone, Debug)]
pub struct Pictures {
    format: PictureFormat,
    channels: Vec<String>,
    /// Names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// Values that a PNG could not hold.
    pub clipped: u64,
}

impl Pictures {
    /// None yet.
    pub fn new(format: PictureFormat, channels: &[String]) -> Self {
        Self {
            format,
            channels: channels.to_vec(),
            files: Vec::new(),
            clipped: 0,
        }
    }

    /// Adds `image` as `name` with the format's extension; `white`: the value at a PNG's full code.
    ///
    /// # Errors
    /// The format cannot hold so many channels, or another number of channels than named.
    pub fn add(&mut self, name: &str, image: &Image, white: f64) -> Result<(), ImageError> {
        let (name, bytes) = match self.format {
            PictureFormat::Exr => {
                let name = format!("{name}.exr");
                let channels: Vec<&str> = self.channels.iter().map(String::as_str).collect();
                let bytes = encode_float(&name, &channels, image)?;
                (name, bytes)
            }
            PictureFormat::Png => {
                let name = format!("{name}.png");
                let levels = Levels::full_range(white as f32);
                let (bytes, clipped) = encode_png16(Path::new(&name), image, levels)?;
                self.clipped += clipped;
                (name, bytes)
            }
        };
        self.files.push((name, bytes));
        Ok(())
    }

    /// Names of the files.
    pub fn names(&self) -> Vec<&str> {
        self.files.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// What to tell the user of clipped values, if there are any.
    pub fn clipping(&self) -> Option<String> {
        (self.clipped > 0).then(|| {
            format!(
                "{} values outside of what a PNG holds were clipped",
                self.clipped
            )
        })
    }
}

/// An EXR of one unnamed layer of 32-bit floats; `name` is for messages only.
///
/// # Errors
/// Names that are not as many as the image's channels.
pub fn encode_float(name: &str, channels: &[&str], image: &Image) -> Result<Vec<u8>, ImageError> {
    let layer = Layer {
        name: "",
        channels,
        image,
        sample: Sample::Float,
    };
    encode_layers(Path::new(name), &[layer], Compression::Zip)
}
