//! Whole-pixel search by ZNCC: every shift at full resolution up to 4 px, coarse to fine beyond.
//!
//! `ZNCC(d) = (Σ a(x) b(x+d) − n ā b̄) / √(Σ(a−ā)² Σ(b−b̄)²)`. The sums of products come from blocks that neighbouring
//! windows share ([`super::tile`]), so that the cost per pixel and shift does not depend on the window.

use std::ops::Range;

use rayon::prelude::*;

use super::geometry::{Axes, Grid};
use super::matches::Verdict;
use super::peak::{Peak, Surface};
use super::prepared::Prepared;
use super::settings::{DIRECT_SEARCH_PX, MatchSettings};
use super::tile::{self, Pair, Scores};
use quadpixel::simd::SimdLevel;

/// Reach of the search about a coarse guess, px: it covers half a coarse pixel and the change between coarse nodes.
const LOCAL_RADIUS: i32 = 2;

/// The best whole-pixel shift at each node.
pub(super) fn whole_pixels(
    pictures: &Prepared,
    settings: &MatchSettings,
    level: SimdLevel,
) -> Vec<Peak> {
    let grid = &pictures.grid;
    let task = Task::new(pictures, settings);
    if settings.search_px > DIRECT_SEARCH_PX {
        let coarse_settings = MatchSettings {
            // One more, so that a match within the range does not lie at the coarse range's end.
            search_px: settings.search_px.div_ceil(2) + 1,
            ..*settings
        };
        let (a, b) = (pictures.a.halved(), pictures.b.halved());
        if let Some(halved) = Prepared::from_planes(a, b, &coarse_settings) {
            let coarse = whole_pixels(&halved, &coarse_settings, level);
            return (0..grid.len())
                .into_par_iter()
                .map(|node| task.about_guess(node, &guess(&coarse, &halved.grid, grid, node)))
                .collect();
        }
    }
    let bands: Vec<Vec<Peak>> = (0..grid.rows.div_ceil(tile::ROWS))
        .into_par_iter()
        .map(|band| {
            let first = band * tile::ROWS;
            task.band(first..(first + tile::ROWS).min(grid.rows), level)
        })
        .collect();
    bands.concat()
}

/// The coarse match at or next to a fine node; of several valid ones that of the highest correlation.
fn guess(coarse: &[Peak], coarse_grid: &Grid, grid: &Grid, node: usize) -> Peak {
    let (x, y) = grid.pixel(node);
    let column = coarse_grid.nearest(x / 2, coarse_grid.columns);
    let row = coarse_grid.nearest(y / 2, coarse_grid.rows);
    let here = coarse[row * coarse_grid.columns + column];
    if here.verdict == Verdict::Valid {
        return here;
    }
    let rows = row.saturating_sub(1)..(row + 2).min(coarse_grid.rows);
    rows.flat_map(|r| {
        let columns = column.saturating_sub(1)..(column + 2).min(coarse_grid.columns);
        columns.map(move |c| coarse[r * coarse_grid.columns + c])
    })
    .filter(|peak| peak.verdict == Verdict::Valid)
    .max_by(|p, q| p.zncc.total_cmp(&q.zncc))
    .unwrap_or(here)
}

/// All that one search needs.
pub(super) struct Task<'a> {
    pictures: &'a Prepared,
    settings: &'a MatchSettings,
    radius: [i32; 2],
}

impl<'a> Task<'a> {
    pub fn new(pictures: &'a Prepared, settings: &'a MatchSettings) -> Self {
        Self {
            pictures,
            settings,
            radius: radius(settings.axes, settings.search_px as i32),
        }
    }

    /// What the tiles compare.
    pub fn pair(&self) -> Pair<'_> {
        // No window reaches B from farther than this: the search may be wider than a small picture.
        let reach = |size: usize| (size - self.settings.window_px) as i32;
        let [width, height] = [self.pictures.a.width, self.pictures.a.height].map(reach);
        Pair {
            pictures: self.pictures,
            window: self.settings.window_px,
            radius: [self.radius[0].min(width), self.radius[1].min(height)],
        }
    }

    /// The whole range of shifts for some rows of nodes.
    fn band(&self, rows: Range<usize>, level: SimdLevel) -> Vec<Peak> {
        let pair = self.pair();
        let columns = self.pictures.grid.columns;
        let a_tile = tile::columns(self.settings.window_px, self.settings.stride_px);
        let mut peaks = vec![Peak::none(Verdict::Outside); rows.len() * columns];
        for first in (0..columns).step_by(a_tile) {
            let across = first..(first + a_tile).min(columns);
            let scores = pair.scores(rows.clone(), across.clone(), level);
            for row in 0..rows.len() {
                let to = &mut peaks[row * columns..][across.clone()];
                let node = (rows.start + row) * columns + first;
                self.peaks(node, &scores, row, to);
            }
        }
        peaks
    }

    /// Peaks of a row of a tile, whose first node is `node`.
    fn peaks(&self, node: usize, scores: &Scores, row: usize, peaks: &mut [Peak]) {
        let limits = &self.settings.limits;
        let summits = scores.summits(row, limits);
        for (i, (peak, summit)) in peaks.iter_mut().zip(summits).enumerate() {
            *peak = if self.is_flat(node + i) {
                Peak::none(Verdict::Textureless)
            } else if let Some((index, high)) = summit {
                let surface = scores.surface(row, i);
                surface.judge(index, Some(high), self.settings.axes.free(), limits)
            } else {
                Peak::none(Verdict::Outside)
            };
        }
    }

    /// Whether the window of A shows nothing.
    fn is_flat(&self, node: usize) -> bool {
        let (x, y) = self.pictures.grid.pixel(node);
        self.pictures.statistics[0].inverse_norm[y * self.pictures.a.width + x] == 0.0
    }

    /// A small range of shifts about twice the coarse shift, once moved if the best lies at its end.
    fn about_guess(&self, node: usize, coarse: &Peak) -> Peak {
        if coarse.verdict != Verdict::Valid {
            return Peak::none(coarse.verdict);
        }
        let doubled = |axis: usize| {
            (2.0 * (f64::from(coarse.whole[axis]) + coarse.fraction[axis])).round() as i32
        };
        let mut peak = self.local(node, [doubled(0), doubled(1)]);
        if peak.verdict == Verdict::SearchEdge {
            peak = self.local(node, peak.whole);
        }
        let range = self.settings.search_px as i32;
        if peak.verdict == Verdict::Valid && peak.whole.iter().any(|d| d.abs() >= range) {
            peak.verdict = Verdict::SearchEdge;
        }
        peak
    }

    fn local(&self, node: usize, centre: [i32; 2]) -> Peak {
        let radius = radius(self.settings.axes, LOCAL_RADIUS);
        let [rx, ry] = radius;
        let (x, y) = self.pictures.grid.pixel(node);
        let surface: Vec<f32> = (-ry..=ry)
            .flat_map(|j| (-rx..=rx).map(move |i| [centre[0] + i, centre[1] + j]))
            .map(|shift| self.zncc([x, y], shift))
            .collect();
        if self.is_flat(node) {
            return Peak::none(Verdict::Textureless);
        }
        let surface = Surface {
            zncc: &surface,
            step: 1,
            radius,
            centre,
        };
        surface.peak(self.settings.axes.free(), &self.settings.limits)
    }

    /// ZNCC of one window at one shift, summed directly; the oracle of the box sums.
    fn zncc(&self, [x, y]: [usize; 2], [dx, dy]: [i32; 2]) -> f32 {
        let Prepared { a, b, .. } = self.pictures;
        let half = self.settings.window_px / 2;
        let inside = |p: usize, d: i32, size: usize| {
            let q = p.checked_add_signed(d as isize)?;
            (q >= half && q + half < size).then_some(q)
        };
        let (Some(xb), Some(yb)) = (inside(x, dx, a.width), inside(y, dy, a.height)) else {
            return f32::NAN;
        };
        let window = self.settings.window_px;
        let [of_a, of_b] = &self.pictures.statistics;
        let (ia, ib) = (y * a.width + x, yb * a.width + xb);
        let mut lanes = [0.0f64; 8];
        for k in 0..window {
            let row_a = &a.row(y - half + k)[x - half..x - half + window];
            let row_b = &b.row(yb - half + k)[xb - half..xb - half + window];
            for (pa, pb) in row_a.chunks(8).zip(row_b.chunks(8)) {
                for ((lane, &va), &vb) in lanes.iter_mut().zip(pa).zip(pb) {
                    *lane += f64::from(va * vb);
                }
            }
        }
        let n = (window * window) as f64;
        let covariance =
            lanes.iter().sum::<f64>() - n * f64::from(of_a.mean[ia]) * f64::from(of_b.mean[ib]);
        (covariance * f64::from(of_a.inverse_norm[ia]) * f64::from(of_b.inverse_norm[ib])) as f32
    }
}

fn radius(axes: Axes, px: i32) -> [i32; 2] {
    axes.free().map(|free| if free { px } else { 0 })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::disparity::plane::Plane;
    use quadpixel::image::Image;

    fn noise(width: usize, height: usize, seed: u64) -> Plane {
        let mut random = crate::random::Lcg(seed);
        let data = (0..width * height)
            .map(|_| random.uniform() as f32)
            .collect();
        Plane::new(&Image::from_vec(width, height, 1, data).unwrap()).unwrap()
    }

    #[test]
    fn box_sums_give_the_correlation_that_direct_sums_give() {
        for (window_px, stride_px, axes) in [
            (7, 3, Axes::Both),
            (5, 9, Axes::Both),
            (9, 1, Axes::Horizontal),
        ] {
            let settings = MatchSettings {
                window_px,
                stride_px,
                axes,
                ..MatchSettings::default()
            };
            let [a, b] = [1, 2].map(|seed| noise(61, 47, seed));
            let pictures = Prepared::from_planes(a, b, &settings).unwrap();
            let (grid, task) = (pictures.grid, Task::new(&pictures, &settings));
            let pair = task.pair();
            let [rx, ry] = task.radius;
            for level in SimdLevel::ALL {
                if level > SimdLevel::detect() {
                    continue;
                }
                let scores = pair.scores(0..grid.rows, 0..grid.columns, level);
                for node in 0..grid.len() {
                    let (row, column) = (node / grid.columns, node % grid.columns);
                    let surface = scores.surface(row, column);
                    let mut values = surface.values().map(|(_, value)| value);
                    for dy in -ry..=ry {
                        for dx in -rx..=rx {
                            let direct = task.zncc(grid.pixel(node).into(), [dx, dy]);
                            let score = values.next().unwrap();
                            assert!((score - direct).abs() < 1e-5, "{score} {direct}");
                        }
                    }
                }
            }
        }
    }
}
