//! What `qpalgo disparity` writes and prints: numbers, pictures, medians.

use std::path::Path;

use quadpixel::image::colour::{Rgb, blue_white_red, direction};
use quadpixel::image::raster::encode_png8;
use quadpixel::image::{Image, ImageError};
use quadpixel_algorithms::disparity::{Axes, DisparityMap, Match, Verdict};
use quadpixel_algorithms::maps::{MapFormat, Maps};

use super::DisparityArgs;
use crate::exit::CommandError;
use crate::outln;

/// Numbers a node, in this order, in every format but PFM, which has the first three.
const NUMBERS: [&str; 4] = ["dx", "dy", "sigma", "verdict"];

/// The map of a view or channel, by its name.
pub(super) type Named = (String, DisparityMap);
/// What is written: names and contents.
pub(super) type Files = Vec<(String, Vec<u8>)>;

/// The files of the maps: numbers and pictures.
pub(super) fn files(format: MapFormat, axes: Axes, maps: &[Named]) -> Result<Files, ImageError> {
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

/// Prints what was found.
pub(super) fn report(
    args: &DisparityArgs,
    maps: &[Named],
    files: &Files,
) -> Result<(), CommandError> {
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
