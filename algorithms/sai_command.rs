//! `qpalgo sai`: a mosaic in, one file a view and a sum out.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use datasets_spec::SampleMeta;
use quadpixel::file;
use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers};
use quadpixel::image::raster::{Levels, encode_png16};
use quadpixel::image::{Image, ImageError};

use crate::error::CommandError;
use crate::load;
use crate::sai::{Partition, Side, Views};

/// Kind of file to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// OpenEXR, 32-bit float: the sums are sums.
    Exr,
    /// PNG, 16 bits (1 or 3 channels): 65535 is 1 in a view, and in a sum the number of views in it.
    Png,
}

/// Arguments of `qpalgo sai`.
#[derive(Clone, Debug, Args)]
pub struct SaiArgs {
    /// Sub-pixel mosaic (EXR, PNG, TIFF); integers are read as 0 to 1 of their full scale.
    raw: PathBuf,
    /// Sub-pixels of a pixel, COLUMNSxROWS.
    #[arg(long, default_value = "2x2")]
    subpixels: String,
    /// Folder to write: view_NAME for each sub-pixel; sum_L, sum_R, sum_T, sum_B (where there are two sides) and sum_all.
    #[arg(long, short)]
    out: PathBuf,
    /// Kind of the files.
    #[arg(long, value_enum, default_value_t = Format::Exr)]
    format: Format,
    /// A sample's meta.json: takes the black and white level of a PNG mosaic from it, so that linear values come out.
    #[arg(long)]
    meta: Option<PathBuf>,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Writes the views and sums; no file is written before all are made.
pub fn run(args: &SaiArgs) -> Result<(), CommandError> {
    let partition: Partition = args
        .subpixels
        .parse()
        .map_err(|e| CommandError::input(format!("--subpixels: {e}")))?;
    let Some(first) = load::layers(&args.raw)?.into_iter().next() else {
        return Err(CommandError::input(format!(
            "{}: it holds no layer",
            args.raw.display()
        )));
    };
    let (mut mosaic, channels) = (first.image, first.channels);
    if let Some(meta) = &args.meta {
        linearise(&mut mosaic, meta)?;
    }
    let views = Views::of_mosaic(&mosaic, partition)
        .map_err(|e| CommandError::input(format!("{}: {e}", args.raw.display())))?;

    let mut files = Vec::new();
    let mut clipped = 0;
    let mut add = |name: String, image: &Image, added: usize| -> Result<(), CommandError> {
        let (name, bytes, lost) = encode(args.format, &name, image, &channels, added)?;
        clipped += lost;
        files.push((name, bytes));
        Ok(())
    };
    for (index, image) in views.images().iter().enumerate() {
        add(format!("view_{}", partition.name(index)), image, 1)?;
    }
    for side in Side::ALL {
        if let Some(sum) = views.sum(side) {
            let name = format!("sum_{}", side.name());
            add(name, &sum, partition.side(side).len())?;
        }
    }
    let failed = |e: file::FileError| CommandError::failed(e.to_string());
    file::create_folder(&args.out).map_err(failed)?;
    for (name, bytes) in &files {
        file::write_aside(&args.out.join(name), bytes).map_err(failed)?;
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    let (width, height) = (views.images()[0].width(), views.images()[0].height());
    if args.json {
        let object = serde_json::json!({
            "width": width, "height": height, "subpixels": partition.to_string(), "files": names, "clipped": clipped
        });
        println!("{object}");
    } else {
        println!("{}: {}", args.out.display(), names.join(" "));
        if clipped > 0 {
            eprintln!("{clipped} values outside of what a PNG holds were clipped");
        }
    }
    Ok(())
}

/// Name with its extension, bytes, and the number of values clipped.
fn encode(
    format: Format,
    name: &str,
    image: &Image,
    channels: &[String],
    added: usize,
) -> Result<(String, Vec<u8>, u64), CommandError> {
    let input = |e: ImageError| CommandError::input(e.to_string());
    match format {
        Format::Exr => {
            let name = format!("{name}.exr");
            let channels: Vec<&str> = channels.iter().map(String::as_str).collect();
            let layer = Layer {
                name: "",
                channels: &channels,
                image,
                sample: Sample::Float,
            };
            let bytes =
                encode_layers(Path::new(&name), &[layer], Compression::Zip).map_err(input)?;
            Ok((name, bytes, 0))
        }
        Format::Png => {
            let name = format!("{name}.png");
            let levels = Levels::full_range(added as f32);
            let (bytes, clipped) = encode_png16(Path::new(&name), image, levels).map_err(input)?;
            Ok((name, bytes, clipped))
        }
    }
}

/// Turns parts of the full scale of 16 bits into linear values, by the levels of the sample's `meta.json`.
pub(crate) fn linearise(mosaic: &mut Image, path: &Path) -> Result<(), CommandError> {
    let bad = |what: String| CommandError::input(format!("{}: {what}", path.display()));
    let bytes = file::read(path).map_err(|e| CommandError::input(e.to_string()))?;
    let meta: SampleMeta = serde_json::from_slice(&bytes).map_err(|e| bad(e.to_string()))?;
    let raw = meta.raw;
    let (Some(black), Some(white), Some(at_white)) =
        (raw.black_level, raw.white_level, raw.linear_at_white)
    else {
        return Ok(()); // an EXR mosaic is linear as it is
    };
    if white <= black {
        return Err(bad(format!(
            "raw: white_level {white} must be above black_level {black}"
        )));
    }
    let span = f64::from(white) - f64::from(black);
    for value in mosaic.data_mut() {
        *value = ((f64::from(*value) * 65535.0 - f64::from(black)) * at_white / span) as f32;
    }
    Ok(())
}
