//! Float images: row-major, channels interleaved, row 0 at the top as stored (see [`crate::frames`]), and their files:
//! [`exr`] for linear floats, [`maps`] for numbers, [`raster`] for PNG, JPEG and TIFF, [`srgb`] for the transfer
//! function between them, [`colour`] for numbers as colours, [`views`] for a sub-pixel mosaic taken apart.

pub mod colour;
pub mod exr;
pub mod maps;
mod png_rows;
mod ranges;
pub mod raster;
pub mod srgb;
pub mod views;

pub use png_rows::{PngRows, PngShape};
pub use ranges::finite_ranges;

use std::path::PathBuf;

use rayon::prelude::*;

use crate::file::FileError;

/// A picture that could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file's content is not what its format asks for.
    #[error("{}: not a readable picture: {cause}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        cause: String,
    },
    /// The encoder refused.
    #[error("{}: cannot be encoded: {cause}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The encoder's reason.
        cause: String,
    },
    /// The picture does not fit the format.
    #[error("{}: {what}", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// What does not fit, and what would.
        what: String,
    },
    /// A finite value above 65504 was to be stored in half precision.
    #[error("{}: channel {channel}: {value} does not fit half precision (at most 65504)", path.display())]
    HalfOverflow {
        /// The file.
        path: PathBuf,
        /// The channel.
        channel: String,
        /// The value.
        value: f32,
    },
}

/// A `height × width × channels` image of f32, linear unless said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<f32>,
}

/// Values that are looked at together.
const LOOKED_AT: usize = 1 << 14;

impl Image {
    /// Whether any value is so.
    pub fn any(&self, is: impl Fn(f32) -> bool + Sync) -> bool {
        // All of a part, which goes by lanes.
        let part = |values: &[f32]| values.iter().map(|v| u32::from(is(*v))).sum::<u32>() > 0;
        self.data.par_chunks(LOOKED_AT).any(part)
    }

    /// An image of zeros.
    pub fn zeros(width: usize, height: usize, channels: usize) -> Self {
        Self {
            width,
            height,
            channels,
            data: vec![0.0; width * height * channels],
        }
    }

    /// Wraps `data` (row-major, interleaved); `None` when its length is not width × height × channels.
    pub fn from_vec(width: usize, height: usize, channels: usize, data: Vec<f32>) -> Option<Self> {
        (data.len() == width * height * channels).then_some(Self {
            width,
            height,
            channels,
            data,
        })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }
    /// Channels a pixel.
    pub fn channels(&self) -> usize {
        self.channels
    }
    /// All samples, row-major, interleaved.
    pub fn data(&self) -> &[f32] {
        &self.data
    }
    /// All samples, mutable.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
    /// The channels of pixel (column, row).
    #[inline]
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        let i = (y * self.width + x) * self.channels;
        &self.data[i..i + self.channels]
    }
    /// The channels of pixel (column, row), mutable.
    #[inline]
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        let i = (y * self.width + x) * self.channels;
        &mut self.data[i..i + self.channels]
    }
}

/// Each row of all of some images of one height.
pub(crate) fn rows_of(images: &mut [Image]) -> Vec<Vec<&mut [f32]>> {
    let height = images.first().map_or(0, Image::height);
    let mut rows: Vec<Vec<&mut [f32]>> = (0..height).map(|_| Vec::new()).collect();
    for image in images {
        let length = (image.width * image.channels).max(1);
        let all = rows.iter_mut().zip(image.data.chunks_exact_mut(length));
        all.for_each(|(row, values)| row.push(values));
    }
    rows
}

/// One channel of `image` as a picture of its own.
pub fn channel(image: &Image, index: usize) -> Image {
    let mut plane = Image::zeros(image.width(), image.height(), 1);
    let from = image.data().iter().skip(index).step_by(image.channels());
    (plane.data_mut().iter_mut().zip(from)).for_each(|(to, v)| *to = *v);
    plane
}
