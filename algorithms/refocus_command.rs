//! `qpalgo refocus`: a mosaic in, one image out that is focused at another disparity.

use std::path::PathBuf;

use clap::Args;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};

use crate::error::CommandError;
use crate::load;
use crate::refocus::{RefocusError, refocus};
use crate::sai::{Partition, Views};
use crate::warp::Lobes;

/// Arguments of `qpalgo refocus`.
#[derive(Clone, Debug, Args)]
pub struct RefocusArgs {
    /// Sub-pixel mosaic (EXR, PNG, TIFF); integers are read as 0 to 1 of their full scale.
    raw: PathBuf,
    /// Sub-pixels of a pixel, COLUMNSxROWS.
    #[arg(long, default_value = "2x2")]
    subpixels: String,
    /// Left-right disparity (x_L − x_R), px, of what shall be sharp; above 0: nearer than the focus.
    #[arg(long, allow_negative_numbers = true)]
    disparity: f64,
    /// Weight of each view in index order (2x2: B,A,D,C), parted by commas; absent: all equal. Moves the bokeh.
    #[arg(long, value_delimiter = ',')]
    weights: Option<Vec<f64>>,
    /// Lobes of the Lanczos kernel, 3 or 4.
    #[arg(long, default_value_t = 4)]
    lobes: u8,
    /// EXR to write (32-bit float).
    #[arg(long, short)]
    out: PathBuf,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Writes the refocused image.
pub fn run(args: &RefocusArgs) -> Result<(), CommandError> {
    let lobes = match args.lobes {
        3 => Lobes::Three,
        4 => Lobes::Four,
        other => {
            return Err(CommandError::input(format!(
                "--lobes: {other} is not 3 or 4"
            )));
        }
    };
    let partition: Partition = args
        .subpixels
        .parse()
        .map_err(|e| CommandError::input(format!("--subpixels: {e}")))?;
    let name = args.raw.display().to_string();
    let Some(first) = load::layers(&args.raw)?.into_iter().next() else {
        return Err(CommandError::input(format!("{name}: it holds no layer")));
    };
    let views = Views::of_mosaic(&first.image, partition)
        .map_err(|e| CommandError::input(format!("{name}: {e}")))?;
    let done = refocus(&views, args.disparity, args.weights.as_deref(), lobes)
        .map_err(|e: RefocusError| CommandError::input(format!("--{e}")))?;
    let channels: Vec<&str> = first.channels.iter().map(String::as_str).collect();
    let layer = Layer {
        name: "",
        channels: &channels,
        image: &done.image,
        sample: Sample::Float,
    };
    write_layers(&args.out, &[layer], Compression::Zip)
        .map_err(|e| CommandError::failed(e.to_string()))?;
    let valid = done.valid.iter().filter(|v| **v).count() as f64 / done.valid.len() as f64;
    if args.json {
        let object = serde_json::json!({
            "width": done.image.width(), "height": done.image.height(), "disparity_px": args.disparity,
            "valid_fraction": valid, "out": args.out.display().to_string()
        });
        println!("{object}");
    } else {
        println!(
            "{} ({:.1} % of it from all views)",
            args.out.display(),
            100.0 * valid
        );
    }
    Ok(())
}
