//! Sums of products over blocks of pixels, many nodes at a time (see [`super::tile`]).

use std::ops::Range;

use super::lanes::{LANES, Lanes};
use super::phases::Phases;

/// Vectors that are summed together.
const VECTORS: usize = 4;
/// Their lanes.
pub(super) const CHUNK: usize = VECTORS * LANES;

/// Lines of A and B from which blocks begin.
pub(super) struct Lines<'a> {
    pub a: &'a Phases,
    pub line_a: usize,
    pub b: &'a Phases,
    pub line_b: usize,
    /// Where each column of a block stands in a row of B.
    pub places: &'a [usize],
}

impl Lines<'_> {
    /// Sum of the products in some rows and columns of the blocks from lane `m` on.
    #[inline(always)]
    fn products<V: Lanes>(
        &self,
        m: usize,
        rows: Range<usize>,
        columns: Range<usize>,
    ) -> [V; VECTORS] {
        let mut sum = [V::splat(0.0); VECTORS];
        for r in rows {
            let (row_a, row_b) = (self.a.row(self.line_a + r), self.b.row(self.line_b + r));
            for c in columns.start..columns.end {
                let lanes_a = &row_a[c * self.a.lanes + m..][..CHUNK];
                let lanes_b = &row_b[self.places[c] + m..][..CHUNK];
                for q in 0..VECTORS {
                    let product =
                        V::load(&lanes_a[q * LANES..]).times(V::load(&lanes_b[q * LANES..]));
                    sum[q] = sum[q].plus(product);
                }
            }
        }
        sum
    }
}

/// Sums of products over blocks: all or the first `rest` of their rows, and the same of their columns; \[lane\].
pub(super) struct BlockSums {
    /// All rows: all columns, the first ones.
    all: [Vec<f32>; 2],
    /// The first rows: all columns, the first ones.
    part: [Vec<f32>; 2],
}

impl BlockSums {
    /// For so many lanes, and a window that reaches over `full` more.
    pub fn new(lanes: usize, full: usize) -> Self {
        let two = || [vec![0.0; lanes + full], vec![0.0; lanes + full]];
        Self {
            all: two(),
            part: two(),
        }
    }

    /// Of the blocks in these lines.
    #[inline(always)]
    pub fn add<V: Lanes>(&mut self, lines: &Lines<'_>, rest: usize, side: usize) {
        for chunk in 0..lines.a.lanes / CHUNK {
            let m = chunk * CHUNK;
            let corner = lines.products::<V>(m, 0..rest, 0..rest);
            let right = lines.products::<V>(m, 0..rest, rest..side);
            let below = lines.products::<V>(m, rest..side, 0..rest);
            let body = lines.products::<V>(m, rest..side, rest..side);
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
    pub fn across<V: Lanes>(&self, all: &mut [f32], part: &mut [f32], full: usize) {
        for chunk in 0..all.len() / LANES {
            let m = chunk * LANES;
            let mut sum_all = V::load(&self.all[1][m + full..]);
            let mut sum_part = V::load(&self.part[1][m + full..]);
            // Slices of known length, one per block from lane to lane: no bound is checked in the loop.
            let reach = m..m + full + LANES - 1;
            let blocks = self.all[0][reach.clone()].windows(LANES);
            for (block_all, block_part) in blocks.zip(self.part[0][reach].windows(LANES)) {
                sum_all = sum_all.plus(V::load(block_all));
                sum_part = sum_part.plus(V::load(block_part));
            }
            sum_all.store(&mut all[m..]);
            sum_part.store(&mut part[m..]);
        }
    }
}
