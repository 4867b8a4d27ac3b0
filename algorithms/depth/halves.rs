//! The shift between opposite halves of the pupil, at each pixel of their sum.
//!
//! A match is believed by the scatter of its window's parts and by how much of the window is texture
//! ([`crate::trust`]). A measured shift belongs to the point midway between where the two views have it, which is where
//! their sum has it.

use crate::disparity::{Axes, Grid, Match, MatchError, MatchSettings, Verdict, match_images};
use crate::trust::Windows;
use quadpixel::image::Image;
use rayon::prelude::*;

/// Systematic error of a match, px, so that one noiseless axis does not silence the other.
const FLOOR_PX: f64 = 0.002;
/// Largest part of a window's slope that may be noise: it pulls the shift towards 0 by up to as much.
pub const MOST_NOISE: f64 = 0.1;

/// A disparity with its standard deviation, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// D.
    pub disparity_px: f64,
    /// s_D.
    pub sigma_px: f64,
}

/// Opposite views, one channel each: `[A, B]` with D = position in B − position in A.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// Right or bottom view.
    pub a: &'a Image,
    /// Left or top view.
    pub b: &'a Image,
    /// Its direction: [`Axes::Horizontal`] or [`Axes::Vertical`].
    pub axes: Axes,
}

/// Matches a pair: D at each pixel of the sum, row-major; `None` where there is no trusted match. `most_noise`: the
/// largest part of a window's slope that may be noise ([`crate::trust`]), [`MOST_NOISE`] for unknown captures, ∞ where
/// the texture is known to be as fine as noise.
///
/// # Errors
/// As of [`match_images`].
pub fn measure(
    pair: Pair<'_>,
    settings: &MatchSettings,
    most_noise: f64,
) -> Result<Vec<Option<Measured>>, MatchError> {
    let settings = MatchSettings {
        axes: pair.axes,
        ..*settings
    };
    let map = match_images(pair.a, pair.b, &settings)?;
    let vertical = pair.axes == Axes::Vertical;
    let windows = Windows {
        a: pair.a,
        b: pair.b,
        window_px: settings.window_px,
        vertical,
    };
    let nodes: Vec<Option<Measured>> = (map.matches.par_iter().enumerate())
        .map(|(i, found)| trusted(&windows, map.grid.pixel(i), found, most_noise))
        .collect();
    let (width, height) = (pair.a.width(), pair.a.height());
    let at = |x: usize, y: usize| {
        let nearest = |x: f64, y: f64| nodes[nearest(&map.grid, x, y)?];
        let first = nearest(x as f64, y as f64)?;
        // The window's place in A lies half the shift beside that in the sum.
        let half = 0.5 * first.disparity_px;
        let (dx, dy) = if vertical { (0.0, half) } else { (half, 0.0) };
        nearest(x as f64 - dx, y as f64 - dy)
    };
    Ok((0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| at(x, y))
        .collect())
}

/// What a valid match says, with the larger of the matcher's variance and the scatter of the window's parts.
fn trusted(
    windows: &Windows<'_>,
    (x, y): (usize, usize),
    found: &Match,
    most_noise: f64,
) -> Option<Measured> {
    if found.verdict != Verdict::Valid {
        return None;
    }
    let (shift, variance) = match windows.vertical {
        true => (found.dy_px, found.covariance_px2[2]),
        false => (found.dx_px, found.covariance_px2[0]),
    };
    let worth = windows.worth([x, y], shift)?;
    let pulled = worth.noise.min(most_noise.min(1.0)) * shift;
    (worth.noise <= most_noise).then(|| Measured {
        disparity_px: shift,
        sigma_px: (variance.max(worth.variance_px2) + pulled * pulled + FLOOR_PX * FLOOR_PX).sqrt(),
    })
}

/// The node nearest to (x, y), no farther than a stride.
fn nearest(grid: &Grid, x: f64, y: f64) -> Option<usize> {
    let index = |p: f64, count: usize| {
        let node = ((p - grid.first_px as f64) / grid.stride_px as f64).round();
        (node >= 0.0 && node < count as f64).then_some(node as usize)
    };
    let (column, row) = (index(x, grid.columns)?, index(y, grid.rows)?);
    Some(row * grid.columns + column)
}

/// Weighted mean of what both directions say; where one is silent, the other's.
pub fn combine(horizontal: Option<Measured>, vertical: Option<Measured>) -> Option<Measured> {
    let (Some(h), Some(v)) = (horizontal, vertical) else {
        return horizontal.or(vertical);
    };
    let [wh, wv] = [h, v].map(|m| 1.0 / (m.sigma_px * m.sigma_px));
    Some(Measured {
        disparity_px: (wh * h.disparity_px + wv * v.disparity_px) / (wh + wv),
        sigma_px: (1.0 / (wh + wv)).sqrt(),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn the_surer_direction_weighs_more_and_a_silent_one_nothing() {
        let say = |disparity_px, sigma_px| {
            Some(Measured {
                disparity_px,
                sigma_px,
            })
        };
        let both = combine(say(1.0, 0.01), say(2.0, 0.02)).unwrap();
        assert!((both.disparity_px - 1.2).abs() < 1e-12);
        assert!((both.sigma_px - 0.01 * (0.8f64).sqrt()).abs() < 1e-12);
        assert_eq!(combine(None, say(2.0, 0.02)), say(2.0, 0.02));
        assert_eq!(combine(None, None), None);
    }
}
