//! How far the surface is to be believed.
//!
//! ```text
//! σ² = a scatter² + b spread² + 1/information + (m d)² + floor²,    at most the range of the candidates
//! ```
//!
//! scatter: of the numbers about the surface, weighted as they are in it; spread: of the surface itself nearby, which a
//! window at a depth step mixes; information: the curvature of the costs in a window, which a picture without texture
//! does not have; m: what another pupil than is told makes of d. a, b, m and the floor were chosen on samples of ours
//! with known truth; where planes at known distances told what matching errs by, that is the floor.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::directions::Direction;
use super::filters::gaussian;

/// b.
const SPREAD: f64 = 0.5;
/// By the family, κ assumed. The scale of d and its zero are free then and not in σ, or planes at known distances told
/// them; beside them κ of 0.16 to 0.38 change d by 0.5 to 2.4 % of itself
/// (benches/runs/2026-11-29/free-scale.md).
const ASSUMED: Model = Model {
    scatter: 4.0,
    part: 0.02,
    floor_px: 0.03,
};
/// By the family, κ known.
const KNOWN: Model = Model {
    part: 0.05,
    ..ASSUMED
};
/// By the camera's own rays.
const OWN_RAYS: Model = Model {
    scatter: 1.6,
    part: 0.01,
    floor_px: 0.012,
};
/// Deviation of the window, px of the level.
const WINDOW_PX: f64 = 3.0;
/// Largest weight of one number, in medians.
const MOST: f64 = 10.0;

/// How well the kernels are known.
#[derive(Clone, Copy)]
pub(super) struct Model {
    /// a.
    scatter: f64,
    /// m.
    part: f64,
    /// Floor, px of the level.
    floor_px: f64,
}

impl Model {
    /// By what is known of a direction's kernels; a level's pixel is `unit` px.
    pub fn of(direction: &Direction, unit: f64) -> Self {
        match (direction.has_rays(), direction.matching_error_px()) {
            (true, _) => OWN_RAYS,
            (false, Some(error_px)) => Self {
                floor_px: error_px.max(0.0) / unit,
                ..ASSUMED
            },
            (false, None) if direction.is_ratio_known() => KNOWN,
            (false, None) => ASSUMED,
        }
    }
}

/// What σ is made of; lengths in px of the level, `size` its columns and rows.
pub(super) struct Evidence<'a> {
    pub size: [usize; 2],
    /// The surface.
    pub surface: &'a [f64],
    /// The numbers that it goes through, and their weights (median 1).
    pub numbers: &'a [f64],
    pub weights: &'a [f64],
    /// Curvature of the costs whose weight is 1, per px².
    pub curvature: f64,
    /// How well the kernels are known.
    pub model: Model,
    /// Width of the range of the candidates.
    pub range: f64,
}

/// σ at each pixel of the level, px of the level.
pub(super) fn deviations(e: &Evidence<'_>) -> Image {
    let [width, height] = e.size;
    let smooth = |f: &dyn Fn(usize) -> f64| {
        let mut image = Image::zeros(width, height, 1);
        (image.data_mut().iter_mut().enumerate()).for_each(|(i, to)| *to = f(i) as f32);
        gaussian(&image, WINDOW_PX)
    };
    let weight = |i: usize| e.weights[i].min(MOST);
    let off = smooth(&|i| weight(i) * (e.surface[i] - e.numbers[i]).powi(2));
    let weights = smooth(&weight);
    let mean = smooth(&|i| e.surface[i]);
    let squares = smooth(&|i| e.surface[i] * e.surface[i]);
    // Pixels of a Gaussian window.
    let area = 4.0 * std::f64::consts::PI * WINDOW_PX * WINDOW_PX;
    let mut sigma = Image::zeros(width, height, 1);
    (sigma.data_mut().par_iter_mut().enumerate()).for_each(|(i, to)| {
        let at = |image: &Image| f64::from(image.data()[i]);
        let scatter = at(&off) / at(&weights).max(f64::MIN_POSITIVE);
        let spread = (at(&squares) - at(&mean).powi(2)).max(0.0);
        let information = area * at(&weights) * e.curvature;
        let variance = e.model.scatter * scatter
            + SPREAD * spread
            + 1.0 / information.max(f64::MIN_POSITIVE)
            + (e.model.part * e.surface[i]).powi(2)
            + e.model.floor_px.powi(2);
        *to = variance.sqrt().min(e.range) as f32;
    });
    sigma
}
