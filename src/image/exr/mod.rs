//! OpenEXR files with named layers: linear floats with no transfer function.
//!
//! Layers of one size lie in a single part as channel names with a prefix (`A.R`, `A.G`, `A.B`), which every reader
//! understands; an unnamed layer's channels have no prefix (`R`, `G`, `B`). The bytes depend on the content alone: no
//! date, no host, one thread.

use std::io::Cursor;
use std::path::Path;

use ::exr::prelude as ex;
use ::exr::prelude::{ReadChannels, ReadLayers};

use super::{Image, ImageError};
use crate::{file, memory};

mod line;
mod rows;
mod zip;

pub use rows::{ExrRows, LayerShape};

/// How a layer's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// 16 bit: 11 significant bits, at most 65504.
    Half,
    /// 32 bit.
    Float,
}

/// How the scan lines are packed; all of them lossless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all: fastest.
    None,
    /// Run lengths: for masks and constant maps.
    Rle,
    /// Deflate over single lines.
    Zips,
    /// Deflate over blocks of 16 lines.
    Zip,
    /// Wavelet and Huffman over blocks of 32 lines: for noisy half images.
    Piz,
}

/// A layer to be written.
#[derive(Clone, Debug)]
pub struct Layer<'a> {
    /// Prefix of its channels; empty for none.
    pub name: &'a str,
    /// One name a channel of `image`.
    pub channels: &'a [&'a str],
    /// The numbers.
    pub image: &'a Image,
    /// How they are stored.
    pub sample: Sample,
}

/// A layer that was read; channels R, G, B (A) stand in that order, any others in the order of their names.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLayer {
    /// Prefix of its channels; empty for none.
    pub name: String,
    /// One name a channel of `image`.
    pub channels: Vec<String>,
    /// The numbers.
    pub image: Image,
}

/// Writes layers of equal size to one file.
///
/// Errors: no layer, unequal sizes, a name used twice, a finite value that half precision cannot hold, a disk error.
///
/// # Errors
/// As [`encode_layers`], and the disk.
pub fn write_layers(
    path: &Path,
    layers: &[Layer<'_>],
    compression: Compression,
) -> Result<(), ImageError> {
    Ok(file::write_aside(
        path,
        &encode_layers(path, layers, compression)?,
    )?)
}

/// The bytes of [`write_layers`]; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Shape`] for layers that do not fit each other, [`ImageError::HalfOverflow`] for a value too large for
/// half precision, [`ImageError::Encode`] for what the encoder refuses.
pub fn encode_layers(
    path: &Path,
    layers: &[Layer<'_>],
    compression: Compression,
) -> Result<Vec<u8>, ImageError> {
    let first = layers.first().ok_or_else(|| ImageError::Shape {
        path: path.to_path_buf(),
        what: "no layer".into(),
    })?;
    let shapes = layers.iter().map(|layer| LayerShape {
        name: layer.name.to_owned(),
        channels: layer.channels.iter().map(|c| (*c).to_owned()).collect(),
        sample: layer.sample,
    });
    let size = (first.image.width(), first.image.height());
    let waiting = std::env::temp_dir();
    let mut rows = ExrRows::new(path, &waiting, size, shapes.collect(), compression)?;
    let images: Vec<&Image> = layers.iter().map(|layer| layer.image).collect();
    rows.rows(&images)?;
    let mut bytes = Cursor::new(Vec::new());
    rows.finish(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Reads every layer of a file, all samples as f32 (exact for half and float). Layers stand in the order of their
/// names.
///
/// Errors: not an EXR file, a truncated one, deep data, sub-sampled channels.
///
/// # Errors
/// A file that cannot be read, and as [`decode_layers`].
pub fn read_layers(path: &Path) -> Result<Vec<NamedLayer>, ImageError> {
    decode_layers(path, &file::read(path)?)
}

/// The layers of a file's bytes, as [`read_layers`]; `path` is for messages only.
///
/// # Errors
/// [`ImageError::Decode`] for what is no EXR file of such layers.
pub fn decode_layers(path: &Path, bytes: &[u8]) -> Result<Vec<NamedLayer>, ImageError> {
    let decode = |cause: String| ImageError::Decode {
        path: path.to_path_buf(),
        cause,
    };
    // A garbled header may ask for more memory than there is; no compression here packs tighter than 1 : 1100.
    let headers = ex::MetaData::read_from_buffered(bytes, false)
        .map_err(|cause| decode(cause.to_string()))?
        .headers;
    let asked = headers.iter().map(|header| {
        (header.layer_size.width() as u128)
            * (header.layer_size.height() as u128)
            * (header.channels.bytes_per_pixel as u128)
    });
    let asked = asked.sum::<u128>();
    if asked > 1100 * bytes.len() as u128 {
        return Err(decode(
            "its header asks for more pixels than it holds".into(),
        ));
    }
    // The samples, these as floats, and these in the order of an image.
    let needed = u64::try_from(asked.saturating_mul(5)).unwrap_or(u64::MAX);
    memory::check("an EXR picture", needed).map_err(|e| decode(e.to_string()))?;
    let file = ::exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|cause| decode(cause.to_string()))?;
    let mut layers = Vec::new();
    for part in &file.layer_data {
        let part_name = part.attributes.layer_name.as_ref().map(ToString::to_string);
        let (width, height) = (part.size.width(), part.size.height());
        let mut groups: Vec<(String, Vec<Channel>)> = Vec::new();
        for channel in &part.channel_data.list {
            let full = channel.name.to_string();
            let (prefix, short) = full.rsplit_once('.').unwrap_or(("", &full));
            let name = match (&part_name, prefix) {
                (Some(part), "") => part.clone(),
                (Some(part), prefix) => format!("{part}.{prefix}"),
                (None, prefix) => prefix.to_string(),
            };
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            if values.len() != width * height {
                return Err(decode(format!("channel {full} is sub-sampled")));
            }
            match groups.iter_mut().find(|group| group.0 == name) {
                Some(group) => group.1.push((short.to_string(), values)),
                None => groups.push((name, vec![(short.to_string(), values)])),
            }
        }
        for (name, mut channels) in groups {
            if channels.iter().all(|(name, _)| rgb_rank(name).is_some()) {
                channels.sort_by_key(|(name, _)| rgb_rank(name));
            }
            layers.push(interleave(name, channels, width, height));
        }
    }
    layers.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(layers)
}

/// A channel's short name and its samples.
type Channel = (String, Vec<f32>);

fn rgb_rank(name: &str) -> Option<usize> {
    ["R", "G", "B", "A"].iter().position(|&known| known == name)
}

fn interleave(name: String, channels: Vec<Channel>, width: usize, height: usize) -> NamedLayer {
    let count = channels.len();
    let mut image = Image::zeros(width, height, count);
    for (index, (_, values)) in channels.iter().enumerate() {
        let target = image.data_mut().iter_mut().skip(index).step_by(count);
        target.zip(values).for_each(|(to, from)| *to = *from);
    }
    NamedLayer {
        name,
        channels: channels.into_iter().map(|(name, _)| name).collect(),
        image,
    }
}

#[cfg(test)]
mod tests;
