//! Depth in mm of the numbers of a depth map, by rules:
//!
//! | kind | hole | sky (+∞) |
//! |---|---|---|
//! | z, ray | NaN, 0 and below | +∞ |
//! | inverse | NaN, +∞, below 0 | 0 |
//! | disparity | NaN, ±∞; 0 and below, its offset added | |
//!
//! The number that `hole` names is a hole in all of them, and so is what is nearer than `nearest_m`.

use std::path::Path;

use quadpixel::image::Image;
use quadpixel::units::M_PER_MM;

use super::error::PictureError;
use super::files::Stored;
use super::meaning::{DepthKind, Meaning};

/// Names of the channel of depth in an EXR of several.
const CHANNELS: [&str; 7] = ["Z", "z", "depth", "Depth", "Y", "D", "R"];

/// W × H × 1, z in mm: NaN for a hole, +∞ for the sky. `path` is what errors name.
pub(super) fn of(stored: &Stored, path: &Path, meaning: &Meaning) -> Result<Image, PictureError> {
    let refused = |what: String| PictureError::File {
        path: path.to_owned(),
        what,
    };
    let (width, height) = (stored.image.width(), stored.image.height());
    let to_m = to_metres(stored, meaning, (width, height)).map_err(refused)?;
    let nearest_m = meaning.nearest_m.unwrap_or(0.0);
    let channel = channel(stored).map_err(refused)?;
    let pixels = stored.image.data().chunks_exact(stored.image.channels());
    let data = pixels.enumerate().map(|(i, p)| {
        let number = f64::from(p[channel]);
        let m = match meaning.hole {
            Some(hole) if number == hole => f64::NAN,
            _ => to_m(number, i % width, i / width),
        };
        // Also false for NaN.
        if m > 0.0 && m >= nearest_m {
            (m / M_PER_MM) as f32
        } else {
            f32::NAN
        }
    });
    let data: Vec<f32> = data.collect();
    if data.iter().all(|d| d.is_nan()) {
        let what = "every depth is a hole; allowed: at least one depth; is its kind, its unit or its hole right?";
        return Err(refused(what.into()));
    }
    Image::from_vec(width, height, 1, data)
        .ok_or_else(|| refused("its size does not match its data".into()))
}

/// The named one, or any where they are alike.
fn channel(stored: &Stored) -> Result<usize, String> {
    let named = |name: &&str| stored.channels.iter().position(|c| c == name);
    if let Some(channel) = CHANNELS.iter().find_map(named) {
        return Ok(channel);
    }
    let channels = stored.image.channels();
    let is_alike = |p: &[f32]| p.iter().all(|v| v.to_bits() == p[0].to_bits());
    match stored.image.data().chunks_exact(channels).all(is_alike) {
        true => Ok(0),
        false => Err(format!(
            "a depth of {channels} channels that differ, as of a picture in false colours; allowed: one channel, channels \
             alike, or one named {}",
            CHANNELS.join(", ")
        )),
    }
}

type ToMetres = Box<dyn Fn(f64, usize, usize) -> f64>;

/// z in metres of a stored number at a column and row.
fn to_metres(
    stored: &Stored,
    meaning: &Meaning,
    (width, height): (usize, usize),
) -> Result<ToMetres, String> {
    let kind = meaning.kind.unwrap_or_default();
    let unit = match (meaning.unit, stored.full_scale, kind) {
        (Some(unit), _, _) => unit,
        (None, None, _) | (None, _, DepthKind::Disparity) => 1.0,
        (None, Some(_), _) => {
            return Err("whole numbers without a unit; allowed: with --depth-unit m, cm, mm or metres per number, or \
                        `unit` in a sidecar or a call"
                .into());
        }
    };
    let camera = || {
        meaning.camera(width, height).ok_or_else(|| {
            format!(
                "depth of kind {} without the picture's camera; allowed: with --hfov-deg, --focal-px, or `intrinsics` or `hfov_deg` in a sidecar or a call",
                kind.name()
            )
        })
    };
    Ok(match kind {
        DepthKind::Z => Box::new(move |n, _, _| n * unit),
        DepthKind::Inverse => Box::new(move |n, _, _| match n * unit {
            t if t >= 0.0 && t.is_finite() => 1.0 / t,
            _ => f64::NAN,
        }),
        DepthKind::Ray => {
            let [fx, fy, cx, cy] = camera()?;
            Box::new(move |n, x, y| {
                let (a, b) = ((x as f64 - cx) / fx, (y as f64 - cy) / fy);
                n * unit / (1.0 + a * a + b * b).sqrt()
            })
        }
        DepthKind::Disparity => {
            let [fx, ..] = camera()?;
            let Some(baseline_m) = meaning.baseline_m else {
                return Err(
                    "disparity without a baseline; allowed: with --baseline-m, or `baseline_m` in a sidecar or a call".into(),
                );
            };
            let offset = meaning.disparity_offset_px.unwrap_or(0.0);
            Box::new(move |n, _, _| match n * unit + offset {
                // Zero marks a hole before anything is added to it.
                d if d > 0.0 && d.is_finite() && n != 0.0 => fx * baseline_m / d,
                _ => f64::NAN,
            })
        }
    })
}
