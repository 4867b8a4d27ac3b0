//! The rules on camera-like pictures: their development can be undone, and they are those of the views.
//!
//! A code of a PNG may be off by what half precision of the views moves it; JPEGs of a quality of 50 or more by no more
//! than so many codes in the root mean square.

use std::collections::BTreeMap;

use crate::camera_pictures::CameraPictures;
use crate::layout::SUM_LAYER;
use crate::load::Planes;
use crate::sample::{FileKind, SampleMeta};

/// Steps of half precision, relative, that a stored value may be off: of itself and of those that add up to it.
const HALF_STEPS: f64 = 1.0 / 1024.0;
/// Least JPEG quality that is held to the views, and its largest root mean square, codes.
const HELD_QUALITY: u8 = 50;
const JPEG_RMS: f64 = 24.0;

/// What is wrong with the description.
pub(super) fn check_description(meta: &SampleMeta) -> Option<String> {
    let pictures = meta.camera_pictures.as_ref()?;
    if let Err(error) = pictures.development.check() {
        return Some(format!("camera_pictures.development.{error}"));
    }
    let colours = meta.channels.iter().map(|c| c.name.as_str());
    if !colours.eq(["R", "G", "B"]) {
        return Some("camera_pictures: are of R, G, B".to_string());
    }
    if pictures.noisy && meta.noise.readout().is_none() {
        return Some("camera_pictures.noisy: there is no noisy capture".to_string());
    }
    if pictures
        .jpeg_quality
        .is_some_and(|q| !(1..=100).contains(&q))
    {
        return Some("camera_pictures.jpeg_quality: allowed are 1 to 100".to_string());
    }
    let count = meta.sensor.subpixels.count() as f64;
    (pictures.view_gain != count)
        .then(|| "camera_pictures.view_gain: not the number of sub-pixels".to_string())
}

/// What is wrong with the pictures.
pub(super) fn check(
    meta: &SampleMeta,
    pictures: &BTreeMap<FileKind, Planes>,
) -> Vec<(FileKind, String)> {
    let Some(how) = &meta.camera_pictures else {
        return Vec::new();
    };
    let source = match how.noisy {
        true => FileKind::NoisyViews,
        false => FileKind::Views,
    };
    let Some(views) = pictures.get(&source) else {
        return Vec::new();
    };
    let subpixels = meta.sensor.subpixels;
    let sum = vec![SUM_LAYER.to_string()];
    let (one, all) = FileKind::camera_pictures(how.jpeg_quality.is_some());
    let tiled = [
        (one, sum, 1, 1.0),
        (all, subpixels.names(), subpixels.m(), how.view_gain),
    ];
    let differs = |(kind, layers, columns, gain): (FileKind, Vec<String>, usize, f64)| {
        let picture = pictures.get(&kind)?;
        let what = difference(how, views, picture, (&layers, columns), gain)?;
        Some((kind, what))
    };
    tiled.into_iter().filter_map(differs).collect()
}

/// How a picture differs from the development of the layers of which it has a tile each.
fn difference(
    how: &CameraPictures,
    views: &Planes,
    picture: &Planes,
    (layers, columns): (&[String], usize),
    gain: f64,
) -> Option<String> {
    let colours = ["R", "G", "B"];
    let (mut squares, mut bad) = (0.0, 0usize);
    for (k, layer) in layers.iter().enumerate() {
        let planes = colours.map(|c| views.channels.get(&format!("{layer}.{c}")));
        let [Some(r), Some(g), Some(b)] = planes else {
            return None; // reported with the views
        };
        for i in 0..views.width * views.height {
            let (x, y) = (i % views.width, i / views.width);
            let x = k % columns * views.width + x;
            let at = (k / columns * views.height + y) * picture.width + x;
            let linear = [r[i], g[i], b[i]].map(|v| gain * f64::from(v));
            let largest = linear.iter().fold(0.0f64, |most, v| most.max(v.abs()));
            let off = |sign: f64| linear.map(|v| v + sign * HALF_STEPS * largest);
            let [exact, less, more] = [0.0, -1.0, 1.0].map(|sign| how.development.codes(off(sign)));
            for (c, colour) in colours.iter().enumerate() {
                let code = f64::from(picture.channels[*colour][at]);
                squares += (code - f64::from(exact[c])).powi(2);
                let room = less[c].abs_diff(exact[c]).max(more[c].abs_diff(exact[c]));
                let allowed = 2.0 * f64::from(room) + 1.0;
                bad += usize::from((code - f64::from(exact[c])).abs() > allowed);
            }
        }
    }
    let values = 3 * views.width * views.height * layers.len();
    let rms = (squares / values.max(1) as f64).sqrt();
    match how.jpeg_quality {
        None if bad > 0 => Some(format!(
            "{bad} codes are not those of the views' development"
        )),
        Some(quality) if quality >= HELD_QUALITY && rms > JPEG_RMS => Some(format!(
            "differs by {rms:.1} codes (root mean square) from the views' development, allowed are {JPEG_RMS}"
        )),
        _ => None,
    }
}
