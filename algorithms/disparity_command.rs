//! `qpalgo disparity`: two pictures in, the shift of each channel out, as numbers and as a picture.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers};
use quadpixel::image::raster::encode_png8;
use quadpixel::image::{Image, ImageError};

use crate::disparity::{Axes, DisparityMap, Limits, MatchSettings, Verdict, match_images};
use crate::error::CommandError;
use crate::load;

/// Numbers a node, in this order, in every format but PFM, which has the first three.
const NUMBERS: [&str; 4] = ["dx", "dy", "sigma", "verdict"];

/// Kind of file for the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// OpenEXR, 32-bit float: a layer a colour channel with dx, dy, sigma, verdict.
    Exr,
    /// NumPy: f32 of shape (colour channels, rows, columns, 4): dx, dy, sigma, verdict.
    Npy,
    /// Portable float map: a file a colour channel; its red, green, blue are dx, dy, sigma, NaN where not valid.
    Pfm,
}

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
    /// Reference picture A (EXR, PNG, TIFF).
    a: PathBuf,
    /// Picture B of the same size: what lies at x in A lies at x + d in B.
    b: PathBuf,
    /// Folder to write: disparity.FORMAT and disparity_CHANNEL.png.
    #[arg(long, short)]
    out: PathBuf,
    /// Largest shift looked for on each axis, px; beyond 4 from coarse to fine.
    #[arg(long, default_value_t = 4)]
    search: usize,
    /// Side of the window, px: odd, 5 to 31.
    #[arg(long, default_value_t = 21)]
    window: usize,
    /// Pixels from node to node.
    #[arg(long, default_value_t = 4)]
    stride: usize,
    /// Searches along one axis only; absent: along both.
    #[arg(long, value_enum)]
    one_dimensional: Option<Direction>,
    /// Kind of file for the numbers.
    #[arg(long, value_enum, default_value_t = Format::Exr)]
    format: Format,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Matches each channel and writes the maps; no file is written before all are made.
pub fn run(args: &DisparityArgs) -> Result<(), CommandError> {
    let settings = MatchSettings {
        window_px: args.window,
        stride_px: args.stride,
        search_px: args.search,
        axes: match args.one_dimensional {
            None => Axes::Both,
            Some(Direction::Horizontal) => Axes::Horizontal,
            Some(Direction::Vertical) => Axes::Vertical,
        },
        limits: Limits::default(),
    };
    let (a, names) = first_layer(&args.a)?;
    let (b, _) = first_layer(&args.b)?;
    if load::size_of(&a) != load::size_of(&b) {
        return Err(CommandError::input(format!(
            "{}: {} where {} has {}: both must be of one size",
            args.b.display(),
            load::size_of(&b),
            args.a.display(),
            load::size_of(&a)
        )));
    }
    let mut maps = Vec::with_capacity(names.len());
    for (index, name) in names.iter().enumerate() {
        let [a, b] = [&a, &b].map(|image| channel(image, index));
        let map = match_images(&a, &b, &settings).map_err(|e| {
            let (a, b) = (args.a.display(), args.b.display());
            CommandError::input(format!("{a} and {b}, channel {name}: {e}"))
        })?;
        maps.push(map);
    }
    let mut files =
        numbers(args.format, &names, &maps).map_err(|e| CommandError::failed(e.to_string()))?;
    for (name, map) in names.iter().zip(&maps) {
        let path = format!("disparity_{name}.png");
        let bytes = encode_png8(
            Path::new(&path),
            &colours(map),
            map.grid.columns,
            map.grid.rows,
            3,
        )
        .map_err(|e| CommandError::failed(e.to_string()))?;
        files.push((path, bytes));
    }
    let failed = |e: file::FileError| CommandError::failed(e.to_string());
    file::create_folder(&args.out).map_err(failed)?;
    for (name, bytes) in &files {
        file::write_aside(&args.out.join(name), bytes).map_err(failed)?;
    }
    report(args, &names, &maps, &files);
    Ok(())
}

fn report(
    args: &DisparityArgs,
    names: &[String],
    maps: &[DisparityMap],
    files: &[(String, Vec<u8>)],
) {
    let file_names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    if args.json {
        let channels: Vec<_> = names
            .iter()
            .zip(maps)
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
        let grid = maps.first().map(|m| {
            let g = m.grid;
            serde_json::json!({
                "columns": g.columns, "rows": g.rows, "first_px": g.first_px, "stride_px": g.stride_px
            })
        });
        let object = serde_json::json!({ "files": file_names, "grid": grid, "channels": channels });
        println!("{object}");
        return;
    }
    println!("{}: {}", args.out.display(), file_names.join(" "));
    for (name, map) in names.iter().zip(maps) {
        let share = 100.0 * map.count(Verdict::Valid) as f64 / map.grid.len() as f64;
        match medians(map) {
            [Some(dx), Some(dy), Some(sigma)] => {
                println!(
                    "{name}: {share:.1} % valid, median ({dx:.4}, {dy:.4}) px, sigma {sigma:.4} px"
                );
            }
            _ => println!("{name}: no valid match"),
        }
    }
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

fn first_layer(path: &Path) -> Result<(Image, Vec<String>), CommandError> {
    let layer = load::layers(path)?.into_iter().next();
    layer
        .map(|layer| (layer.image, layer.channels))
        .ok_or_else(|| CommandError::input(format!("{}: it holds no layer", path.display())))
}

/// One channel of `image` as a picture of its own.
pub(crate) fn channel(image: &Image, index: usize) -> Image {
    let mut plane = Image::zeros(image.width(), image.height(), 1);
    let from = image.data().iter().skip(index).step_by(image.channels());
    (plane.data_mut().iter_mut().zip(from)).for_each(|(to, v)| *to = *v);
    plane
}

/// dx, dy, sigma, verdict of all nodes, interleaved.
fn rows_of(map: &DisparityMap) -> Vec<f32> {
    (map.matches.iter())
        .flat_map(|m| {
            let code = f32::from(m.verdict as u8);
            [
                m.dx_px as f32,
                m.dy_px as f32,
                m.deviation_px() as f32,
                code,
            ]
        })
        .collect()
}

type Files = Vec<(String, Vec<u8>)>;

fn numbers(format: Format, names: &[String], maps: &[DisparityMap]) -> Result<Files, ImageError> {
    match format {
        Format::Exr => {
            let images: Vec<Image> = maps
                .iter()
                .map(|map| {
                    let mut image = Image::zeros(map.grid.columns, map.grid.rows, NUMBERS.len());
                    image.data_mut().copy_from_slice(&rows_of(map));
                    image
                })
                .collect();
            let layers: Vec<Layer<'_>> = (names.iter().zip(&images))
                .map(|(name, image)| Layer {
                    name,
                    channels: &NUMBERS,
                    image,
                    sample: Sample::Float,
                })
                .collect();
            let name = "disparity.exr".to_owned();
            let bytes = encode_layers(Path::new(&name), &layers, Compression::Zip)?;
            Ok(vec![(name, bytes)])
        }
        Format::Npy => Ok(vec![("disparity.npy".to_owned(), npy(maps))]),
        Format::Pfm => Ok((names.iter().zip(maps))
            .map(|(name, map)| (format!("disparity_{name}.pfm"), pfm(map)))
            .collect()),
    }
}

/// NumPy's format 1.0: a header padded to a multiple of 64 bytes, then the numbers.
fn npy(maps: &[DisparityMap]) -> Vec<u8> {
    let (rows, columns) = maps
        .first()
        .map_or((0, 0), |m| (m.grid.rows, m.grid.columns));
    let shape = format!("({}, {rows}, {columns}, {})", maps.len(), NUMBERS.len());
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(maps.iter().flat_map(rows_of).flat_map(f32::to_le_bytes));
    bytes
}

/// Rows from the bottom up, little-endian (the negative scale says so).
fn pfm(map: &DisparityMap) -> Vec<u8> {
    let (columns, rows) = (map.grid.columns, map.grid.rows);
    let mut bytes = format!("PF\n{columns} {rows}\n-1.0\n").into_bytes();
    for row in rows_of(map).chunks(NUMBERS.len() * columns).rev() {
        for node in row.chunks(NUMBERS.len()) {
            bytes.extend(node[..3].iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    bytes
}

/// Longest valid shift, px; `None` where there is none.
fn largest(map: &DisparityMap) -> Option<f64> {
    (map.matches.iter())
        .filter(|m| m.verdict == Verdict::Valid)
        .map(|m| m.dx_px.hypot(m.dy_px))
        .reduce(f64::max)
}

/// Direction as hue (right red, down yellow-green), length over the longest as saturation; black where not valid.
fn colours(map: &DisparityMap) -> Vec<u8> {
    let longest = largest(map).filter(|&l| l > 0.0).unwrap_or(1.0);
    (map.matches.iter())
        .flat_map(|m| {
            if m.verdict != Verdict::Valid {
                return [0; 3];
            }
            let hue = m.dy_px.atan2(m.dx_px).to_degrees().rem_euclid(360.0) / 60.0;
            let saturation = (m.dx_px.hypot(m.dy_px) / longest).min(1.0);
            // From HSV of full value: each primary falls off linearly from its own hue (0, 2, 4).
            [0.0, 2.0, 4.0].map(|primary: f64| {
                let apart = (hue - primary).abs().min(6.0 - (hue - primary).abs());
                let pure = (2.0 - apart).clamp(0.0, 1.0);
                (255.0 * (1.0 - saturation * (1.0 - pure))).round() as u8
            })
        })
        .collect()
}
