//! Sub-aperture images: the views of a sub-pixel mosaic, and their sums.
//!
//! ```text
//! view_{j·m+i}(x, y) = raw(x·m + i, y·n + j)          0 ≤ i < m (columns), 0 ≤ j < n (rows)
//! sum_S(x, y) = Σ_{(i,j) ∈ S} view_{j·m+i}(x, y)
//! ```
//!
//! As in the dataset's specification L is stored on the left and T above. A half of an odd number of columns leaves out
//! the middle one.

use std::fmt;
use std::str::FromStr;

use quadpixel::image::Image;
pub use quadpixel::image::views::Side;
use quadpixel::image::views::{split_views, sum_of};
use quadpixel::sensor::Subpixels;

/// Sub-pixels of a pixel: m columns by n rows, any numbers of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partition {
    m: usize,
    n: usize,
}

/// A mosaic that cannot be parted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SaiError {
    /// No partition.
    #[error("subpixels: {0:?} is not COLUMNSxROWS with two numbers from 1 to 64, such as 2x2")]
    Partition(String),
    /// Size and partition do not go together.
    #[error(
        "a mosaic of {width} × {height} cannot be parted into pixels of {partition} sub-pixels"
    )]
    Indivisible {
        /// Columns of the mosaic.
        width: usize,
        /// Rows of the mosaic.
        height: usize,
        /// The partition asked for.
        partition: Partition,
    },
    /// Views that are no set.
    #[error(
        "views: {partition} sub-pixels need as many views of one size and number of channels, not empty; {count} given"
    )]
    Views {
        /// Views given.
        count: usize,
        /// The partition they should fill.
        partition: Partition,
    },
}

impl Partition {
    /// `m` columns by `n` rows, each from 1 to 64.
    ///
    /// # Errors
    /// A number out of 1 to 64.
    pub fn new(m: usize, n: usize) -> Result<Self, SaiError> {
        if (1..=64).contains(&m) && (1..=64).contains(&n) {
            Ok(Self { m, n })
        } else {
            Err(SaiError::Partition(format!("{m}x{n}")))
        }
    }

    /// Columns.
    pub fn m(self) -> usize {
        self.m
    }
    /// Rows.
    pub fn n(self) -> usize {
        self.n
    }
    /// Sub-pixels of a pixel.
    pub fn count(self) -> usize {
        self.m * self.n
    }

    /// Name of a sub-pixel as the dataset has it: `A`..`D`, `L`, `R`, `T`, `B`, else `r{row}c{column}`.
    pub fn name(self, index: usize) -> String {
        match Subpixels::new(self.m, self.n) {
            Ok(known) => known.name(index),
            Err(_) => format!("r{}c{}", index / self.m, index % self.m),
        }
    }

    /// The partition whose sub-pixels have these names, in any order and among others; `None` where no partition fits.
    pub fn from_names(names: &[&str]) -> Option<Self> {
        let has = |name: &str| names.contains(&name);
        let rows = (0..64).take_while(|j| has(&format!("r{j}c0"))).count();
        let columns = (0..64).take_while(|i| has(&format!("r0c{i}"))).count();
        let candidates = [(2, 2), (2, 1), (1, 2), (columns, rows)];
        (candidates.into_iter())
            .filter_map(|(m, n)| Self::new(m, n).ok())
            .find(|p| (0..p.count()).all(|index| has(&p.name(index))))
    }

    /// Indices of the sub-pixels on one side; empty where there is but one column (left, right) or row (top, bottom).
    pub fn side(self, side: Side) -> Vec<usize> {
        side.members(self.m, self.n)
    }
}

impl FromStr for Partition {
    type Err = SaiError;
    fn from_str(text: &str) -> Result<Self, SaiError> {
        let bad = || SaiError::Partition(text.to_string());
        let (m, n) = text.split_once('x').ok_or_else(bad)?;
        match (m.parse(), n.parse()) {
            (Ok(m), Ok(n)) => Self::new(m, n),
            _ => Err(bad()),
        }
    }
}

impl fmt::Display for Partition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.m, self.n)
    }
}

/// The views of a mosaic, one per sub-pixel, in index order.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    partition: Partition,
    images: Vec<Image>,
}

impl Views {
    /// Takes views as they are: `partition.count()` of them in index order, of one size and number of channels.
    ///
    /// # Errors
    /// Another number of views, views of unlike size, or empty ones.
    pub fn new(partition: Partition, images: Vec<Image>) -> Result<Self, SaiError> {
        let shape = |image: &Image| (image.width(), image.height(), image.channels());
        let alike = images
            .windows(2)
            .all(|pair| shape(&pair[0]) == shape(&pair[1]));
        let empty = images.first().is_none_or(|first| first.data().is_empty());
        if empty || !alike || images.len() != partition.count() {
            return Err(SaiError::Views {
                count: images.len(),
                partition,
            });
        }
        Ok(Self { partition, images })
    }

    /// How the pixel is parted.
    pub fn partition(&self) -> Partition {
        self.partition
    }

    /// One image a sub-pixel, in index order.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// Parts `mosaic` (m·W × n·H, any channels) into m·n views of W × H.
    ///
    /// # Errors
    /// A size that the partition does not divide, or no pixel.
    pub fn from_mosaic(mosaic: &Image, partition: Partition) -> Result<Self, SaiError> {
        let (m, n) = (partition.m, partition.n);
        let (width, height) = (mosaic.width() / m, mosaic.height() / n);
        if width * m != mosaic.width() || height * n != mosaic.height() || width * height == 0 {
            return Err(SaiError::Indivisible {
                width: mosaic.width(),
                height: mosaic.height(),
                partition,
            });
        }
        Self::new(partition, split_views(mosaic, m, n))
    }

    /// Sum over the sub-pixels of one side, added in f64; `None` where the side is empty.
    pub fn sum(&self, side: Side) -> Option<Image> {
        sum_of(
            self.partition
                .side(side)
                .into_iter()
                .map(|v| &self.images[v]),
        )
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
                let views = Views::from_mosaic(&mosaic, Partition::new(m, n).unwrap()).unwrap();
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
        let quad = Partition::new(2, 2).unwrap();
        let names = |side| -> String { quad.side(side).iter().map(|&i| quad.name(i)).collect() };
        assert_eq!(names(Side::Left), "BD");
        assert_eq!(names(Side::Right), "AC");
        assert_eq!(names(Side::Top), "BA");
        assert_eq!(names(Side::Bottom), "DC");
        let three: Partition = "3x1".parse().unwrap();
        assert_eq!(three.side(Side::Left), [0]);
        assert_eq!(three.side(Side::Right), [2]);
        assert!(three.side(Side::Top).is_empty());
        assert_eq!(three.name(2), "r0c2");
    }

    #[test]
    fn a_partition_is_known_by_the_names_of_its_sub_pixels() {
        for (m, n) in [(2, 2), (2, 1), (1, 2), (3, 2), (4, 4), (5, 1)] {
            let partition = Partition::new(m, n).unwrap();
            let names: Vec<String> = (0..m * n).rev().map(|i| partition.name(i)).collect();
            let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
            names.push("sum");
            assert_eq!(Partition::from_names(&names), Some(partition));
            assert_ne!(Partition::from_names(&names[1..]), Some(partition));
        }
        assert_eq!(Partition::from_names(&[""]), None);
    }

    #[test]
    fn left_and_right_add_up_to_all() {
        let mosaic = spelled(8, 6, 3);
        let views = Views::from_mosaic(&mosaic, Partition::new(2, 2).unwrap()).unwrap();
        let sum = |side| views.sum(side).unwrap();
        let all = sum(Side::All);
        for (a, b) in [(Side::Left, Side::Right), (Side::Top, Side::Bottom)] {
            let (a, b) = (sum(a), sum(b));
            for ((a, b), all) in a.data().iter().zip(b.data()).zip(all.data()) {
                assert_eq!(a + b, *all);
            }
        }
        let single = Views::from_mosaic(&mosaic, Partition::new(1, 1).unwrap()).unwrap();
        assert_eq!(single.sum(Side::Left), None);
        assert_eq!(single.sum(Side::All), Some(mosaic));
    }

    #[test]
    fn sizes_and_partitions_that_do_not_fit_are_refused() {
        let error = Views::from_mosaic(&spelled(7, 6, 1), Partition::new(2, 2).unwrap());
        let text = error.unwrap_err().to_string();
        assert!(text.contains("7 × 6") && text.contains("2x2"), "{text}");
        let dual = Partition::new(2, 1).unwrap();
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
        for bad in ["", "2", "2x", "0x2", "2x65", "2x2x2", "-1x2"] {
            assert!(bad.parse::<Partition>().is_err(), "{bad}");
        }
    }
}
