//! `qpalgo disparity`: two pictures, or the views of a capture and their sum, in; the shift of each channel out, as
//! numbers and as a picture.
//!
//! ```text
//! d(x) = (where a point appears in the view) − (where it appears in the reference),     x in the reference
//! ```
//!
//! As in the dataset's specification: `disparity L R` is x_L − x_R, positive for points nearer than the focus.

mod files;

use crate::number::number;
use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::image::{Image, channel};

use crate::progress::Progress;
use crate::qpalgo::dense;
use crate::qpalgo::inputs::{CaptureArgs, MapFormatArg, PairArgs, in_file};
use crate::qpalgo::network::NetworkArgs;
use quadpixel_algorithms::capture::ViewPair;
use quadpixel_algorithms::disparity::{Axes, MatchSettings, match_images};
use quadpixel_algorithms::load;

use files::{files, report};

/// The only direction of a one-dimensional search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Direction {
    /// Left-right views, rectified stereo.
    Horizontal,
    /// Top-bottom views.
    Vertical,
}

/// Arguments of `qpalgo disparity`.
#[derive(Clone, Debug, Args)]
pub struct DisparityArgs {
    /// The view (EXR, PNG, TIFF). Without REFERENCE a capture (a sample's folder, a mosaic, an EXR with one layer per
    /// view): each of its views is matched against their sum.
    pub view: PathBuf,
    /// What the view is compared with, of the same size. The disparity is where a point appears in VIEW minus where it
    /// appears in REFERENCE, px, dx to the right, dy down; it stands at the point's place in REFERENCE.
    pub reference: Option<PathBuf>,
    #[command(flatten)]
    pub source: CaptureArgs,
    #[command(flatten)]
    pub pair: PairArgs,
    /// A number at every pixel: opposite views of a pixel that sees the pupil in parts, VIEW the left one. Expects
    /// their two different blurs; search, window and scale are found. Of a capture: of its left and right half (else
    /// top and bottom).
    #[arg(
        long,
        group = "every_pixel",
        conflicts_with_all = ["search", "window", "stride", "one_dimensional", "network"]
    )]
    dense: bool,
    #[command(flatten)]
    pub network: NetworkArgs,
    /// With --dense or --network: ratio of disparity to the blur's diameter, 0.01 to 0.424, small where a pixel
    /// hardly parts a narrow pupil; absent: by the capture's camera, or 0.25.
    #[arg(value_parser = number, long, requires = "every_pixel")]
    pub ratio: Option<f64>,
    /// Folder to write: disparity.FORMAT with dx, dy, sigma (px) and verdict (0: valid) per node, and
    /// disparity_CHANNEL.png.
    #[arg(long, short)]
    pub out: PathBuf,
    /// Largest shift looked for on each axis, px; beyond 4 from coarse to fine.
    #[arg(long, default_value_t = 4)]
    search: usize,
    /// Side of the window, px: odd, 5 to 31.
    #[arg(long, default_value_t = 21)]
    window: usize,
    /// Distance of the nodes, px.
    #[arg(long, default_value_t = 4)]
    stride: usize,
    /// Searches along one axis only; absent: along both.
    #[arg(long, value_enum, conflicts_with = "network")]
    one_dimensional: Option<Direction>,
    /// Kind of file for the numbers; NaN where not valid.
    #[arg(long, value_enum, default_value_t = MapFormatArg::Exr)]
    pub format: MapFormatArg,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

impl DisparityArgs {
    /// Whether every pixel gets a number.
    fn is_dense(&self) -> bool {
        self.dense || self.network.is_given()
    }
}

/// Matches each channel and writes the maps; no file is written before all are made.
pub fn run(args: &DisparityArgs, progress: Progress) -> Result<(), CommandError> {
    if args.reference.is_none() && !args.pair.is_empty() {
        return Err(CommandError::input(
            "--srgb, --black-level, --white-sheet and --crop are for two views, with REFERENCE",
        ));
    }
    if args.reference.is_some() && !args.source.is_empty() && !args.is_dense() {
        return Err(CommandError::input(
            "--subpixels, --camera and --meta are for a capture, without REFERENCE",
        ));
    }
    if args.is_dense() {
        return dense::run(args, progress);
    }
    let settings = MatchSettings {
        window_px: args.window,
        stride_px: args.stride,
        search_px: args.search,
        axes: match args.one_dimensional {
            None => Axes::Both,
            Some(Direction::Horizontal) => Axes::Horizontal,
            Some(Direction::Vertical) => Axes::Vertical,
        },
        ..MatchSettings::default()
    };
    progress.stage(format!("reading {}", args.view.display()));
    let pairs = match &args.reference {
        Some(reference) if args.pair.is_empty() => channel_pairs(&args.view, reference)?,
        Some(reference) => prepared_pairs(args, reference)?,
        None => args.source.read(&args.view)?.views_and_sum(),
    };
    let mut maps = Vec::with_capacity(pairs.len());
    for (index, pair) in pairs.iter().enumerate() {
        progress.stage(format!(
            "matching {} ({}/{})",
            pair.name,
            index + 1,
            pairs.len()
        ));
        // The library's d leads from the first picture to the second.
        let map = match_images(&pair.reference, &pair.view, &settings).map_err(|e| {
            CommandError::input(format!("{}, {}: {e}", args.view.display(), pair.name))
        })?;
        maps.push((pair.name.clone(), map));
    }
    progress.stage("encoding the maps");
    let files = files(args.format.into(), settings.axes, &maps).map_err(CommandError::failed)?;
    file::write_reports(&args.out, &files)?;
    drop(progress);
    report(args, &maps, &files)
}

/// The channels of two pictures.
fn channel_pairs(view: &Path, reference: &Path) -> Result<Vec<ViewPair>, CommandError> {
    let (a, names) = first_layer(view)?;
    let (b, _) = first_layer(reference)?;
    if load::size_of(&a) != load::size_of(&b) {
        return Err(CommandError::input(format!(
            "{}: {} where {} has {}: both must be of one size",
            reference.display(),
            load::size_of(&b),
            view.display(),
            load::size_of(&a)
        )));
    }
    Ok((names.into_iter().enumerate())
        .map(|(c, name)| ViewPair {
            name,
            view: channel(&a, c),
            reference: channel(&b, c),
        })
        .collect())
}

/// The channels of two pictures, black, sRGB and a white sheet taken out.
fn prepared_pairs(args: &DisparityArgs, reference: &Path) -> Result<Vec<ViewPair>, CommandError> {
    let [a, b] = args.pair.read(&args.view, reference)?;
    let names: &[&str] = match a.channels() {
        3 => &["R", "G", "B"],
        _ => &["Y"],
    };
    Ok((names.iter().enumerate())
        .map(|(c, name)| ViewPair {
            name: (*name).to_owned(),
            view: channel(&a, c),
            reference: channel(&b, c),
        })
        .collect())
}

fn first_layer(path: &Path) -> Result<(Image, Vec<String>), CommandError> {
    let layers = load::layers(path).map_err(CommandError::input)?;
    let layer = layers.into_iter().next();
    layer
        .map(|layer| (layer.image, layer.channels))
        .ok_or_else(|| in_file(path)("it holds no layer"))
}
