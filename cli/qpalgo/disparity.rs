//! `qpalgo disparity`: two pictures, or the views of a capture and their sum, in; the shift of each channel out, as
//! numbers and as a picture.
//!
//! ```text
//! d(x) = (where a point appears in the view) − (where it appears in the reference),     x in the reference
//! ```
//!
//! As in the dataset's specification: `disparity L R` is x_L − x_R, positive for points nearer than the focus.

use crate::number::number;
use crate::outln;
use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::image::colour::{Rgb, blue_white_red, direction};
use quadpixel::image::raster::encode_png8;
use quadpixel::image::{Image, ImageError, channel};

use crate::progress::Progress;
use crate::qpalgo::dense;
use crate::qpalgo::inputs::{CaptureArgs, MapFormatArg, PairArgs, in_file};
use crate::qpalgo::network::NetworkArgs;
use quadpixel_algorithms::capture::ViewPair;
use quadpixel_algorithms::disparity::{
    Axes, DisparityMap, Match, MatchSettings, Verdict, match_images,
};
use quadpixel_algorithms::load;
use quadpixel_algorithms::maps::{MapFormat, Maps};

/// Numbers a node, in this order, in every format but PFM, which has the first three.
const NUMBERS: [&str; 4] = ["dx", "dy", "sigma", "verdict"];

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

type Named = (String, DisparityMap);
type Files = Vec<(String, Vec<u8>)>;

fn files(format: MapFormat, axes: Axes, maps: &[Named]) -> Result<Files, ImageError> {
    let images: Vec<(String, Image)> = (maps.iter())
        .map(|(name, map)| (name.clone(), numbers(map)))
        .collect();
    let numbers = Maps {
        stem: "disparity",
        channels: &NUMBERS,
        maps: &images,
    };
    let mut files = numbers.encode(format)?;
    for (name, map) in maps {
        let name = format!("disparity_{}.png", name.replace('.', "_"));
        let (codes, width, height) = picture(axes, map);
        let bytes = encode_png8(Path::new(&name), &codes, width, height, 3)?;
        files.push((name, bytes));
    }
    Ok(files)
}

/// [`NUMBERS`] of all nodes.
fn numbers(map: &DisparityMap) -> Image {
    let mut image = Image::zeros(map.grid.columns, map.grid.rows, NUMBERS.len());
    let nodes = image.data_mut().chunks_exact_mut(NUMBERS.len());
    for (to, m) in nodes.zip(&map.matches) {
        let numbers = [
            m.dx_px,
            m.dy_px,
            m.deviation_px(),
            f64::from(m.verdict as u8),
        ];
        to.copy_from_slice(&numbers.map(|v| v as f32));
    }
    image
}

/// Longest valid shift, px; `None` where there is none.
fn largest(map: &DisparityMap) -> Option<f64> {
    (map.matches.iter())
        .filter(|m| m.verdict == Verdict::Valid)
        .map(|m| m.dx_px.hypot(m.dy_px))
        .reduce(f64::max)
}

/// The map in colours, a square of the stride's side a node, with its width and height: along one axis from blue
/// (negative) over white (0) to red (positive), on both direction as hue and length as saturation; full colour at the
/// longest shift, black where not valid.
fn picture(axes: Axes, map: &DisparityMap) -> (Vec<u8>, usize, usize) {
    let longest = largest(map).filter(|&l| l > 0.0).unwrap_or(1.0);
    let signed = |shift: f64| blue_white_red((0.5 + 0.5 * shift / longest) as f32);
    let colour = |m: &Match| -> Rgb {
        match axes {
            _ if m.verdict != Verdict::Valid => [0; 3],
            Axes::Horizontal => signed(m.dx_px),
            Axes::Vertical => signed(m.dy_px),
            Axes::Both => direction([m.dx_px, m.dy_px], m.dx_px.hypot(m.dy_px) / longest),
        }
    };
    let (columns, side) = (map.grid.columns, map.grid.stride_px);
    let mut codes = Vec::with_capacity(map.grid.len() * side * side * 3);
    for row in map.matches.chunks(columns) {
        let line: Vec<u8> = (row.iter().map(colour))
            .flat_map(|rgb| rgb.repeat(side))
            .collect();
        (0..side).for_each(|_| codes.extend(&line));
    }
    (codes, columns * side, map.grid.rows * side)
}

fn report(args: &DisparityArgs, maps: &[Named], files: &Files) -> Result<(), CommandError> {
    let file_names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    let grid = maps.first().map(|(_, map)| map.grid);
    if args.json {
        let channels: Vec<_> = (maps.iter())
            .map(|(name, map)| {
                let verdicts: serde_json::Map<String, serde_json::Value> = (Verdict::ALL.iter())
                    .map(|v| (v.name().to_owned(), map.count(*v).into()))
                    .collect();
                let [dx, dy, sigma] = medians(map);
                serde_json::json!({
                    "channel": name, "nodes": map.grid.len(), "verdicts": verdicts,
                    "median_dx_px": dx, "median_dy_px": dy, "median_sigma_px": sigma,
                    "largest_px": largest(map),
                })
            })
            .collect();
        let grid = grid.map(|g| {
            serde_json::json!({
                "columns": g.columns, "rows": g.rows, "first_px": g.first_px, "stride_px": g.stride_px
            })
        });
        let object = serde_json::json!({ "files": file_names, "grid": grid, "channels": channels });
        outln!("{object}");
        return Ok(());
    }
    outln!("{}: {}", args.out.display(), file_names.join(" "));
    if let Some(g) = grid {
        outln!(
            "{} × {} nodes, at pixel {}, {}, … of both axes",
            g.columns,
            g.rows,
            g.first_px,
            g.first_px + g.stride_px
        );
    }
    for (name, map) in maps {
        let share = 100.0 * map.count(Verdict::Valid) as f64 / map.grid.len() as f64;
        match medians(map) {
            [Some(dx), Some(dy), Some(sigma)] => outln!(
                "{name}: {share:.1} % valid, median ({dx:.4}, {dy:.4}) px, sigma {sigma:.4} px"
            ),
            _ => outln!("{name}: no valid match"),
        }
    }
    Ok(())
}

/// Medians of dx, dy and sigma over the valid nodes; `None` where there is none.
fn medians(map: &DisparityMap) -> [Option<f64>; 3] {
    let valid = || map.matches.iter().filter(|m| m.verdict == Verdict::Valid);
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    [
        median(valid().map(|m| m.dx_px).collect()),
        median(valid().map(|m| m.dy_px).collect()),
        median(valid().map(|m| m.deviation_px()).collect()),
    ]
}
