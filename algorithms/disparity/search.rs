//! Whole-pixel search by ZNCC: every shift by box sums at full resolution up to 4 px, coarse to fine beyond.
//!
//! `ZNCC(d) = (Σ a(x) b(x+d) − n ā b̄) / √(Σ(a−ā)² Σ(b−b̄)²)`. The sum of products runs down the columns in f64 (each
//! row enters once and leaves once, as the very same product, so nothing drifts) and is summed along the rows where there
//! are nodes: the cost per pixel and shift does not depend on the window.

use std::ops::Range;

use rayon::prelude::*;

use super::geometry::{Axes, Grid};
use super::peak::{Peak, Surface};
use super::plane::{Plane, WindowStatistics};
use super::{DIRECT_SEARCH_PX, MatchSettings, Verdict};
use quadpixel::simd::SimdLevel;

/// Rows of nodes that one task does; it starts its column sums anew.
const ROWS_A_TASK: usize = 32;

/// Reach of the search about a coarse guess, px: it covers half a coarse pixel and the change between coarse nodes.
const LOCAL_RADIUS: i32 = 2;

/// The best whole-pixel shift at each node.
pub(super) fn whole_pixels(
    a: &Plane,
    b: &Plane,
    statistics: &[WindowStatistics; 2],
    grid: &Grid,
    settings: &MatchSettings,
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
            );
            let task = Task::new(a, b, statistics, grid, settings);
            return (0..grid.len())
                .into_par_iter()
                .map(|node| task.about_guess(node, &guess(&coarse, &coarse_grid, grid, node)))
                .collect();
        }
    }
    let task = Task::new(a, b, statistics, grid, settings);
    let level = SimdLevel::detect();
    let bands: Vec<Vec<Peak>> = (0..grid.rows.div_ceil(ROWS_A_TASK))
        .into_par_iter()
        .map(|band| {
            let first = band * ROWS_A_TASK;
            task.band(first..(first + ROWS_A_TASK).min(grid.rows), level)
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
struct Task<'a> {
    a: &'a Plane,
    b: &'a Plane,
    statistics: &'a [WindowStatistics; 2],
    grid: &'a Grid,
    settings: &'a MatchSettings,
    radius: [i32; 2],
}

impl<'a> Task<'a> {
    fn new(
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

    /// The whole range of shifts for some rows of nodes, with the widest instructions; they change the speed only.
    fn band(&self, rows: Range<usize>, level: SimdLevel) -> Vec<Peak> {
        #[cfg(target_arch = "x86_64")]
        if level >= SimdLevel::Avx2 {
            // SAFETY: `detect` found AVX2 or more on this CPU.
            return unsafe { self.band_avx2(rows) };
        }
        self.band_plain(rows)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn band_avx2(&self, rows: Range<usize>) -> Vec<Peak> {
        self.band_plain(rows)
    }

    #[inline(always)]
    fn band_plain(&self, rows: Range<usize>) -> Vec<Peak> {
        let [rx, ry] = self.radius;
        let shifts: Vec<[i32; 2]> = (-ry..=ry)
            .flat_map(|dy| (-rx..=rx).map(move |dx| [dx, dy]))
            .collect();
        let columns = self.grid.columns;
        // [row of nodes][shift][node]: what one row of nodes needs stays together in the cache.
        let mut scores = vec![f32::NAN; rows.len() * shifts.len() * columns];
        let mut sums = ColumnSums::new(self.a.width);
        for (s, &shift) in shifts.iter().enumerate() {
            sums.last_centre = None;
            for row in rows.clone() {
                let at = ((row - rows.start) * shifts.len() + s) * columns;
                self.correlate(row, shift, &mut sums, &mut scores[at..at + columns]);
            }
        }
        let mut surface = vec![0.0f32; shifts.len()];
        let mut peaks = Vec::with_capacity(rows.len() * columns);
        for row in rows.clone() {
            for column in 0..columns {
                let at = (row - rows.start) * shifts.len() * columns + column;
                for (s, value) in surface.iter_mut().enumerate() {
                    *value = scores[at + s * columns];
                }
                peaks.push(self.peak(row * columns + column, &surface, self.radius, [0, 0]));
            }
        }
        peaks
    }

    /// ZNCC of one row of nodes at one shift; NaN stays where the window leaves B.
    #[inline(always)]
    fn correlate(&self, row: usize, [dx, dy]: [i32; 2], sums: &mut ColumnSums, out: &mut [f32]) {
        let half = self.settings.window_px / 2;
        let (width, height) = (self.a.width, self.a.height);
        let y = self.grid.first_px + row * self.grid.stride_px;
        let Some(yb) = y.checked_add_signed(dy as isize) else {
            return;
        };
        if yb < half || yb + half >= height {
            return;
        }
        sums.move_to(self.a, self.b, y, half, [dx, dy]);
        let prefix = &mut sums.prefix;
        let mut total = 0.0f64;
        for (sum, column) in prefix[1..].iter_mut().zip(&sums.columns) {
            total += column;
            *sum = total;
        }
        let [of_a, of_b] = self.statistics;
        let n = (self.settings.window_px * self.settings.window_px) as f32;
        for (node, score) in out.iter_mut().enumerate() {
            let x = self.grid.first_px + node * self.grid.stride_px;
            let Some(xb) = x.checked_add_signed(dx as isize) else {
                continue;
            };
            if xb < half || xb + half >= width {
                continue;
            }
            let (ia, ib) = (y * width + x, yb * width + xb);
            let products = prefix[x + half + 1] - prefix[x - half];
            let covariance = products - f64::from(n * of_a.mean[ia]) * f64::from(of_b.mean[ib]);
            let norm = f64::from(of_a.inverse_norm[ia]) * f64::from(of_b.inverse_norm[ib]);
            *score = (covariance * norm) as f32;
        }
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
        self.peak(node, &surface, radius, centre)
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

    fn peak(&self, node: usize, surface: &[f32], radius: [i32; 2], centre: [i32; 2]) -> Peak {
        let (x, y) = self.grid.pixel(node);
        if self.statistics[0].inverse_norm[y * self.a.width + x] == 0.0 {
            return Peak::none(Verdict::Textureless);
        }
        let surface = Surface {
            zncc: surface,
            radius,
            centre,
        };
        surface.peak(self.settings.axes.free(), &self.settings.limits)
    }
}

fn radius(axes: Axes, px: i32) -> [i32; 2] {
    axes.free().map(|free| if free { px } else { 0 })
}

/// Running sums of a(x, y)·b(x+dx, y+dy) over the window's rows, one a column.
struct ColumnSums {
    columns: Vec<f64>,
    /// prefix\[x\]: sum of the columns left of x.
    prefix: Vec<f64>,
    last_centre: Option<usize>,
}

impl ColumnSums {
    fn new(width: usize) -> Self {
        Self {
            columns: vec![0.0; width],
            prefix: vec![0.0; width + 1],
            last_centre: None,
        }
    }

    #[inline(always)]
    fn move_to(&mut self, a: &Plane, b: &Plane, centre: usize, half: usize, shift: [i32; 2]) {
        let window = 2 * half + 1;
        let from = self.last_centre.filter(|last| centre - last < window);
        self.last_centre = Some(centre);
        match from {
            None => {
                self.columns.fill(0.0);
                for y in centre - half..=centre + half {
                    let (range, pa, pb) = overlap(a, b, y, shift);
                    for ((sum, &va), &vb) in self.columns[range].iter_mut().zip(pa).zip(pb) {
                        *sum += f64::from(va * vb);
                    }
                }
            }
            Some(last) => {
                for step in 0..centre - last {
                    let (range, new_a, new_b) = overlap(a, b, last + half + 1 + step, shift);
                    let (_, old_a, old_b) = overlap(a, b, last - half + step, shift);
                    let new = new_a.iter().zip(new_b);
                    let old = old_a.iter().zip(old_b);
                    for ((sum, (na, nb)), (oa, ob)) in
                        self.columns[range].iter_mut().zip(new).zip(old)
                    {
                        *sum += f64::from(na * nb) - f64::from(oa * ob);
                    }
                }
            }
        }
    }
}

/// The part of row `y` of A and of row `y + dy` of B that lie on each other at `shift`, with its columns in A.
fn overlap<'p>(
    a: &'p Plane,
    b: &'p Plane,
    y: usize,
    [dx, dy]: [i32; 2],
) -> (Range<usize>, &'p [f32], &'p [f32]) {
    let yb = (y as isize + dy as isize) as usize;
    let apart = (dx.unsigned_abs() as usize).min(a.width);
    let length = a.width - apart;
    let (xa, xb) = if dx < 0 { (apart, 0) } else { (0, apart) };
    (
        xa..xa + length,
        &a.row(y)[xa..xa + length],
        &b.row(yb)[xb..xb + length],
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::image::Image;

    fn noise(width: usize, height: usize, mut state: u64) -> Plane {
        let data = (0..width * height)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f32 / 2f32.powi(31)
            })
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
            let mut sums = ColumnSums::new(61);
            let mut row_of_scores = vec![f32::NAN; grid.columns];
            let [rx, ry] = task.radius;
            for shift in [[0, 0], [rx, ry], [-rx, ry], [-3, -ry]] {
                sums.last_centre = None;
                for row in 0..grid.rows {
                    row_of_scores.fill(f32::NAN);
                    task.correlate(row, shift, &mut sums, &mut row_of_scores);
                    for (column, &score) in row_of_scores.iter().enumerate() {
                        let (x, y) = grid.pixel(row * grid.columns + column);
                        let direct = task.zncc([x, y], shift);
                        assert!((score - direct).abs() < 1e-5, "{score} {direct}");
                    }
                }
            }
        }
    }
}
