//! How one pixel (one microlens) is parted into `m × n` sub-pixels.
//!
//! Index rule: row-major in the stored image, `i = row·m + column`; column 0 has the most negative x, row 0 (on top as
//! stored, see [`crate::frames`]) the most negative y. So a 2×2 pixel is stored as B, A / D, C.

use serde::{Deserialize, Serialize};

/// Sub-pixels of one pixel: `m` columns along x, `n` rows along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "[usize; 2]", into = "[usize; 2]")]
pub struct Subpixels {
    m: usize,
    n: usize,
}

/// A partition that is not offered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("subpixels: {m}x{n} is not one of 1x1, 2x1, 1x2, 2x2, 3x3, 4x4")]
pub struct SubpixelsError {
    m: usize,
    n: usize,
}

impl Subpixels {
    /// An undivided pixel.
    pub const SINGLE: Self = Self { m: 1, n: 1 };
    /// Dual pixel parted left and right.
    pub const DUAL_X: Self = Self { m: 2, n: 1 };
    /// Dual pixel parted top and bottom.
    pub const DUAL_Y: Self = Self { m: 1, n: 2 };
    /// Quad pixel.
    pub const QUAD: Self = Self { m: 2, n: 2 };
    /// All partitions offered.
    pub const ALL: [Self; 6] = [
        Self::SINGLE,
        Self::DUAL_X,
        Self::DUAL_Y,
        Self::QUAD,
        Self { m: 3, n: 3 },
        Self { m: 4, n: 4 },
    ];

    /// `m` columns by `n` rows; one of [`Self::ALL`].
    ///
    /// # Errors
    /// A number of columns or rows that no pixel has.
    pub fn new(m: usize, n: usize) -> Result<Self, SubpixelsError> {
        let wanted = Self { m, n };
        if Self::ALL.contains(&wanted) {
            Ok(wanted)
        } else {
            Err(SubpixelsError { m, n })
        }
    }

    /// Columns (along x).
    #[inline]
    pub fn m(self) -> usize {
        self.m
    }
    /// Rows (along y).
    #[inline]
    pub fn n(self) -> usize {
        self.n
    }
    /// Sub-pixels of the pixel.
    #[inline]
    pub fn count(self) -> usize {
        self.m * self.n
    }
    /// Index of (column, row).
    #[inline]
    pub fn index(self, column: usize, row: usize) -> usize {
        row * self.m + column
    }
    /// (column, row) of an index.
    #[inline]
    pub fn column_row(self, index: usize) -> (usize, usize) {
        (index % self.m, index / self.m)
    }
    /// Centre of a sub-pixel from the pixel's centre, in parts of the pitch (−0.5..0.5), sensor frame.
    pub fn centre(self, index: usize) -> (f64, f64) {
        let (c, r) = self.column_row(index);
        (
            (c as f64 + 0.5) / self.m as f64 - 0.5,
            (r as f64 + 0.5) / self.n as f64 - 0.5,
        )
    }
    /// Name of a sub-pixel as it stands in files: `A`..`D` for 2×2, `L`, `R` for 2×1, `T`, `B` for 1×2, else
    /// `r{row}c{column}`.
    pub fn name(self, index: usize) -> String {
        let known: &[&str] = match (self.m, self.n) {
            (2, 2) => &["B", "A", "D", "C"],
            (2, 1) => &["L", "R"],
            (1, 2) => &["T", "B"],
            _ => &[],
        };
        match known.get(index) {
            Some(name) => (*name).to_owned(),
            None => {
                let (c, r) = self.column_row(index);
                format!("r{r}c{c}")
            }
        }
    }
}

impl TryFrom<[usize; 2]> for Subpixels {
    type Error = SubpixelsError;
    fn try_from([m, n]: [usize; 2]) -> Result<Self, SubpixelsError> {
        Self::new(m, n)
    }
}

impl From<Subpixels> for [usize; 2] {
    fn from(s: Subpixels) -> Self {
        [s.m, s.n]
    }
}

impl std::fmt::Display for Subpixels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.m, self.n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quad_letters_stand_where_the_frames_page_draws_them() {
        let q = Subpixels::QUAD;
        for (name, x, y) in [
            ("A", 0.25, -0.25),
            ("B", -0.25, -0.25),
            ("C", 0.25, 0.25),
            ("D", -0.25, 0.25),
        ] {
            let i = (0..4).find(|&i| q.name(i) == name);
            assert_eq!(i.map(|i| q.centre(i)), Some((x, y)));
        }
    }

    #[test]
    fn only_known_partitions_are_made() {
        assert!(Subpixels::new(2, 1).is_ok());
        assert_eq!(
            Subpixels::new(0, 3).map_err(|e| e.to_string()),
            Err("subpixels: 0x3 is not one of 1x1, 2x1, 1x2, 2x2, 3x3, 4x4".to_owned())
        );
    }
}
