//! EXR files that are written some rows at a time: packed block by block, put together at the end.

use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{self, BlockIndex, UncompressedBlock};
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::ChannelDescription;
use ::exr::meta::header::Header;
use ::exr::prelude as ex;
use rayon::prelude::*;
use tempfile::SpooledTempFile;

use super::{Compression, Image, ImageError, Sample, line, zip};
use crate::file::FileError;

/// Bytes of lines that are packed together, about.
const AT_ONCE: usize = 2 << 20;
/// Packed bytes that are kept in memory; more of them wait in a file.
const IN_MEMORY: usize = 8 << 20;

/// A layer of a file that is written row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerShape {
    /// Prefix of its channels; empty for none.
    pub name: String,
    /// One name a channel.
    pub channels: Vec<String>,
    /// How they are stored.
    pub sample: Sample,
}

/// An EXR file in the making. The bytes depend on the content alone, not on how many rows come at once.
pub struct ExrRows {
    path: PathBuf,
    header: Header,
    layers: Vec<LayerShape>,
    /// Layer and channel in it, in the order of the file.
    order: Vec<(usize, usize)>,
    /// Lines of the block that is not full yet.
    waiting: Vec<u8>,
    /// Rows that were taken.
    taken: usize,
    packed: SpooledTempFile,
    /// Of each packed block.
    lengths: Vec<usize>,
}

impl ExrRows {
    /// Begins a file of width × height pixels; `path` is for messages only. What waits does so in memory, or in a file
    /// without a name in `folder`.
    ///
    /// # Errors
    /// [`ImageError::Shape`] for no layer, no pixel, a name that is none or is given twice.
    pub fn new(
        path: &Path,
        folder: &Path,
        (width, height): (usize, usize),
        layers: Vec<LayerShape>,
        compression: Compression,
    ) -> Result<Self, ImageError> {
        let shape = |what: String| ImageError::Shape {
            path: path.to_path_buf(),
            what,
        };
        if layers.is_empty() || width == 0 || height == 0 {
            return Err(shape("no layer, or no pixel".into()));
        }
        let mut channels = Vec::new();
        for (number, layer) in layers.iter().enumerate() {
            for index in 0..layer.channels.len() {
                let name = layer.full_name(index);
                let text = ex::Text::new_or_none(&name)
                    .ok_or_else(|| shape(format!("{name:?} is no channel name")))?;
                channels.push((text, number, index));
            }
        }
        channels.sort_by(|a, b| a.0.cmp(&b.0));
        if let Some(pair) = channels.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(shape(format!("channel {} is given twice", pair[0].0)));
        }
        let described = channels.iter().map(|(name, layer, _)| {
            let kind = match layers[*layer].sample {
                Sample::Half => ex::SampleType::F16,
                Sample::Float => ex::SampleType::F32,
            };
            ChannelDescription::named(name.clone(), kind)
        });
        let header = Header::new(ex::Text::default(), (width, height), described.collect())
            .with_attributes(ex::LayerAttributes::default())
            .with_encoding(
                compression.into(),
                BlockDescription::ScanLines,
                ex::LineOrder::Increasing,
            );
        Ok(Self {
            path: path.to_path_buf(),
            order: channels.iter().map(|(_, l, c)| (*l, *c)).collect(),
            layers,
            header,
            waiting: Vec::new(),
            taken: 0,
            packed: tempfile::spooled_tempfile_in(IN_MEMORY, folder),
            lengths: Vec::new(),
        })
    }

    fn shape(&self, what: String) -> ImageError {
        ImageError::Shape {
            path: self.path.clone(),
            what,
        }
    }

    fn size(&self) -> (usize, usize) {
        let size = self.header.layer_size;
        (size.width(), size.height())
    }

    fn line_bytes(&self) -> usize {
        self.header.channels.bytes_per_pixel * self.size().0
    }

    /// Goes on with some rows, an image per layer.
    ///
    /// # Errors
    /// [`ImageError::Shape`] for images that do not fit or too many rows, [`ImageError::HalfOverflow`] for a value too
    /// large for half precision, [`ImageError::Encode`] for what the encoder refuses; the disk.
    pub fn rows(&mut self, images: &[&Image]) -> Result<(), ImageError> {
        let (width, height) = self.size();
        if images.len() != self.layers.len() {
            let what = format!("{} images for {} layers", images.len(), self.layers.len());
            return Err(self.shape(what));
        }
        let rows = images[0].height();
        for (layer, image) in self.layers.iter().zip(images) {
            if (image.width(), image.height()) != (width, rows) || self.taken + rows > height {
                let what = format!("layer {:?} is not {width} × {height}", layer.name);
                return Err(self.shape(what));
            }
            if image.channels() != layer.channels.len() {
                return Err(self.shape(format!(
                    "layer {:?} has {} channels and {} names",
                    layer.name,
                    image.channels(),
                    layer.channels.len()
                )));
            }
        }
        // Packed as they come, so that what waits stays in the caches.
        let at_once = self.block_bytes() * AT_ONCE.div_ceil(self.block_bytes());
        for row in 0..rows {
            self.wait(images, row)?;
            self.taken += 1;
            if self.waiting.len() >= at_once || self.taken == height {
                self.pack()?;
            }
        }
        Ok(())
    }

    /// Of a block of lines.
    fn block_bytes(&self) -> usize {
        self.header.max_block_pixel_size().height() * self.line_bytes()
    }

    /// Puts a row of the images among the waiting lines.
    fn wait(&mut self, images: &[&Image], row: usize) -> Result<(), ImageError> {
        for &(layer, channel) in &self.order {
            let image = images[layer];
            let length = image.width() * image.channels();
            let line = &image.data()[row * length..][..length];
            let place = (image.channels(), channel);
            match self.layers[layer].sample {
                Sample::Float => line::floats(line, place, &mut self.waiting),
                Sample::Half => {
                    let stored = line::halves(line, place, &mut self.waiting);
                    stored.map_err(|value| ImageError::HalfOverflow {
                        path: self.path.clone(),
                        channel: self.layers[layer].full_name(channel),
                        value,
                    })?;
                }
            }
        }
        Ok(())
    }

    /// Packs the blocks that are full, or the last.
    fn pack(&mut self) -> Result<(), ImageError> {
        let lines = self.header.max_block_pixel_size().height();
        let block = self.block_bytes();
        let full = match self.taken == self.size().1 {
            true => self.waiting.len(),
            false => self.waiting.len() / block * block,
        };
        let first = self.lengths.len();
        let packed: Vec<Vec<u8>> = (self.waiting[..full].par_chunks(block).enumerate())
            .map(|(k, data)| self.packed_block((first + k) * lines, data))
            .collect::<Result<_, _>>()?;
        for bytes in &packed {
            let written = self.packed.write_all(bytes);
            written.map_err(|cause| FileError::new(&self.path, "write", cause))?;
            self.lengths.push(bytes.len());
        }
        self.waiting.drain(..full);
        Ok(())
    }

    fn packed_block(&self, first_line: usize, data: &[u8]) -> Result<Vec<u8>, ImageError> {
        let deflated = [ex::Compression::ZIP1, ex::Compression::ZIP16];
        // The lines are as this machine has them, the file's bytes are little-endian.
        if deflated.contains(&self.header.compression) && cfg!(target_endian = "little") {
            let packed = zip::packed(data);
            return packed.map_err(|cause| self.encode_error(cause.into()));
        }
        let lines = data.len() / self.line_bytes();
        let block = UncompressedBlock {
            index: BlockIndex {
                layer: 0,
                pixel_position: ex::Vec2(0, first_line),
                pixel_size: ex::Vec2(self.size().0, lines),
                level: ex::Vec2(0, 0),
            },
            data: data.to_vec(),
        };
        let chunk = block.compress_to_chunk(std::slice::from_ref(&self.header));
        match chunk
            .map_err(|cause| self.encode_error(cause))?
            .compressed_block
        {
            CompressedBlock::ScanLine(block) => Ok(block.compressed_pixels_le),
            _ => Err(self.shape("is not of scan lines".into())),
        }
    }

    fn encode_error(&self, cause: ex::Error) -> ImageError {
        match cause {
            ex::Error::Io(cause) => FileError::new(&self.path, "write", cause).into(),
            cause => ImageError::Encode {
                path: self.path.clone(),
                cause: cause.to_string(),
            },
        }
    }

    /// Puts the file together.
    ///
    /// # Errors
    /// [`ImageError::Shape`] if rows are missing; what `write` says.
    pub fn finish(mut self, write: impl Write + Seek) -> Result<(), ImageError> {
        let (taken, height) = (self.taken, self.size().1);
        if taken != height {
            return Err(self.shape(format!("{taken} rows of {height}")));
        }
        let lines = self.header.max_block_pixel_size().height();
        let (packed, lengths) = (&mut self.packed, &self.lengths);
        let headers = std::iter::once(self.header.clone()).collect();
        let written = block::write(write, headers, true, |_, writer| {
            packed.seek(SeekFrom::Start(0))?;
            for (k, length) in lengths.iter().enumerate() {
                let mut bytes = vec![0; *length];
                packed.read_exact(&mut bytes)?;
                let block = CompressedScanLineBlock {
                    y_coordinate: (k * lines) as i32,
                    compressed_pixels_le: bytes,
                };
                let chunk = Chunk {
                    layer_index: 0,
                    compressed_block: CompressedBlock::ScanLine(block),
                };
                writer.write_chunk(k, chunk)?;
            }
            Ok(())
        });
        written.map_err(|cause| self.encode_error(cause))
    }
}

impl LayerShape {
    /// The name of a channel in the file.
    fn full_name(&self, channel: usize) -> String {
        match self.name.as_str() {
            "" => self.channels[channel].clone(),
            name => format!("{name}.{}", self.channels[channel]),
        }
    }
}

impl From<Compression> for ex::Compression {
    fn from(compression: Compression) -> Self {
        match compression {
            Compression::None => Self::Uncompressed,
            Compression::Rle => Self::RLE,
            Compression::Zips => Self::ZIP1,
            Compression::Zip => Self::ZIP16,
            Compression::Piz => Self::PIZ,
        }
    }
}
