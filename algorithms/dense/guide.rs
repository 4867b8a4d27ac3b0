//! The picture whose edges count, as planes of its channels: an edge in any colour is one.

use quadpixel::image::{Image, channel};

use super::filters::{by_rows, halved, quantile, row_of, transposed};

/// Roots of linear light, the 99th percentile of each channel 1.
pub(super) struct Guide {
    planes: Vec<Image>,
}

impl Guide {
    /// Of a linear picture of any number of channels, black at 0; rows as columns where asked.
    pub fn new(picture: &Image, is_turned: bool) -> Self {
        let plane = |c: usize| {
            let plane = channel(picture, c);
            let plane = if is_turned { transposed(&plane) } else { plane };
            let root = mapped(&plane, |v| v.max(0.0).sqrt());
            let bright = quantile(root.data().to_vec(), 0.99);
            let scale = if bright > 0.0 { 1.0 / bright } else { 0.0 };
            mapped(&root, |v| scale * v)
        };
        Self {
            planes: (0..picture.channels()).map(plane).collect(),
        }
    }

    /// At half the resolution.
    pub fn halved(&self) -> Self {
        Self {
            planes: self.planes.iter().map(halved).collect(),
        }
    }

    pub fn width(&self) -> usize {
        self.planes[0].width()
    }

    pub fn height(&self) -> usize {
        self.planes[0].height()
    }

    /// Largest contrast of a channel between the pixels `i` and `j`, row by row, parts of white.
    #[inline]
    pub fn contrast(&self, i: usize, j: usize) -> f32 {
        self.contrast_with(i, self, j)
    }

    /// As [`Self::contrast`], with pixel `j` of another guide of the same picture.
    #[inline]
    pub fn contrast_with(&self, i: usize, other: &Self, j: usize) -> f32 {
        let pairs = self.planes.iter().zip(&other.planes);
        pairs.fold(0.0, |most, (a, b)| {
            most.max((a.data()[i] - b.data()[j]).abs())
        })
    }
}

fn mapped(image: &Image, f: impl Fn(f32) -> f32 + Sync) -> Image {
    by_rows(image.width(), image.height(), |y, to| {
        let row = to.iter_mut().zip(row_of(image, y));
        row.for_each(|(to, v)| *to = f(*v));
    })
}
