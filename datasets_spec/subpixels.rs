//! How one pixel (one microlens) is parted into `m × n` sub-pixels.
//!
//! Index rule: row-major in the stored image, `i = row·m + column`; column 0 has the most negative x, row 0 (on top as
//! stored) the most negative y. So a 2×2 pixel is stored as B, A / D, C.
//!
//! Text and files say `COLUMNSxROWS`, such as `2x1`. Files of earlier versions, which are read too, hold `[2, 1]` or
//! `{"columns": 2, "rows": 1}`.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// Sub-pixels of one pixel: `m` columns along x, `n` rows along y, each from 1 to 64.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "String")]
pub struct Subpixels {
    m: usize,
    n: usize,
}

/// A text or numbers that part no pixel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("subpixels: {0:?} is not COLUMNSxROWS with two numbers from 1 to 64, such as 2x2")]
pub struct SubpixelsError(String);

impl Subpixels {
    /// An undivided pixel.
    pub const SINGLE: Self = Self { m: 1, n: 1 };
    /// Dual pixel parted left and right.
    pub const DUAL_X: Self = Self { m: 2, n: 1 };
    /// Dual pixel parted top and bottom.
    pub const DUAL_Y: Self = Self { m: 1, n: 2 };
    /// Quad pixel.
    pub const QUAD: Self = Self { m: 2, n: 2 };
    /// The partitions that pixels are simulated with; those of captures may be others.
    pub const SIMULATED: [Self; 6] = [
        Self::SINGLE,
        Self::DUAL_X,
        Self::DUAL_Y,
        Self::QUAD,
        Self { m: 3, n: 3 },
        Self { m: 4, n: 4 },
    ];

    /// `m` columns by `n` rows.
    ///
    /// # Errors
    /// A number out of 1 to 64.
    pub fn new(m: usize, n: usize) -> Result<Self, SubpixelsError> {
        if (1..=64).contains(&m) && (1..=64).contains(&n) {
            Ok(Self { m, n })
        } else {
            Err(SubpixelsError(format!("{m}x{n}")))
        }
    }

    /// The partition whose sub-pixels have these names, in any order and among others; `None` where no partition fits.
    pub fn from_names(names: &[&str]) -> Option<Self> {
        let has = |name: &str| names.contains(&name);
        let rows = (0..64).take_while(|j| has(&format!("r{j}c0"))).count();
        let columns = (0..64).take_while(|i| has(&format!("r0c{i}"))).count();
        let lettered = [Self::QUAD, Self::DUAL_X, Self::DUAL_Y];
        (lettered.into_iter())
            .chain(Self::new(columns, rows).ok())
            .find(|s| s.names().iter().all(|name| has(name)))
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
    /// Index of the sub-pixel where one stands in a mirror: left and right exchanged, top and bottom exchanged.
    pub fn mirrored(self, index: usize, [across, down]: [bool; 2]) -> usize {
        let (column, row) = self.column_row(index);
        self.index(
            if across { self.m - 1 - column } else { column },
            if down { self.n - 1 - row } else { row },
        )
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
        let letters: &[&str] = match (self.m, self.n) {
            (2, 2) => &["B", "A", "D", "C"],
            (2, 1) => &["L", "R"],
            (1, 2) => &["T", "B"],
            _ => &[],
        };
        match letters.get(index) {
            Some(name) => (*name).to_owned(),
            None => {
                let (c, r) = self.column_row(index);
                format!("r{r}c{c}")
            }
        }
    }
    /// Names of all sub-pixels in stored order, row by row.
    pub fn names(self) -> Vec<String> {
        (0..self.count()).map(|index| self.name(index)).collect()
    }
}

impl fmt::Display for Subpixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.m, self.n)
    }
}

impl FromStr for Subpixels {
    type Err = SubpixelsError;
    fn from_str(text: &str) -> Result<Self, SubpixelsError> {
        let numbers = text
            .split_once('x')
            .and_then(|(m, n)| Some((m.parse().ok()?, n.parse().ok()?)));
        let (m, n) = numbers.ok_or_else(|| SubpixelsError(text.to_owned()))?;
        Self::new(m, n)
    }
}

/// As they stand in files.
#[derive(Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "subpixels: COLUMNSxROWS with two numbers from 1 to 64, such as \"2x2\""
)]
enum Stored {
    Text(String),
    Pair([usize; 2]),
    Named { columns: usize, rows: usize },
}

impl TryFrom<Stored> for Subpixels {
    type Error = SubpixelsError;
    fn try_from(stored: Stored) -> Result<Self, SubpixelsError> {
        match stored {
            Stored::Text(text) => text.parse(),
            Stored::Pair([m, n]) => Self::new(m, n),
            Stored::Named { columns, rows } => Self::new(columns, rows),
        }
    }
}

impl From<Subpixels> for String {
    fn from(subpixels: Subpixels) -> Self {
        subpixels.to_string()
    }
}

impl JsonSchema for Subpixels {
    fn schema_name() -> Cow<'static, str> {
        "Subpixels".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Sub-pixels of a pixel: columns x rows, such as 2x2.",
            "type": "string",
            "pattern": "^[1-9][0-9]?x[1-9][0-9]?$"
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
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
    fn the_quad_pixel_is_stored_b_a_over_d_c() {
        assert_eq!(Subpixels::QUAD.names(), ["B", "A", "D", "C"]);
        let three = Subpixels::new(3, 1).unwrap();
        assert_eq!(three.names(), ["r0c0", "r0c1", "r0c2"]);
    }

    #[test]
    fn a_partition_is_known_by_the_names_of_its_sub_pixels() {
        for (m, n) in [(2, 2), (2, 1), (1, 2), (3, 2), (4, 4), (5, 1)] {
            let subpixels = Subpixels::new(m, n).unwrap();
            let names: Vec<String> = subpixels.names().into_iter().rev().collect();
            let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
            names.push("sum");
            assert_eq!(Subpixels::from_names(&names), Some(subpixels));
            assert_ne!(Subpixels::from_names(&names[1..]), Some(subpixels));
        }
        assert_eq!(Subpixels::from_names(&[""]), None);
    }

    #[test]
    fn every_form_of_a_file_is_read_and_the_text_is_written() {
        for stored in [r#""2x1""#, "[2, 1]", r#"{"columns": 2, "rows": 1}"#] {
            let read: Subpixels = serde_json::from_str(stored).unwrap();
            assert_eq!(read, Subpixels::DUAL_X, "{stored}");
        }
        let written = serde_json::to_string(&Subpixels::DUAL_X).unwrap();
        assert_eq!(written, r#""2x1""#);
    }

    #[test]
    fn what_parts_no_pixel_is_refused_with_what_is_allowed() {
        for bad in ["", "2", "2x", "0x2", "2x65", "2x2x2", "-1x2"] {
            let error = bad.parse::<Subpixels>().unwrap_err().to_string();
            assert!(error.contains(&format!("{bad:?}")), "{error}");
        }
        for bad in [r#""7""#, "[0, 3]", "[2]", "7", r#"{"columns": 2}"#] {
            let error = serde_json::from_str::<Subpixels>(bad).unwrap_err();
            assert!(error.to_string().contains("from 1 to 64"), "{error}");
        }
    }
}
