//! The picture whose edges count: an edge in any of its channels is one.

use quadpixel::image::{Image, channel};

use super::filters::{by_rows, halved, quantile, row_of, transposed};

/// Roots of linear light, the 99th percentile of each channel 1.
pub(super) struct Guide {
    picture: Image,
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
            picture: side_by_side((0..picture.channels()).map(plane).collect()),
        }
    }

    /// At half the resolution.
    pub fn halved(&self) -> Self {
        let plane = |c: usize| halved(&channel(&self.picture, c));
        Self {
            picture: side_by_side((0..self.picture.channels()).map(plane).collect()),
        }
    }

    pub fn width(&self) -> usize {
        self.picture.width()
    }

    pub fn height(&self) -> usize {
        self.picture.height()
    }

    /// Largest contrast of a channel between the pixels `i` and `j`, row by row, parts of white.
    #[inline]
    pub fn contrast(&self, i: usize, j: usize) -> f32 {
        self.contrast_with(i, self, j)
    }

    /// As [`Self::contrast`], with pixel `j` of another guide of the same picture.
    #[inline]
    pub fn contrast_with(&self, i: usize, other: &Self, j: usize) -> f32 {
        let n = self.picture.channels();
        let (own, other) = (self.picture.data(), other.picture.data());
        if n == 1 {
            return (own[i] - other[j]).abs();
        }
        let pairs = own[i * n..][..n].iter().zip(&other[j * n..][..n]);
        pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
    }
}

/// Planes of one size as the channels of a picture.
fn side_by_side(planes: Vec<Image>) -> Image {
    let n = planes.len();
    let mut picture = Image::zeros(planes[0].width(), planes[0].height(), n);
    for (c, plane) in planes.iter().enumerate() {
        let to = picture.data_mut()[c..].iter_mut().step_by(n);
        to.zip(plane.data()).for_each(|(to, v)| *to = *v);
    }
    picture
}

fn mapped(image: &Image, f: impl Fn(f32) -> f32 + Sync) -> Image {
    by_rows(image.width(), image.height(), |y, to| {
        let row = to.iter_mut().zip(row_of(image, y));
        row.for_each(|(to, v)| *to = f(*v));
    })
}
