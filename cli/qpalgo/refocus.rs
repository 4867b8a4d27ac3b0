//! `qpalgo refocus`: a mosaic in, one image out that is focused at another disparity.

use crate::number::number;
use crate::outln;
use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel::file;

use crate::progress::Progress;
use crate::qpalgo::inputs::CaptureArgs;
use quadpixel_algorithms::pictures::encode_float;
use quadpixel_algorithms::refocus::{RefocusError, refocus};
use quadpixel_algorithms::warp::Lobes;

/// Arguments of `qpalgo refocus`.
#[derive(Clone, Debug, Args)]
pub struct RefocusArgs {
    /// Sub-pixel mosaic (EXR, PNG, TIFF), EXR with one layer per view, or a sample's folder; integers are read as 0 to
    /// 1 of their full scale where no description of the camera says otherwise.
    raw: PathBuf,
    #[command(flatten)]
    source: CaptureArgs,
    /// Left-right disparity (x_L − x_R), px, of what shall be sharp; above 0: nearer than the focus. At most the views'
    /// longer side, to either side.
    #[arg(value_parser = number, long, allow_negative_numbers = true)]
    disparity: f64,
    /// Weight of each view in index order (2x2: B,A,D,C), separated by commas, such as 1,0,1,0; absent: all equal.
    /// Moves the bokeh.
    #[arg(value_parser = number, long, value_delimiter = ',')]
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
pub fn run(args: &RefocusArgs, progress: Progress) -> Result<(), CommandError> {
    let lobes = match args.lobes {
        3 => Lobes::Three,
        4 => Lobes::Four,
        other => {
            return Err(CommandError::input(format!(
                "--lobes: {other} is not 3 or 4"
            )));
        }
    };
    progress.stage(format!("reading {}", args.raw.display()));
    let capture = args.source.read(&args.raw)?;
    progress.stage("shifting and adding the views");
    let done = refocus(
        &capture.views,
        args.disparity,
        args.weights.as_deref(),
        lobes,
    )
    .map_err(|e: RefocusError| CommandError::input(format!("--{e}")))?;
    let channels: Vec<&str> = capture.channels.iter().map(String::as_str).collect();
    let out = args.out.display().to_string();
    let bytes = encode_float(&out, &channels, &done.image).map_err(CommandError::failed)?;
    file::write_aside(&args.out, &bytes)?;
    drop(progress);
    let valid = done.valid.iter().filter(|v| **v).count() as f64 / done.valid.len() as f64;
    if args.json {
        let object = serde_json::json!({
            "width": done.image.width(), "height": done.image.height(), "disparity_px": args.disparity,
            "valid_fraction": valid, "out": out
        });
        outln!("{object}");
    } else {
        outln!("{out} ({:.1} % of it from all views)", 100.0 * valid);
    }
    Ok(())
}
