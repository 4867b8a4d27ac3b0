//! The mosaic taken apart: one view per sub-pixel, the halves of the pupil, sums of views.
//!
//! ```text
//! view_{j·m+i}(x, y) = raw(x·m + i, y·n + j)          0 ≤ i < m (columns), 0 ≤ j < n (rows)
//! ```

use rayon::prelude::*;

use super::Image;
use crate::sensor::Subpixels;

/// Values that are summed at a time.
const BLOCK: usize = 4096;

/// The view of each sub-pixel in stored order, row by row; columns and rows of the mosaic beyond a whole pixel are left
/// out.
pub fn split_views(raw: &Image, subpixels: Subpixels) -> Vec<Image> {
    let (columns, rows) = (subpixels.m(), subpixels.n());
    let (width, height) = (raw.width() / columns, raw.height() / rows);
    let channels = raw.channels();
    let view = |index: usize| {
        let (i, j) = subpixels.column_row(index);
        let mut view = Image::zeros(width, height, channels);
        let lines = view.data_mut().chunks_exact_mut((width * channels).max(1));
        for (y, to) in lines.enumerate() {
            let from = &raw.data()[(y * rows + j) * raw.width() * channels..];
            every(columns, &from[i * channels..], channels, to);
        }
        view
    };
    (0..subpixels.count()).into_par_iter().map(view).collect()
}

/// Copies every `columns`-th pixel of a line.
fn every(columns: usize, from: &[f32], channels: usize, to: &mut [f32]) {
    if channels == 3 {
        let (from, to) = (from.as_chunks::<3>().0, to.as_chunks_mut::<3>().0);
        let from = from.iter().step_by(columns);
        return to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
    }
    let from = from.chunks(columns * channels);
    for (to, from) in to.chunks_exact_mut(channels).zip(from) {
        to.copy_from_slice(&from[..channels]);
    }
}

/// The sum of images of one size, added in f64 in the order given; `None` without an image.
pub fn sum_of<'a>(images: impl IntoIterator<Item = &'a Image>) -> Option<Image> {
    let images: Vec<&Image> = images.into_iter().collect();
    let first = images.first()?;
    let (width, height, channels) = (first.width(), first.height(), first.channels());
    let mut data = vec![0.0; first.data().len()];
    (data.par_chunks_mut(BLOCK).enumerate()).for_each(|(k, data)| {
        let mut sums = [0.0f64; BLOCK];
        let sums = &mut sums[..data.len()];
        for image in &images {
            let values = &image.data()[k * BLOCK..];
            (sums.iter_mut().zip(values)).for_each(|(sum, value)| *sum += f64::from(*value));
        }
        (data.iter_mut().zip(sums)).for_each(|(to, sum)| *to = *sum as f32);
    });
    Image::from_vec(width, height, channels, data)
}

/// Part of the sub-pixels; the sides are those of the stored mosaic. A half of an odd number leaves out the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left columns: they see the left half of the pupil.
    Left,
    /// Right columns.
    Right,
    /// Upper rows: they see the upper half of the pupil.
    Top,
    /// Lower rows.
    Bottom,
    /// All sub-pixels.
    All,
}

impl Side {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Left, Self::Right, Self::Top, Self::Bottom, Self::All];

    /// `L`, `R`, `T`, `B` or `all`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "L",
            Self::Right => "R",
            Self::Top => "T",
            Self::Bottom => "B",
            Self::All => "all",
        }
    }

    /// Indices of its sub-pixels; none where there is but one column (left, right) or row (top, bottom).
    pub fn members(self, subpixels: Subpixels) -> Vec<usize> {
        let (columns, rows) = (subpixels.m(), subpixels.n());
        let (half_m, half_n) = (columns / 2, rows / 2);
        let holds = |index: &usize| {
            let (i, j) = subpixels.column_row(*index);
            match self {
                Self::Left => i < half_m,
                Self::Right => i >= columns - half_m,
                Self::Top => j < half_n,
                Self::Bottom => j >= rows - half_n,
                Self::All => true,
            }
        };
        (0..subpixels.count()).filter(holds).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn the_quad_mosaic_comes_apart_as_b_a_over_d_c() {
        // One pixel: B = 1, A = 2 above, D = 3, C = 4 below.
        let raw = Image::from_vec(2, 2, 1, vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        let views = split_views(&raw, Subpixels::QUAD);
        let values: Vec<f32> = views.iter().map(|view| view.data()[0]).collect();
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0]);
        let total = |side: Side| {
            let members = side.members(Subpixels::QUAD);
            sum_of(members.iter().map(|&i| &views[i])).unwrap().data()[0]
        };
        // L = B + D, R = A + C, T = B + A, B = D + C.
        assert_eq!(Side::ALL.map(total), [4.0, 6.0, 3.0, 7.0, 10.0]);
    }

    #[test]
    fn a_middle_column_sees_neither_half() {
        let three = Subpixels::new(3, 1).unwrap();
        assert_eq!(Side::Left.members(three), [0]);
        assert_eq!(Side::Right.members(three), [2]);
        assert!(Side::Left.members(Subpixels::DUAL_Y).is_empty());
        assert!(sum_of([]).is_none());
    }
}
