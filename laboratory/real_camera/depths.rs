//! Depth of real pairs by the simulated curve, against what was measured with other instruments.

use quadpixel::image::{Image, channel};
use quadpixel_algorithms::dense::dense_disparity;
use quadpixel_algorithms::depth::{FieldCurve, Measured};
use std::error::Error;

use crate::data::Views;
use crate::measure::GREEN;

/// A depth is claimed where its own standard deviation is at most this, m.
pub const CLAIM_M: f64 = 0.1;
/// Known depths beyond this are left out: there the disparity no longer tells them apart (0.01 px a m).
pub const FARTHEST_M: f64 = 10.0;

/// Estimated Z and its standard deviation, m; infinite where the shift is beyond that of infinity.
pub struct Found {
    pub z_m: Image,
    pub sigma_m: Image,
}

/// Errors over the pixels whose depth is known, of those that are claimed or of all that are matched.
#[derive(Clone, Copy)]
pub struct Score {
    /// Mean |Z − known|, m.
    pub mean_m: f64,
    /// Median |Z − known|, m.
    pub median_m: f64,
    /// Mean |Z − known| / known.
    pub relative: f64,
    /// Part with max(Z/known, known/Z) < 1.25.
    pub accuracy: f64,
    /// Part of the pixels with a known depth.
    pub share: f64,
}

/// As `qpalgo depth --left --right --srgb --curve` does.
pub fn found(views: &Views, curve: &FieldCurve) -> Result<Found, Box<dyn Error>> {
    let [left, right] = [&views.left, &views.right].map(|view| channel(view, GREEN));
    let settings = curve.dense_settings();
    let matched = dense_disparity(&left, &right, &settings)?;
    let (width, height) = (left.width(), left.height());
    let mut found = Found {
        z_m: Image::zeros(width, height, 1),
        sigma_m: Image::zeros(width, height, 1),
    };
    let pixels = (matched.disparity_px.data().iter()).zip(matched.sigma_px.data());
    for (i, (disparity, sigma)) in pixels.enumerate() {
        let measured = Measured {
            disparity_px: f64::from(*disparity),
            sigma_px: f64::from(*sigma),
        };
        let depth = curve.depth([(i % width) as f64, (i / width) as f64], measured);
        found.z_m.data_mut()[i] = depth.z_m as f32;
        found.sigma_m.data_mut()[i] = depth.sigma_m as f32;
    }
    Ok(found)
}

/// Errors where σ is at most `claim_m` (infinite: wherever there is a match).
pub fn score(found: &Found, known_m: &Image, claim_m: f64) -> Score {
    let all = found
        .z_m
        .data()
        .iter()
        .zip(found.sigma_m.data())
        .zip(known_m.data());
    let mut errors = Vec::new();
    let (mut known_count, mut relative, mut near) = (0usize, 0.0, 0usize);
    for ((&z, &sigma), &known) in all {
        let (z, known) = (f64::from(z), f64::from(known));
        if !(known > 0.0 && known <= FARTHEST_M) {
            continue;
        }
        known_count += 1;
        // NaN is not claimed, nor is infinity.
        if !(z.is_finite() && f64::from(sigma) <= claim_m) {
            continue;
        }
        let error = (z - known).abs();
        relative += error / known;
        near += usize::from((z / known).max(known / z) < 1.25);
        errors.push(error);
    }
    errors.sort_by(f64::total_cmp);
    let count = errors.len() as f64;
    Score {
        mean_m: errors.iter().sum::<f64>() / count,
        median_m: errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
        relative: relative / count,
        accuracy: near as f64 / count,
        share: count / known_count as f64,
    }
}
