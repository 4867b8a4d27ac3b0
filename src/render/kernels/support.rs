//! The pixels that kernels stand on, and how many of them the light needs.

use glam::DVec2;

/// Where rays that land farther from their point are thought to, px: such kernels are refused for their size.
const FARTHEST_PX: f64 = 1e6;

/// Pixels of a kernel, from the point's own pixel (0, 0): x right, y down as stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Support {
    /// First column.
    pub left: i32,
    /// First row.
    pub top: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Support {
    /// What holds both.
    pub fn union(self, other: Self) -> Self {
        let (left, top) = (self.left.min(other.left), self.top.min(other.top));
        let right = (self.left + self.width as i32).max(other.left + other.width as i32);
        let bottom = (self.top + self.height as i32).max(other.top + other.height as i32);
        Self {
            left,
            top,
            width: (right - left) as usize,
            height: (bottom - top) as usize,
        }
    }

    /// The farthest column or row from the point.
    pub fn reach(self) -> usize {
        let right = self.left + self.width as i32 - 1;
        let bottom = self.top + self.height as i32 - 1;
        let far = [self.left, self.top, right, bottom].map(i32::unsigned_abs);
        far.into_iter().fold(0, u32::max) as usize
    }

    /// Of rays that land within these bounds, px, and so many pixels on each side.
    pub(super) fn around((low, high): (DVec2, DVec2), more: i32) -> Self {
        let far = DVec2::splat(FARTHEST_PX);
        let low = low.round().clamp(-far, far).as_ivec2() - more;
        let high = high.round().clamp(-far, far).as_ivec2() + more;
        let ([left, top], [right, bottom]) = (low.to_array(), high.to_array());
        Self {
            left,
            top,
            width: (right - left + 1) as usize,
            height: (bottom - top + 1) as usize,
        }
    }
}

/// Sum of each lane.
pub(super) fn totals<T: Copy + Into<f64>>(values: &[T], lanes: usize) -> Vec<f64> {
    let mut sums = vec![0.0; lanes];
    for pixel in values.chunks_exact(lanes) {
        sums.iter_mut()
            .zip(pixel)
            .for_each(|(s, v)| *s += (*v).into());
    }
    sums
}

/// Sums over the rows, `[column][lane]`, and over the columns, `[row][lane]`.
pub(super) fn marginals(values: &[f32], width: usize, lanes: usize) -> [Vec<f64>; 2] {
    let mut along = vec![0.0; width * lanes];
    let mut down = Vec::new();
    for row in values.chunks_exact(width * lanes) {
        along
            .iter_mut()
            .zip(row)
            .for_each(|(a, v)| *a += f64::from(*v));
        down.extend(totals(row, lanes));
    }
    [along, down]
}

/// What is left of a row of shares when as many as make up `share` are cut from each end.
pub(super) fn kept(most: &[f64], share: f64) -> (usize, usize) {
    let cut = |mut values: Box<dyn Iterator<Item = &f64> + '_>| {
        let mut sum = 0.0;
        values
            .position(|v| {
                sum += v;
                sum > share
            })
            .unwrap_or(0)
    };
    let first = cut(Box::new(most.iter()));
    let last = most.len() - cut(Box::new(most.iter().rev()));
    (first, last.max(first + 1))
}
