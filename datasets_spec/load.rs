//! Reading the files of a dataset for checking: pictures as planes of f32 by channel name, from bytes in memory.

use std::collections::BTreeMap;
use std::io::Cursor;

use exr::prelude::{FlatSamples, MetaData, ReadChannels, ReadLayers};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::memory;
use crate::sample::Storage;

/// A picture: planes of equal size by channel name.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    pub width: usize,
    pub height: usize,
    pub storage: Storage,
    pub channels: BTreeMap<String, Vec<f32>>,
}

/// Decodes a PNG, JPEG or EXR by its name's ending; integers stay codes. The error is a clause for a finding.
pub(crate) fn decode(name: &str, bytes: &[u8]) -> Result<Planes, String> {
    match name.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "exr" => decode_exr(bytes),
        "png" => decode_raster(bytes, ImageFormat::Png),
        "jpg" => decode_raster(bytes, ImageFormat::Jpeg),
        other => Err(format!("unknown kind of file {other:?}")),
    }
}

fn decode_raster(bytes: &[u8], format: ImageFormat) -> Result<Planes, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.no_limits(); // the budget is the limit
    let decoder = reader.into_decoder().map_err(|cause| cause.to_string())?;
    let (width, height) = decoder.dimensions();
    // The codes, these as floats, and as planes.
    let values =
        u64::from(width) * u64::from(height) * u64::from(decoder.color_type().channel_count());
    let needed = decoder
        .total_bytes()
        .saturating_add(values.saturating_mul(8));
    memory::check(format!("a picture of {width} × {height} px"), needed)
        .map_err(|e| e.to_string())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|cause| cause.to_string())?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let (storage, names): (_, &[&str]) = match picture.color() {
        ColorType::L8 => (Storage::Uint8, &["Y"]),
        ColorType::Rgb8 => (Storage::Uint8, &["R", "G", "B"]),
        ColorType::L16 => (Storage::Uint16, &["Y"]),
        ColorType::Rgb16 => (Storage::Uint16, &["R", "G", "B"]),
        other => return Err(format!("{other:?} is not used in this layout")),
    };
    let codes: Vec<f32> = match picture {
        DynamicImage::ImageLuma16(codes) => codes.into_raw().into_iter().map(f32::from).collect(),
        DynamicImage::ImageRgb16(codes) => codes.into_raw().into_iter().map(f32::from).collect(),
        other => other.into_bytes().into_iter().map(f32::from).collect(),
    };
    let plane = |index| {
        codes
            .iter()
            .skip(index)
            .step_by(names.len())
            .copied()
            .collect()
    };
    let named = |(index, name): (usize, &&str)| ((*name).to_string(), plane(index));
    Ok(Planes {
        width,
        height,
        storage,
        channels: names.iter().enumerate().map(named).collect(),
    })
}

fn decode_exr(bytes: &[u8]) -> Result<Planes, String> {
    // A garbled header may ask for more memory than there is; no compression in use packs tighter than 1 : 1100.
    let headers = MetaData::read_from_buffered(bytes, false)
        .map_err(|cause| cause.to_string())?
        .headers;
    let asked = headers.iter().map(|header| {
        (header.layer_size.width() as u128)
            * (header.layer_size.height() as u128)
            * (header.channels.bytes_per_pixel as u128)
    });
    let asked = asked.sum::<u128>();
    if asked > 1100 * bytes.len() as u128 {
        return Err("its header asks for more pixels than it holds".into());
    }
    // The samples, and these as floats.
    let needed = u64::try_from(asked.saturating_mul(3)).unwrap_or(u64::MAX);
    memory::check("an EXR picture", needed).map_err(|e| e.to_string())?;
    let file = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|cause| cause.to_string())?;
    let [part] = file.layer_data.as_slice() else {
        return Err(format!("{} parts instead of one", file.layer_data.len()));
    };
    let (width, height) = (part.size.width(), part.size.height());
    let mut storage = None;
    let mut channels = BTreeMap::new();
    for channel in &part.channel_data.list {
        let own = match channel.sample_data {
            FlatSamples::F16(_) => Storage::Half,
            FlatSamples::F32(_) => Storage::Float,
            FlatSamples::U32(_) => return Err("integer samples".into()),
        };
        if storage.is_some_and(|first| first != own) {
            return Err("half and float samples are mixed".into());
        }
        storage = Some(own);
        let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
        if values.len() != width * height {
            return Err(format!("channel {} is sub-sampled", channel.name));
        }
        channels.insert(channel.name.to_string(), values);
    }
    let storage = storage.ok_or("it has no channel")?;
    Ok(Planes {
        width,
        height,
        storage,
        channels,
    })
}
