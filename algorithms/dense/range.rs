//! Which disparities there are, found at a coarse resolution; and the resolution at which their blur leaves texture.

use super::cost::Candidates;
use super::directions::{Direction, volume_of};
use super::guide::Guide;
use super::minimum::minima;
use super::prepare::Pyramid;
use super::semi_global::aggregated;

/// Largest disparity that is looked for, a part of the width.
const MOST_OF_WIDTH: f64 = 1.0 / 32.0;
/// Side of the coarse picture, px.
const SIDE_PX: f64 = 48.0;
/// Part of the pixels beyond either end of the range.
const TAIL: f64 = 0.01;
/// The largest disparity at the level that is matched, px: texture finer than that is blurred away.
const REACH_PX: f64 = 2.0;
/// Candidates per px of a level: the paths of semi-global matching hold on to them, by a quarter of their step.
pub(super) const STEPS_PER_PX: f64 = 24.0;

/// Least and largest disparity, px of full resolution, with a margin.
pub(super) fn range(directions: &[Direction]) -> [f64; 2] {
    let pyramid = directions[0].pyramid();
    let full = &pyramid.guides[0];
    let side = full.width().min(full.height()) as f64;
    let k = ((side / SIDE_PX).log2().floor().max(0.0) as usize).min(pyramid.depth() - 1);
    let step_px = f64::from(1u32 << k) / STEPS_PER_PX;
    let candidates = Candidates::new(widest(full), step_px);
    let costs = volume_of(directions, &[k], candidates);
    let mut found = minima(&aggregated(&costs, &pyramid.guides[k], STEPS_PER_PX)).disparity_px;
    found.sort_by(f64::total_cmp);
    let at = |share: f64| found[((found.len() - 1) as f64 * share).round() as usize];
    let (low, high) = (at(TAIL), at(1.0 - TAIL));
    let margin = 0.25 * (high - low).max(0.5) + step_px;
    [low - margin, high + margin]
}

/// All that is looked for in a picture, px.
pub(super) fn widest(picture: &Guide) -> [f64; 2] {
    let most = picture.width() as f64 * MOST_OF_WIDTH;
    [-most, most]
}

/// The levels that are matched: that at which the range is [`REACH_PX`], and the next coarser one.
pub(super) fn levels(range_px: [f64; 2], pyramid: &Pyramid) -> Vec<usize> {
    let most = range_px[0].abs().max(range_px[1].abs());
    let top = pyramid.depth() - 1;
    let fine = ((most / REACH_PX).log2().round().max(0.0) as usize).min(top);
    (fine..=(fine + 1).min(top)).collect()
}
