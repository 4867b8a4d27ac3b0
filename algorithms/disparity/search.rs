//! Whole-pixel search by ZNCC: every shift at full resolution up to 4 px, coarse to fine beyond.
//!
//! `ZNCC(d) = (Σ a(x) b(x+d) − n ā b̄) / √(Σ(a−ā)² Σ(b−b̄)²)`. The sums of products come from blocks that neighbouring
//! windows share ([`super::tile`]), so that the cost per pixel and shift does not depend on the window.

use std::ops::Range;

use rayon::prelude::*;

use super::geometry::{Axes, Grid};
use super::peak::{Peak, Surface};
use super::plane::{Plane, WindowStatistics};
use super::tile::{self, Pair, Scores};
use super::{DIRECT_SEARCH_PX, MatchSettings, Verdict};
use quadpixel::simd::SimdLevel;

/// Reach of the search about a coarse guess, px: it covers half a coarse pixel and the change between coarse nodes.
const LOCAL_RADIUS: i32 = 2;

/// The best whole-pixel shift at each node.
pub(super) fn whole_pixels(
    a: &Plane,
    b: &Plane,
    statistics: &[WindowStatistics; 2],
    grid: &Grid,
    settings: &MatchSettings,
    level: SimdLevel,
) -> Vec<Peak> {
    if settings.search_px > DIRECT_SEARCH_PX {
        let (coarse_a, coarse_b) = (a.halved(), b.halved());
        let coarse_settings = MatchSettings {
            // One more, so that a match within the range does not lie at the coarse range's end.
            search_px: settings.search_px.div_ceil(2) + 1,
            ..*settings
        };
        if let Some(coarse_grid) = Grid::new(coarse_a.width, coarse_a.height, &coarse_settings) {
            let half = settings.window_px / 2;
            let coarse_statistics = [
                WindowStatistics::new(&coarse_a, half),
                WindowStatistics::new(&coarse_b, half),
            ];
            let coarse = whole_pixels(
                &coarse_a,
                &coarse_b,
                &coarse_statistics,
                &coarse_grid,
                &coarse_settings,
                level,
            );
            let task = Task::new(a, b, statistics, grid, settings);
            return (0..grid.len())
                .into_par_iter()
                .map(|node| task.about_guess(node, &guess(&coarse, &coarse_grid, grid, node)))
                .collect();
        }
    }
    let task = Task::new(a, b, statistics, grid, settings);
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
    a: &'a Plane,
    b: &'a Plane,
    statistics: &'a [WindowStatistics; 2],
    grid: &'a Grid,
    settings: &'a MatchSettings,
    radius: [i32; 2],
}

impl<'a> Task<'a> {
    pub fn new(
        a: &'a Plane,
        b: &'a Plane,
        statistics: &'a [WindowStatistics; 2],
        grid: &'a Grid,
        settings: &'a MatchSettings,
    ) -> Self {
        Self {
            a,
            b,
            statistics,
            grid,
            settings,
            radius: radius(settings.axes, settings.search_px as i32),
        }
    }

    /// What the tiles compare.
    pub fn pair(&self) -> Pair<'_> {
        // No window reaches B from farther than this: the search may be wider than a small picture.
        let reach = |size: usize| (size - self.settings.window_px) as i32;
        let [width, height] = [self.a.width, self.a.height].map(reach);
        Pair {
            a: self.a,
            b: self.b,
            statistics: self.statistics,
            grid: self.grid,
            window: self.settings.window_px,
            radius: [self.radius[0].min(width), self.radius[1].min(height)],
        }
    }

    /// The whole range of shifts for some rows of nodes.
    fn band(&self, rows: Range<usize>, level: SimdLevel) -> Vec<Peak> {
        let pair = self.pair();
        let columns = self.grid.columns;
        let a_tile = tile::columns(self.settings.window_px, self.settings.stride_px);
        let mut peaks = vec![Peak::none(Verdict::Outside); rows.len() * columns];
        for first in (0..columns).step_by(a_tile) {
            let across = first..(first + a_tile).min(columns);
            let scores = pair.scores(rows.clone(), across.clone(), level);
            for row in 0..rows.len() {
                let to = &mut peaks[row * columns..][across.clone()];
                let node = (rows.start + row) * columns + first;
                self.peaks(node, &scores, row, pair.radius, to);
            }
        }
        peaks
    }

    /// Peaks of a row of a tile, whose first node is `node`.
    fn peaks(
        &self,
        node: usize,
        scores: &Scores,
        row: usize,
        radius: [i32; 2],
        peaks: &mut [Peak],
    ) {
        let limits = &self.settings.limits;
        let summits = scores.summits(row, limits);
        for (i, (peak, summit)) in peaks.iter_mut().zip(summits).enumerate() {
            *peak = if self.is_flat(node + i) {
                Peak::none(Verdict::Textureless)
            } else if let Some((index, high)) = summit {
                let surface = scores.surface(row, i, radius);
                surface.judge(index, Some(high), self.settings.axes.free(), limits)
            } else {
                Peak::none(Verdict::Outside)
            };
        }
    }

    /// Whether the window of A shows nothing.
    fn is_flat(&self, node: usize) -> bool {
        let (x, y) = self.grid.pixel(node);
        self.statistics[0].inverse_norm[y * self.a.width + x] == 0.0
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
        let (x, y) = self.grid.pixel(node);
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
        let half = self.settings.window_px / 2;
        let inside = |p: usize, d: i32, size: usize| {
            let q = p.checked_add_signed(d as isize)?;
            (q >= half && q + half < size).then_some(q)
        };
        let (Some(xb), Some(yb)) = (inside(x, dx, self.a.width), inside(y, dy, self.a.height))
        else {
            return f32::NAN;
        };
        let window = self.settings.window_px;
        let [of_a, of_b] = self.statistics;
        let (ia, ib) = (y * self.a.width + x, yb * self.a.width + xb);
        let mut lanes = [0.0f64; 8];
        for k in 0..window {
            let row_a = &self.a.row(y - half + k)[x - half..x - half + window];
            let row_b = &self.b.row(yb - half + k)[xb - half..xb - half + window];
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
        let (a, b) = (noise(61, 47, 1), noise(61, 47, 2));
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
            let grid = Grid::new(61, 47, &settings).unwrap();
            let statistics = [&a, &b].map(|p| WindowStatistics::new(p, window_px / 2));
            let task = Task::new(&a, &b, &statistics, &grid, &settings);
            let pair = task.pair();
            let [rx, ry] = task.radius;
            for level in SimdLevel::ALL {
                if level > SimdLevel::detect() {
                    continue;
                }
                let scores = pair.scores(0..grid.rows, 0..grid.columns, level);
                for node in 0..grid.len() {
                    let (row, column) = (node / grid.columns, node % grid.columns);
                    let surface = scores.surface(row, column, task.radius);
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
