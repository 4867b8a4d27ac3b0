//! The deviations as numbers, and the flat field as a picture.

use std::fmt::Write;
use std::path::Path;

use quadpixel::image::Image;
use quadpixel::image::colour::Rgb;
use quadpixel::image::raster::encode_png8;
use rayon::prelude::*;

use super::places::{Place, SIDE_MM, Sensor56};
use super::ways::{Deviation, Nodes, Way};
use crate::error::LaboratoryError;
use quadpixel_generators::preview::Sheet;

/// Places a side of a picture.
const ACROSS: usize = 140;
/// Brightness that the pictures stretch over, in parts of the mean view; deviations by this much more.
const STRETCH: f64 = 0.05;
const STRETCH_DEVIATION: f64 = 0.01;
const GAP: usize = 8;
const HEAD: usize = 12;

pub(super) fn csv(all: &[Deviation]) -> String {
    let mut text =
        String::from("way,shifts_per_pitch,shifts_simulated,flat_rms,flat_max,ray_rms_of_peak\n");
    for d in all {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "{},{},{},{:.6},{:.6},{:.6}",
            d.way.name(),
            d.per_pitch,
            d.stored,
            d.flat_rms,
            d.flat_max,
            d.ray_rms
        );
    }
    text
}

pub(super) fn json(all: &[Deviation]) -> Vec<serde_json::Value> {
    let one = |d: &Deviation| {
        serde_json::json!({
            "way": d.way.name(), "shifts_per_pitch": d.per_pitch, "shifts_simulated": d.stored, "flat_rms": d.flat_rms,
            "flat_max": d.flat_max, "ray_rms_of_peak": d.ray_rms
        })
    };
    all.iter().map(one).collect()
}

pub(super) fn table(all: &[Deviation]) -> String {
    let mut text = format!(
        "{:<14} {:>8} {:>9} {:>12} {:>12} {:>12}\n",
        "way", "a pitch", "simulated", "view rms %", "view max %", "P rms % peak"
    );
    for d in all {
        let _ = writeln!(
            text,
            "{:<14} {:>8} {:>9} {:>12.4} {:>12.4} {:>12.4}",
            d.way.name(),
            d.per_pitch,
            d.stored,
            100.0 * d.flat_rms,
            100.0 * d.flat_max,
            100.0 * d.ray_rms
        );
    }
    text
}

/// A column a way: one view (right and low, A of a quad pixel) over the mean view, and below it how far it is from the
/// finest nodes' series; a PNG, whose `path` is for messages only.
pub(super) fn picture(
    path: &Path,
    sensor: &Sensor56,
    nodes: &Nodes,
    finest: &Nodes,
) -> Result<Vec<u8>, LaboratoryError> {
    let s = nodes.subpixels();
    let view = s.index(s.m() - 1, 0);
    let at = |i: usize| ((i as f64 + 0.5) / ACROSS as f64 - 0.5) * SIDE_MM;
    let places: Vec<Option<Place>> = (0..ACROSS * ACROSS)
        .into_par_iter()
        .map(|k| sensor.place(at(k % ACROSS), at(k / ACROSS)))
        .collect();
    let truth = flat(&places, finest, Way::Fourier, view);
    let cell = ACROSS + GAP;
    let width = Way::ALL.len() * cell + GAP;
    let height = 2 * (cell + HEAD) + GAP;
    let mut sheet = Sheet::new(width, height, [255, 255, 255]);
    for (i, way) in Way::ALL.into_iter().enumerate() {
        let found = flat(&places, nodes, way, view);
        let off: Vec<f32> = found.iter().zip(&truth).map(|(a, b)| a - b).collect();
        let left = GAP + i * cell;
        let pictures = [(&found, 1.0, STRETCH), (&off, 0.0, STRETCH_DEVIATION)];
        for (j, (values, middle, stretch)) in pictures.into_iter().enumerate() {
            let top = GAP + j * (cell + HEAD);
            let name = match j {
                0 => format!("{}, {} a pitch", way.name(), nodes.per_pitch()),
                _ => format!("deviation +-{}%", 100.0 * stretch),
            };
            sheet.text(left, top, 1, &name, [60, 60, 60]);
            let mut image = Image::zeros(ACROSS, ACROSS, 1);
            image.data_mut().copy_from_slice(values);
            let gray = |v: &[f32]| -> Rgb {
                let x = (f64::from(v[0]) - middle) / stretch;
                [(127.5 * (1.0 + x)).clamp(0.0, 255.0).round() as u8; 3]
            };
            sheet.picture((left, top + HEAD, ACROSS), &image, gray);
        }
    }
    Ok(encode_png8(path, &sheet.rgb, sheet.width, sheet.height, 3)?)
}

/// One view of the white wall over the mean view.
fn flat(places: &[Option<Place>], nodes: &Nodes, way: Way, view: usize) -> Vec<f32> {
    let count = nodes.subpixels().count();
    let one = |place: &Option<Place>| {
        place.as_ref().map_or(1.0, |place| {
            let views = place.flat(&nodes.weights(way, place), count);
            (views[view] * count as f64 / views.iter().sum::<f64>()) as f32
        })
    };
    places.par_iter().map(one).collect()
}
