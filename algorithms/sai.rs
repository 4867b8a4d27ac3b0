//! Sub-aperture images: the views of a sub-pixel mosaic, and their sums.
//!
//! ```text
//! view_{j·m+i}(x, y) = raw(x·m + i, y·n + j)          0 ≤ i < m (columns), 0 ≤ j < n (rows)
//! sum_S(x, y) = Σ_{(i,j) ∈ S} view_{j·m+i}(x, y)
//! ```
//!
//! As in the dataset's specification L is stored on the left and T above. A half of an odd number of columns leaves out
//! the middle one.

use quadpixel::image::Image;
pub use quadpixel::image::views::Side;
use quadpixel::image::views::{split_views, sum_of};
use quadpixel::sensor::Subpixels;

/// A mosaic that cannot be parted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SaiError {
    /// Size and sub-pixels do not go together.
    #[error(
        "a mosaic of {width} × {height} cannot be parted into pixels of {subpixels} sub-pixels"
    )]
    Indivisible {
        /// Columns of the mosaic.
        width: usize,
        /// Rows of the mosaic.
        height: usize,
        /// How the pixel is parted.
        subpixels: Subpixels,
    },
    /// Views that are no set.
    #[error(
        "views: {subpixels} sub-pixels need as many views of one size and number of channels, not empty; {count} given"
    )]
    Views {
        /// Views given.
        count: usize,
        /// The sub-pixels that they should be of.
        subpixels: Subpixels,
    },
}

/// The views of a mosaic, one per sub-pixel, in index order.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    subpixels: Subpixels,
    images: Vec<Image>,
}

impl Views {
    /// Takes views as they are: `subpixels.count()` of them in index order, of one size and number of channels.
    ///
    /// # Errors
    /// Another number of views, views of unlike size, or empty ones.
    pub fn new(subpixels: Subpixels, images: Vec<Image>) -> Result<Self, SaiError> {
        let shape = |image: &Image| (image.width(), image.height(), image.channels());
        let alike = images
            .windows(2)
            .all(|pair| shape(&pair[0]) == shape(&pair[1]));
        let empty = images.first().is_none_or(|first| first.data().is_empty());
        if empty || !alike || images.len() != subpixels.count() {
            return Err(SaiError::Views {
                count: images.len(),
                subpixels,
            });
        }
        Ok(Self { subpixels, images })
    }

    /// How the pixel is parted.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }

    /// One image a sub-pixel, in index order.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// Parts `mosaic` (m·W × n·H, any channels) into m·n views of W × H.
    ///
    /// # Errors
    /// A size that the sub-pixels do not divide, or no pixel.
    pub fn from_mosaic(mosaic: &Image, subpixels: Subpixels) -> Result<Self, SaiError> {
        let (m, n) = (subpixels.m(), subpixels.n());
        let (width, height) = (mosaic.width() / m, mosaic.height() / n);
        if width * m != mosaic.width() || height * n != mosaic.height() || width * height == 0 {
            return Err(SaiError::Indivisible {
                width: mosaic.width(),
                height: mosaic.height(),
                subpixels,
            });
        }
        Self::new(subpixels, split_views(mosaic, subpixels))
    }

    /// Sum over the sub-pixels of one side, added in f64; `None` where the side is empty.
    pub fn sum(&self, side: Side) -> Option<Image> {
        let members = side.members(self.subpixels);
        sum_of(members.into_iter().map(|v| &self.images[v]))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// A mosaic whose samples spell (x, y, channel).
    fn spelled(width: usize, height: usize, channels: usize) -> Image {
        let mut image = Image::zeros(width, height, channels);
        for (i, value) in image.data_mut().iter_mut().enumerate() {
            let (pixel, c) = (i / channels, i % channels);
            *value = (100 * (pixel / width) + pixel % width) as f32 + 0.25 * c as f32;
        }
        image
    }

    #[test]
    fn every_sample_goes_to_the_view_the_specification_says() {
        for (m, n) in [(1, 1), (2, 1), (1, 2), (2, 2), (3, 2), (4, 4), (5, 3)] {
            for channels in [1, 2, 3, 5] {
                let mosaic = spelled(m * 4, n * 3, channels);
                let views = Views::from_mosaic(&mosaic, Subpixels::new(m, n).unwrap()).unwrap();
                for j in 0..n {
                    for i in 0..m {
                        let seen = views.images()[j * m + i].pixel(3, 2);
                        assert_eq!(seen, mosaic.pixel(3 * m + i, 2 * n + j));
                    }
                }
            }
        }
    }

    #[test]
    fn left_of_a_quad_pixel_is_b_and_d_and_top_is_b_and_a() {
        let quad = Subpixels::QUAD;
        let names =
            |side: Side| -> String { side.members(quad).iter().map(|&i| quad.name(i)).collect() };
        assert_eq!(names(Side::Left), "BD");
        assert_eq!(names(Side::Right), "AC");
        assert_eq!(names(Side::Top), "BA");
        assert_eq!(names(Side::Bottom), "DC");
        let three: Subpixels = "3x1".parse().unwrap();
        assert_eq!(Side::Left.members(three), [0]);
        assert_eq!(Side::Right.members(three), [2]);
        assert!(Side::Top.members(three).is_empty());
        assert_eq!(three.name(2), "r0c2");
    }

    #[test]
    fn left_and_right_add_up_to_all() {
        let mosaic = spelled(8, 6, 3);
        let views = Views::from_mosaic(&mosaic, Subpixels::QUAD).unwrap();
        let sum = |side| views.sum(side).unwrap();
        let all = sum(Side::All);
        for (a, b) in [(Side::Left, Side::Right), (Side::Top, Side::Bottom)] {
            let (a, b) = (sum(a), sum(b));
            for ((a, b), all) in a.data().iter().zip(b.data()).zip(all.data()) {
                assert_eq!(a + b, *all);
            }
        }
        let single = Views::from_mosaic(&mosaic, Subpixels::SINGLE).unwrap();
        assert_eq!(single.sum(Side::Left), None);
        assert_eq!(single.sum(Side::All), Some(mosaic));
    }

    #[test]
    fn sizes_and_sub_pixels_that_do_not_fit_are_refused() {
        let error = Views::from_mosaic(&spelled(7, 6, 1), Subpixels::QUAD);
        let text = error.unwrap_err().to_string();
        assert!(text.contains("7 × 6") && text.contains("2x2"), "{text}");
        let dual = Subpixels::DUAL_X;
        for images in [
            vec![],
            vec![spelled(2, 2, 1)],
            vec![spelled(2, 2, 1), spelled(2, 2, 3)],
            vec![spelled(2, 3, 1), spelled(3, 2, 1)],
            vec![Image::zeros(0, 2, 1), Image::zeros(0, 2, 1)],
        ] {
            assert!(Views::new(dual, images).is_err());
        }
        assert!(Views::from_mosaic(&Image::zeros(4, 4, 0), dual).is_err());
    }
}
