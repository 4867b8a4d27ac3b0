//! Correlations of a tile of nodes at every whole-pixel shift, by sums over blocks of the stride's size.
//!
//! Each window is cut into blocks of stride × stride pixels with a rest of `window mod stride` on the right and below;
//! neighbouring windows share their blocks:
//!
//! ```text
//!        s   s   s  r          s: stride, r: rest, Q = ⌊window/s⌋
//!      ┌───┬───┬───┬─┐
//!    s │   │   │   │ │      a column of the tile is a node: its pixel column is kept by "phases", [c][m] = a(s m + c),
//!      ├───┼───┼───┼─┤      so that one vector holds the same pixel of the windows of many nodes, and all sums run
//!    r └───┴───┴───┴─┘      along nodes without a shuffle
//! ```
//!
//! A shift costs each node s² products and s² + 3 (Q + 1) additions: at stride 4 and window 21, 2 s² + 18 = 50
//! operations of one lane, 4050 for the 81 shifts of ±4 px, against 71 000 for the windows one by one. Nothing runs on
//! from block to block, so that f32 is enough: the tile's own level is taken off first, and rounding does not add up.

use std::ops::Range;

use quadpixel::simd::SimdLevel;

use super::block_sums::{BlockSums, CHUNK, Lines};
#[cfg(target_arch = "x86_64")]
use super::lanes::avx2;
use super::lanes::{LANES, Lanes};
use super::peak::{Surface, high};
use super::phases::Phases;
use super::prepared::Prepared;
use super::settings::Limits;

/// Lanes of a full tile; its nodes are fewer by what the last window reaches over.
const WIDTH: usize = 64;
/// Rows of nodes in a tile.
pub(super) const ROWS: usize = 16;

/// What a search compares.
pub(super) struct Pair<'a> {
    pub pictures: &'a Prepared,
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
    radius: [i32; 2],
    shifts: usize,
    lanes: usize,
}

impl Scores {
    /// All shifts of one node of the tile.
    pub fn surface(&self, row: usize, column: usize) -> Surface<'_> {
        Surface {
            zncc: &self.row(row)[column..],
            step: self.lanes,
            radius: self.radius,
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
        let (window, stride) = (self.window, self.pictures.grid.stride_px);
        let (full, rest) = (window / stride, window % stride);
        let side = window.min(stride);
        let [rx, ry] = self.radius.map(|r| r as usize);
        let layout = Layout::new(self, &rows, &columns);
        let (lanes, blocks) = (layout.lanes, layout.blocks);
        let planes = TilePlanes::new(self, &layout, [rows.start, columns.start], rows.len());
        let shifts = (2 * rx + 1) * (2 * ry + 1);
        let mut scores = Scores {
            data: vec![f32::NAN; rows.len() * shifts * lanes],
            radius: self.radius,
            shifts,
            lanes,
        };
        // Sums over the full blocks of a row of blocks and its rest, [block][lane]: over all its rows, and the first
        // `rest`.
        let mut across = [0, 1].map(|_| vec![0.0f32; blocks * lanes]);
        let mut sums = BlockSums::new(lanes, full);
        let mut places = vec![0; side];
        for dy in 0..=2 * ry {
            for dx in 0..=2 * rx {
                for (c, place) in places.iter_mut().enumerate() {
                    *place = layout.place(c + dx);
                }
                for block in 0..blocks {
                    let line = block * stride;
                    let lines = Lines {
                        a: &planes.a,
                        line_a: line,
                        b: &planes.b,
                        line_b: line + dy,
                        places: &places,
                    };
                    sums.add::<V>(&lines, rest, side);
                    let [all, part] = &mut across;
                    let to = block * lanes..(block + 1) * lanes;
                    sums.across::<V>(&mut all[to.clone()], &mut part[to], full);
                }
                let shift = dy * (2 * rx + 1) + dx;
                for row in 0..rows.len() {
                    let line = row * stride;
                    let at = layout.place(dx)..layout.place(dx) + lanes;
                    let from = (row * shifts + shift) * lanes;
                    let statistics = [
                        planes.mean_a.row(line),
                        planes.norm_a.row(line),
                        &planes.mean_b.row(line + dy)[at.clone()],
                        &planes.norm_b.row(line + dy)[at],
                    ];
                    let out = &mut scores.data[from..from + lanes];
                    correlations::<V>(&across, statistics, row..row + full, window, out);
                }
            }
        }
        scores
    }
}

/// ZNCC of a row of nodes at one shift, from the sums `across` its rows of blocks (the full ones, and of the next one
/// the rest) and the windows' means and inverse norms.
#[inline(always)]
fn correlations<V: Lanes>(
    across: &[Vec<f32>; 2],
    [mean_a, norm_a, mean_b, norm_b]: [&[f32]; 4],
    blocks: Range<usize>,
    window: usize,
    out: &mut [f32],
) {
    let lanes = out.len();
    let n = V::splat((window * window) as f32);
    let [all, part] = across;
    let part = &part[blocks.end * lanes..][..lanes];
    let full_blocks = all[blocks.start * lanes..blocks.end * lanes].chunks_exact(lanes);
    for chunk in 0..lanes / LANES {
        let m = chunk * LANES;
        let mut sum = V::load(&part[m..]);
        for block in full_blocks.clone() {
            sum = sum.plus(V::load(&block[m..]));
        }
        let means = V::load(&mean_a[m..]).times(V::load(&mean_b[m..]));
        let norms = V::load(&norm_a[m..]).times(V::load(&norm_b[m..]));
        (sum.minus(n.times(means)).times(norms)).store(&mut out[m..]);
    }
}

/// How the planes of a tile are laid out.
struct Layout {
    stride: usize,
    /// Columns of a block.
    side: usize,
    /// Rows of blocks.
    blocks: usize,
    lanes: usize,
    /// Of B, which reaches farther by the search.
    phases_b: usize,
    lanes_b: usize,
}

impl Layout {
    fn new(pair: &Pair<'_>, rows: &Range<usize>, columns: &Range<usize>) -> Self {
        let (window, stride) = (pair.window, pair.pictures.grid.stride_px);
        let (full, side) = (window / stride, window.min(stride));
        let rx = pair.radius[0] as usize;
        let lanes = (columns.len() + full + 1).next_multiple_of(CHUNK);
        Self {
            stride,
            side,
            blocks: rows.len() + full,
            lanes,
            phases_b: stride.min(side + 2 * rx),
            lanes_b: lanes + (side + 2 * rx) / stride + 1,
        }
    }

    /// Where the phase and the lane of column c lie in a row of B.
    #[inline(always)]
    fn place(&self, c: usize) -> usize {
        c % self.stride * self.lanes_b + c / self.stride
    }
}

/// Pixels, means and inverse norms of a tile by phases.
struct TilePlanes {
    a: Phases,
    b: Phases,
    mean_a: Phases,
    norm_a: Phases,
    mean_b: Phases,
    norm_b: Phases,
}

impl TilePlanes {
    /// Of `count` rows of nodes from the node in row `first[0]` and column `first[1]` on.
    #[inline(always)]
    fn new(pair: &Pair<'_>, layout: &Layout, first: [usize; 2], count: usize) -> Self {
        let Prepared {
            a,
            b,
            grid,
            statistics: [of_a, of_b],
        } = pair.pictures;
        let stride = layout.stride;
        let [rx, ry] = pair.radius.map(|r| r as usize);
        let pixel = [first[1], first[0]].map(|n| grid.first_px + n * stride);
        let corner = pixel.map(|p| (p - pair.window / 2) as isize);
        let centre = pixel.map(|p| p as isize);
        let shifted = |p: [isize; 2]| [p[0] - rx as isize, p[1] - ry as isize];
        // The levels of the tile's first windows: sums of small numbers keep their digits.
        let width = a.width;
        let start = pixel[1] * width + pixel[0];
        let levels = [of_a.mean[start], of_b.mean[start]];
        let sizes_a = |phases, rows| [stride, phases, layout.lanes, rows];
        let sizes_b = |rows| [stride, layout.phases_b, layout.lanes_b, rows + 2 * ry];
        let plane_rows = (layout.blocks - 1) * stride + layout.side;
        let node_rows = (count - 1) * stride + 1;
        let phases = |values: &[f32], from, sizes, level, outside| {
            Phases::new((values, width), from, sizes, level, outside)
        };
        let nan = f32::NAN;
        Self {
            a: phases(
                &a.data,
                corner,
                sizes_a(layout.side, plane_rows),
                levels[0],
                0.0,
            ),
            b: phases(
                &b.data,
                shifted(corner),
                sizes_b(plane_rows),
                levels[1],
                0.0,
            ),
            mean_a: phases(&of_a.mean, centre, sizes_a(1, node_rows), levels[0], 0.0),
            norm_a: phases(&of_a.inverse_norm, centre, sizes_a(1, node_rows), 0.0, nan),
            mean_b: phases(
                &of_b.mean,
                shifted(centre),
                sizes_b(node_rows),
                levels[1],
                0.0,
            ),
            norm_b: phases(
                &of_b.inverse_norm,
                shifted(centre),
                sizes_b(node_rows),
                0.0,
                nan,
            ),
        }
    }
}
