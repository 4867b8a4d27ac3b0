//! The shots as numbers and as a picture.

use std::fmt::Write;
use std::path::Path;

use crate::error::LaboratoryError;
use quadpixel::image::Image;
use quadpixel::image::colour::{Rgb, blue_white_red};
use quadpixel::image::raster::encode_jpeg;
use quadpixel::image::srgb::code_from_linear;

use super::shot::{Mode, Shot};
use quadpixel_generators::preview::Sheet;

/// Side of a view in the picture, px, what is between, and the lines of text above each.
const SIDE: usize = 224;
const GAP: usize = 8;
const HEAD: usize = 24;
/// Difference of views that is drawn in full colour; 1 is white.
const FULL: f32 = 0.3;
const QUALITY: u8 = 75;

/// The amplitude in parts of the classic mode's of the same pixel.
fn kept(shots: &[Shot], shot: &Shot) -> f64 {
    let classic = shots
        .iter()
        .find(|s| s.pixel == shot.pixel && s.mode == Mode::Classic);
    classic.map_or(f64::NAN, |c| shot.amplitude() / c.amplitude())
}

pub(super) fn csv(shots: &[Shot]) -> String {
    let mut text = String::from(
        "pixel,pitch_um,mode,defocus_px,at_focus_px,centroid_px,matched_px,seen_px,amplitude_per_px_of_defocus,of_classic,difference_rms,light_taken\n",
    );
    for s in shots {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "\"{}\",{},{},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4}",
            s.pixel,
            s.pitch_um,
            s.mode.name(),
            s.defocus_px,
            s.at_focus_px,
            s.centroid_px,
            s.matched_px,
            s.seen_px,
            s.amplitude(),
            kept(shots, s),
            s.difference,
            s.taken
        );
    }
    text
}

pub(super) fn json(shots: &[Shot]) -> Vec<serde_json::Value> {
    let one = |s: &Shot| {
        serde_json::json!({
            "pixel": s.pixel, "pitch_um": s.pitch_um, "mode": s.mode.name(), "defocus_px": s.defocus_px, "at_focus_px": s.at_focus_px, "centroid_px": s.centroid_px,
            "matched_px": s.matched_px, "seen_px": s.seen_px, "amplitude_per_px_of_defocus": s.amplitude(), "of_classic": kept(shots, s),
            "difference_rms": s.difference, "light_taken": s.taken
        })
    };
    shots.iter().map(one).collect()
}

pub(super) fn table(shots: &[Shot]) -> String {
    let mut text = format!(
        "{:<18} {:<22} {:>10} {:>33} {:>16} {:>11} {:>11} {:>7}\n{:<18} {:<22} {:>10} {:>8} {:>8} {:>7} {:>7} {:>16} {:>11} {:>11} {:>7}\n",
        "pixel",
        "mode",
        "defocus",
        "x_B - x_A px, by",
        "a px of defocus",
        "of classic",
        "views apart",
        "light",
        "",
        "",
        "px",
        "at focus",
        "centroid",
        "matched",
        "seen",
        "",
        "",
        "rms",
        "taken"
    );
    for s in shots {
        let _ = writeln!(
            text,
            "{:<18} {:<22} {:>10.2} {:>8.3} {:>8.3} {:>7.3} {:>7.3} {:>16.3} {:>10.0}% {:>10.1}% {:>6.0}%",
            s.pixel,
            s.mode.name(),
            s.defocus_px,
            s.at_focus_px,
            s.centroid_px,
            s.matched_px,
            s.seen_px,
            s.amplitude(),
            100.0 * kept(shots, s),
            100.0 * s.difference,
            100.0 * s.taken
        );
    }
    text
}

/// A row per shot: view A, view D, their difference, and of the diffractive mode what it changed in view A; a JPEG,
/// whose `path` is for messages only.
pub(super) fn picture(path: &Path, shots: &[Shot]) -> Result<Vec<u8>, LaboratoryError> {
    let (across, down) = (SIDE + GAP, SIDE + HEAD + GAP);
    let mut sheet = Sheet::new(4 * across + GAP, shots.len() * down + GAP, [255; 3]);
    let gray = |v: &[f32]| -> Rgb { [code_from_linear(v[0]); 3] };
    let apart = |v: &[f32]| blue_white_red(0.5 + 0.5 * (v[0] / FULL).clamp(-1.0, 1.0));
    for (row, shot) in shots.iter().enumerate() {
        let top = GAP + row * down;
        let [a, d] = &shot.views;
        let head = format!("{} {}", shot.pixel, shot.mode.name());
        let signal = format!(
            "X_B-X_A {:.2} PX, DEFOCUS {:.1} PX",
            shot.centroid_px, shot.defocus_px
        );
        let mut draw = |column: usize, lines: [&str; 2], image: &Image, difference: bool| {
            let left = GAP + column * across;
            for (line, text) in lines.into_iter().enumerate() {
                sheet.text(left, top + 11 * line, 1, text, [60; 3]);
            }
            let place = (left, top + HEAD, SIDE);
            match difference {
                true => sheet.picture(place, image, apart),
                false => sheet.picture(place, image, gray),
            }
        };
        draw(0, [&head, "VIEW A"], a, false);
        draw(1, [&signal, "VIEW D"], d, false);
        let scale = format!("FULL COLOUR AT +-{:.0}% OF WHITE", 100.0 * FULL);
        draw(2, ["A - D", &scale], &less(a, d), true);
        let classic = shots
            .iter()
            .find(|s| s.pixel == shot.pixel && s.mode == Mode::Classic);
        if let Some(classic) = classic.filter(|_| shot.mode != Mode::Classic) {
            let changed = less(&classic.views[0], a);
            draw(3, ["A: CLASSIC - DIFFRACTIVE", &scale], &changed, true);
        }
    }
    Ok(encode_jpeg(
        path,
        &sheet.rgb,
        sheet.width,
        sheet.height,
        QUALITY,
    )?)
}

/// a − b; both of one camera.
fn less(a: &Image, b: &Image) -> Image {
    let mut out = a.clone();
    out.data_mut()
        .iter_mut()
        .zip(b.data())
        .for_each(|(a, b)| *a -= b);
    out
}
