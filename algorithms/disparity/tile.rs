//! Correlations of a tile of nodes at every whole-pixel shift, by sums over blocks of the stride's size.
//!
//! Each window is cut into blocks of stride × stride pixels with a rest of `window mod stride` on the right and below;
//! neighbouring windows share their blocks:
//!
//! ```text
//!        s   s   s  r          s: stride, r: rest, Q = ⌊window/s⌋
//!      ┌───┬───┬───┬─┐
//!    s │   │   │   │ │         a column of the tile is a node: its pixel column is kept by "phases", [c][m] = a(s m + c),
//!      ├───┼───┼───┼─┤         so that one vector holds the same pixel of the windows of many nodes, and all sums run
//!    r └───┴───┴───┴─┘         along nodes without a shuffle
//! ```
//!
//! A shift costs each node s² products and s² + 3 (Q + 1) additions: at stride 4 and window 21, 2 s² + 18 = 50 operations of
//! one lane, 4050 for the 81 shifts of ±4 px, against 71 000 for the windows one by one. Nothing runs on from block to
//! block, so that f32 is enough: the tile's own level is taken off first, and rounding does not add up.

use std::ops::Range;

use quadpixel::simd::SimdLevel;

use super::Limits;
use super::geometry::Grid;
#[cfg(target_arch = "x86_64")]
use super::lanes::avx2;
use super::lanes::{LANES, Lanes};
use super::peak::{Surface, high};
use super::plane::{Plane, WindowStatistics};

/// Vectors that are summed together.
const VECTORS: usize = 4;
/// Their lanes.
const CHUNK: usize = VECTORS * LANES;
/// Lanes of a full tile; its nodes are fewer by what the last window reaches over.
const WIDTH: usize = 64;
/// Rows of nodes in a tile.
pub(super) const ROWS: usize = 16;

/// What a search compares.
pub(super) struct Pair<'a> {
    pub a: &'a Plane,
    pub b: &'a Plane,
    pub statistics: &'a [WindowStatistics; 2],
    pub grid: &'a Grid,
    pub window: usize,
    pub radius: [i32; 2],
}

/// Nodes of a row that one tile takes.
pub(super) fn columns(window: usize, stride: usize) -> usize {
    WIDTH.saturating_sub(window / stride + 1).max(CHUNK)
}

/// ZNCC \[row\]\[shift\]\[node\] of a tile; shifts row by row from the most negative; NaN where the window leaves B.
pub(super) struct Scores {
    data: Vec<f32>,
    shifts: usize,
    lanes: usize,
}

impl Scores {
    /// All shifts of one node of the tile.
    pub fn surface(&self, row: usize, column: usize, radius: [i32; 2]) -> Surface<'_> {
        Surface {
            zncc: &self.row(row)[column..],
            step: self.lanes,
            radius,
            centre: [0, 0],
        }
    }

    fn row(&self, row: usize) -> &[f32] {
        let length = self.shifts * self.lanes;
        &self.data[row * length..(row + 1) * length]
    }

    /// For each lane of a row: the shift of the largest value (the first of several), and how many values are [`high`].
    pub fn summits(
        &self,
        row: usize,
        limits: &Limits,
    ) -> impl Iterator<Item = Option<(usize, u32)>> {
        let mut best = vec![f32::NEG_INFINITY; self.lanes];
        let mut index = vec![u32::MAX; self.lanes];
        for (shift, values) in (0..).zip(self.row(row).chunks_exact(self.lanes)) {
            for ((best, index), &value) in best.iter_mut().zip(&mut index).zip(values) {
                // NaN loses every comparison.
                let above = value > *best;
                *index = if above { shift } else { *index };
                *best = if above { value } else { *best };
            }
        }
        for best in &mut best {
            *best = high(*best, limits);
        }
        let mut count = vec![0u32; self.lanes];
        for values in self.row(row).chunks_exact(self.lanes) {
            for ((count, &limit), &value) in count.iter_mut().zip(&best).zip(values) {
                *count += u32::from(value > limit);
            }
        }
        (index.into_iter().zip(count))
            .map(|(index, count)| (index != u32::MAX).then_some((index as usize, count)))
    }
}

/// Pixels of a plane by phases: \[row\]\[phase\]\[lane\], from pixel (x, y) on; `outside` beyond the plane.
struct Phases {
    data: Vec<f32>,
    phases: usize,
    lanes: usize,
}

impl Phases {
    #[inline(always)]
    fn new(
        plane: (&[f32], usize),
        from: [isize; 2],
        [stride, phases, lanes, rows]: [usize; 4],
        level: f32,
        outside: f32,
    ) -> Self {
        let (pixels, width) = plane;
        let mut data = vec![outside; rows * phases * lanes];
        for (r, to) in data.chunks_exact_mut(phases * lanes).enumerate() {
            let Some(y) = usize::try_from(from[1] + r as isize).ok() else {
                continue;
            };
            let Some(row) = pixels.get(y * width..(y + 1) * width) else {
                continue;
            };
            for (c, to) in to.chunks_exact_mut(lanes).enumerate() {
                let first = from[0] + c as isize;
                let skipped = (-first).max(0) as usize;
                let skipped = skipped.div_ceil(stride).min(lanes);
                let start = (first + (skipped * stride) as isize) as usize;
                let Some(row) = row.get(start..) else {
                    continue;
                };
                for (to, v) in to[skipped..].iter_mut().zip(row.iter().step_by(stride)) {
                    *to = v - level;
                }
            }
        }
        Self {
            data,
            phases,
            lanes,
        }
    }

    #[inline(always)]
    fn row(&self, r: usize) -> &[f32] {
        let length = self.phases * self.lanes;
        &self.data[r * length..(r + 1) * length]
    }
}

impl Pair<'_> {
    /// All correlations of the nodes in `rows` × `columns`, with the widest instructions; they change the speed only.
    pub fn scores(&self, rows: Range<usize>, columns: Range<usize>, level: SimdLevel) -> Scores {
        #[cfg(target_arch = "x86_64")]
        if level >= SimdLevel::Avx2 {
            // SAFETY: `detect` found AVX2 or more on this CPU.
            return unsafe { self.scores_avx2(rows, columns) };
        }
        self.scores_with::<[f32; LANES]>(rows, columns)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn scores_avx2(&self, rows: Range<usize>, columns: Range<usize>) -> Scores {
        self.scores_with::<avx2::Register>(rows, columns)
    }

    #[inline(always)]
    fn scores_with<V: Lanes>(&self, rows: Range<usize>, columns: Range<usize>) -> Scores {
        let (window, stride) = (self.window, self.grid.stride_px);
        let (full, rest) = (window / stride, window % stride);
        let side = window.min(stride);
        let [rx, ry] = self.radius.map(|r| r as usize);
        let lanes = (columns.len() + full + 1).next_multiple_of(CHUNK);
        let blocks = rows.len() + full;
        let half = window / 2;
        let pixel = [columns.start, rows.start].map(|n| self.grid.first_px + n * stride);
        let corner = pixel.map(|p| (p - half) as isize);
        let shifted = |p: [isize; 2]| [p[0] - rx as isize, p[1] - ry as isize];

        // The levels of the tile's first windows: sums of small numbers keep their digits.
        let [of_a, of_b] = self.statistics;
        let width = self.a.width;
        let first = pixel[1] * width + pixel[0];
        let levels = [of_a.mean[first], of_b.mean[first]];
        let plane_rows = (blocks - 1) * stride + side;
        let phases_b = stride.min(side + 2 * rx);
        let lanes_b = lanes + (side + 2 * rx) / stride + 1;
        let sizes_b = |rows| [stride, phases_b, lanes_b, rows];
        let a = Phases::new(
            (&self.a.data, width),
            corner,
            [stride, side, lanes, plane_rows],
            levels[0],
            0.0,
        );
        let b = Phases::new(
            (&self.b.data, width),
            shifted(corner),
            sizes_b(plane_rows + 2 * ry),
            levels[1],
            0.0,
        );
        let centre = pixel.map(|p| p as isize);
        let node_rows = (rows.len() - 1) * stride + 1;
        let mean_a = Phases::new(
            (&of_a.mean, width),
            centre,
            [stride, 1, lanes, node_rows],
            levels[0],
            0.0,
        );
        let norm_a = Phases::new(
            (&of_a.inverse_norm, width),
            centre,
            [stride, 1, lanes, node_rows],
            0.0,
            f32::NAN,
        );
        let mean_b = Phases::new(
            (&of_b.mean, width),
            shifted(centre),
            sizes_b(node_rows + 2 * ry),
            levels[1],
            0.0,
        );
        let norm_b = Phases::new(
            (&of_b.inverse_norm, width),
            shifted(centre),
            sizes_b(node_rows + 2 * ry),
            0.0,
            f32::NAN,
        );

        let shifts = (2 * rx + 1) * (2 * ry + 1);
        let mut scores = Scores {
            data: vec![f32::NAN; rows.len() * shifts * lanes],
            shifts,
            lanes,
        };
        let n = (window * window) as f32;
        // Sums over the full blocks of a row of blocks and its rest, [block][lane]: over all its rows, and the first `rest`.
        let mut across = [0, 1].map(|_| vec![0.0f32; blocks * lanes]);
        let mut sums = BlockSums::new(lanes, full);
        // Where the phase and the lane of column c at shift dx lie in a row of b.
        let place = |c: usize| c % stride * lanes_b + c / stride;
        let mut places = vec![0; side];
        for dy in 0..=2 * ry {
            for dx in 0..=2 * rx {
                for (c, place_c) in places.iter_mut().enumerate() {
                    *place_c = place(c + dx);
                }
                for block in 0..blocks {
                    let line = block * stride;
                    sums.add::<V>((&a, line), (&b, line + dy), &places, rest, side);
                    let [all, part] = &mut across;
                    let to = block * lanes..(block + 1) * lanes;
                    sums.across::<V>(&mut all[to.clone()], &mut part[to], full);
                }
                let shift = dy * (2 * rx + 1) + dx;
                for row in 0..rows.len() {
                    let line = row * stride;
                    let at = place(dx)..place(dx) + lanes;
                    let (mean_b, norm_b) = (
                        &mean_b.row(line + dy)[at.clone()],
                        &norm_b.row(line + dy)[at],
                    );
                    let (mean_a, norm_a) = (mean_a.row(line), norm_a.row(line));
                    let from = (row * shifts + shift) * lanes;
                    let out = &mut scores.data[from..from + lanes];
                    let [all, part] = &across;
                    let n = V::splat(n);
                    for chunk in 0..lanes / LANES {
                        let m = chunk * LANES;
                        let mut sum = V::load(&part[(row + full) * lanes + m..]);
                        for block in row..row + full {
                            sum = sum.plus(V::load(&all[block * lanes + m..]));
                        }
                        let means = V::load(&mean_a[m..]).times(V::load(&mean_b[m..]));
                        let norms = V::load(&norm_a[m..]).times(V::load(&norm_b[m..]));
                        (sum.minus(n.times(means)).times(norms)).store(&mut out[m..]);
                    }
                }
            }
        }
        scores
    }
}

/// Sum of the products in some rows and columns of the blocks from lane `m` on.
#[inline(always)]
fn products<V: Lanes>(
    (a, line_a): (&Phases, usize),
    (b, line_b): (&Phases, usize),
    places: &[usize],
    m: usize,
    rows: Range<usize>,
    columns: Range<usize>,
) -> [V; VECTORS] {
    let mut sum = [V::splat(0.0); VECTORS];
    for r in rows {
        let (row_a, row_b) = (a.row(line_a + r), b.row(line_b + r));
        for c in columns.start..columns.end {
            let of_a = &row_a[c * a.lanes + m..][..CHUNK];
            let of_b = &row_b[places[c] + m..][..CHUNK];
            for q in 0..VECTORS {
                let product = V::load(&of_a[q * LANES..]).times(V::load(&of_b[q * LANES..]));
                sum[q] = sum[q].plus(product);
            }
        }
    }
    sum
}

/// Sums of products over blocks: all or the first `rest` of their rows, and the same of their columns; \[lane\].
struct BlockSums {
    /// All rows: all columns, the first ones.
    all: [Vec<f32>; 2],
    /// The first rows: all columns, the first ones.
    part: [Vec<f32>; 2],
}

impl BlockSums {
    /// For so many lanes, and a window that reaches over `full` more.
    fn new(lanes: usize, full: usize) -> Self {
        let two = || [vec![0.0; lanes + full], vec![0.0; lanes + full]];
        Self {
            all: two(),
            part: two(),
        }
    }

    /// Of the blocks from a line of `a` and one of `b` on.
    #[inline(always)]
    fn add<V: Lanes>(
        &mut self,
        a: (&Phases, usize),
        b: (&Phases, usize),
        places: &[usize],
        rest: usize,
        side: usize,
    ) {
        for chunk in 0..a.0.lanes / CHUNK {
            let m = chunk * CHUNK;
            let corner = products::<V>(a, b, places, m, 0..rest, 0..rest);
            let right = products::<V>(a, b, places, m, 0..rest, rest..side);
            let below = products::<V>(a, b, places, m, rest..side, 0..rest);
            let body = products::<V>(a, b, places, m, rest..side, rest..side);
            for q in 0..VECTORS {
                let at = m + q * LANES;
                let (part, left) = (corner[q].plus(right[q]), corner[q].plus(below[q]));
                corner[q].store(&mut self.part[1][at..]);
                part.store(&mut self.part[0][at..]);
                left.store(&mut self.all[1][at..]);
                (part.plus(below[q].plus(body[q]))).store(&mut self.all[0][at..]);
            }
        }
    }

    /// Sums along a row of blocks, over the width of a window; the vectors' last lanes reach into the padding.
    #[inline(always)]
    fn across<V: Lanes>(&self, all: &mut [f32], part: &mut [f32], full: usize) {
        for chunk in 0..all.len() / LANES {
            let m = chunk * LANES;
            let mut sum_all = V::load(&self.all[1][m + full..]);
            let mut sum_part = V::load(&self.part[1][m + full..]);
            for block in 0..full {
                sum_all = sum_all.plus(V::load(&self.all[0][m + block..]));
                sum_part = sum_part.plus(V::load(&self.part[0][m + block..]));
            }
            sum_all.store(&mut all[m..]);
            sum_part.store(&mut part[m..]);
        }
    }
}
