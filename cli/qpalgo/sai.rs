//! `qpalgo sai`: a mosaic in, one file per view and a sum out.

use crate::outln;
use crate::print::say;
use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel::file;

use crate::progress::Progress;
use crate::qpalgo::inputs::{CaptureArgs, PictureFormatArg};
use quadpixel_algorithms::pictures::Pictures;
use quadpixel_algorithms::sai::Side;

/// Arguments of `qpalgo sai`.
#[derive(Clone, Debug, Args)]
pub struct SaiArgs {
    /// Sub-pixel mosaic (EXR, PNG, TIFF), EXR with one layer per view, or a sample's folder; integers are read as 0 to
    /// 1 of their full scale where no description of the camera says otherwise.
    raw: PathBuf,
    #[command(flatten)]
    source: CaptureArgs,
    /// Folder to write: view_NAME for each sub-pixel; sum_L, sum_R, sum_T, sum_B (where there are two sides) and
    /// sum_all.
    #[arg(long, short)]
    out: PathBuf,
    /// Kind of the files.
    #[arg(long, value_enum, default_value_t = PictureFormatArg::Exr)]
    format: PictureFormatArg,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Writes the views and sums; no file is written before all are made.
pub fn run(args: &SaiArgs, progress: Progress) -> Result<(), CommandError> {
    progress.stage(format!("reading {}", args.raw.display()));
    let capture = args.source.read(&args.raw)?;
    let (views, subpixels) = (&capture.views, capture.views.subpixels());
    progress.stage("encoding the views and their sums");
    let mut pictures = Pictures::new(args.format.into(), &capture.channels);
    for (index, image) in views.images().iter().enumerate() {
        let name = format!("view_{}", subpixels.name(index));
        (pictures.add(&name, image, capture.white)).map_err(CommandError::input)?;
    }
    for side in Side::ALL {
        if let Some(sum) = views.sum(side) {
            let white = capture.white * side.members(subpixels).len() as f64;
            let name = format!("sum_{}", side.name());
            (pictures.add(&name, &sum, white)).map_err(CommandError::input)?;
        }
    }
    file::write_reports(&args.out, &pictures.files)?;
    drop(progress);
    let names = pictures.names();
    let [width, height] = capture.size_px();
    if args.json {
        let object = serde_json::json!({
            "width": width, "height": height, "subpixels": subpixels.to_string(), "files": names,
            "clipped": pictures.clipped
        });
        outln!("{object}");
        return Ok(());
    }
    outln!("{}: {}", args.out.display(), names.join(" "));
    outln!("{subpixels} views of {width} × {height} pixels");
    if let Some(text) = pictures.clipping() {
        say(&text);
    }
    Ok(())
}
