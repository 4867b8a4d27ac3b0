//! The grid of microlenses, and the window of it that is rendered.

use std::ops::Range;

use glam::DVec2;

use super::{Subpixels, check_simulated};
use crate::field::SensorWindowMm;
use crate::range::{OutOfRange, require};
use crate::units::MM_PER_UM;

/// Largest number of sub-pixels that one render may hold: 2³⁰, 12 GiB of RGB floats.
const MAX_SUBPIXELS: usize = 1 << 30;

/// A window of `width × height` microlenses (pixels) of pitch `pitch_um`, around `centre_mm`; or some rows of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    pitch_um: f64,
    subpixels: Subpixels,
    width: usize,
    /// Rows of the whole window, around `centre_mm`.
    whole_height: usize,
    /// Those that are looked at.
    rows: Range<usize>,
    centre_mm: DVec2,
}

impl Sensor {
    /// # Errors
    /// A pitch that is not positive and finite, a partition that is not simulated, a size of zero or of more than 2³⁰
    /// sub-pixels, or a centre that is not finite.
    pub fn new(
        pitch_um: f64,
        subpixels: Subpixels,
        (width, height): (usize, usize),
        centre_mm: DVec2,
    ) -> Result<Self, OutOfRange> {
        let check = |field: &'static str, value: f64, ok: bool, allowed: &'static str| {
            require(ok, || OutOfRange::new("sensor", field, value, allowed))
        };
        check(
            "pitch_um",
            pitch_um,
            pitch_um.is_finite() && pitch_um > 0.0,
            "a positive length",
        )?;
        check_simulated("sensor", subpixels)?;
        check("width", width as f64, width > 0, "at least 1 microlens")?;
        check("height", height as f64, height > 0, "at least 1 microlens")?;
        let total = width
            .checked_mul(height)
            .and_then(|n| n.checked_mul(subpixels.count()));
        let fits = total.is_some_and(|n| n <= MAX_SUBPIXELS);
        check(
            "width × height",
            width as f64 * height as f64,
            fits,
            "at most 2^30 sub-pixels",
        )?;
        check(
            "centre_mm.x",
            centre_mm.x,
            centre_mm.x.is_finite(),
            "a finite length",
        )?;
        check(
            "centre_mm.y",
            centre_mm.y,
            centre_mm.y.is_finite(),
            "a finite length",
        )?;
        Ok(Self {
            pitch_um,
            subpixels,
            width,
            whole_height: height,
            rows: 0..height,
            centre_mm,
        })
    }

    /// Some rows of the window: row 0 is the first of them, and each pixel is where it was, to the last bit.
    ///
    /// # Panics
    /// Rows that the window does not have, or none.
    pub fn rows(&self, rows: Range<usize>) -> Self {
        assert!(rows.start < rows.end && rows.end <= self.height());
        let first = self.rows.start;
        Self {
            rows: first + rows.start..first + rows.end,
            ..self.clone()
        }
    }

    /// Pitch of the microlenses, µm.
    pub fn pitch_um(&self) -> f64 {
        self.pitch_um
    }
    /// Pitch of the microlenses, mm.
    pub fn pitch_mm(&self) -> f64 {
        self.pitch_um * MM_PER_UM
    }
    /// Sub-pixels below each microlens.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }
    /// Microlenses in a row.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows of microlenses.
    pub fn height(&self) -> usize {
        self.rows.len()
    }
    /// Row of the whole window that row 0 is.
    pub fn first_row(&self) -> usize {
        self.rows.start
    }
    /// Centre of the window, sensor frame, mm.
    pub fn centre_mm(&self) -> DVec2 {
        let before = self.rows.start as f64;
        let after = (self.whole_height - self.rows.end) as f64;
        self.centre_mm + DVec2::Y * (0.5 * (before - after) * self.pitch_mm())
    }

    /// Sensor position of the stored-image position (column, row), where (0, 0) is the centre of the first pixel; mm.
    #[inline]
    pub fn position_mm(&self, column: f64, row: f64) -> DVec2 {
        let p = self.pitch_mm();
        let half = DVec2::new((self.width - 1) as f64, (self.whole_height - 1) as f64) * 0.5;
        let row = self.rows.start as f64 + row;
        self.centre_mm + (DVec2::new(column, row) - half) * p
    }

    /// The window that the pixels cover.
    pub fn window_mm(&self) -> SensorWindowMm {
        let p = self.pitch_mm();
        SensorWindowMm {
            centre: self.centre_mm(),
            half_width: 0.5 * self.width as f64 * p,
            half_height: 0.5 * self.height() as f64 * p,
        }
    }

    /// Distance of the window's farthest corner from the axis, mm.
    pub fn farthest_corner_mm(&self) -> f64 {
        let w = self.window_mm();
        DVec2::new(
            w.centre.x.abs() + w.half_width,
            w.centre.y.abs() + w.half_height,
        )
        .length()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_window_are_where_they_were() {
        let subpixels = Subpixels::new(2, 2).unwrap();
        let whole = Sensor::new(1.1, subpixels, (7, 11), DVec2::new(0.3, -0.7)).unwrap();
        let rows = whole.rows(2..9).rows(1..4);
        assert_eq!((rows.width(), rows.height(), rows.first_row()), (7, 3, 3));
        for (column, row) in [(0.0, 0.0), (6.0, 2.0), (3.0, 1.5)] {
            assert_eq!(
                rows.position_mm(column, row),
                whole.position_mm(column, row + 3.0)
            );
        }
        let window = rows.window_mm();
        let middle = rows.position_mm(3.0, 1.0);
        assert!((window.centre - middle).length() < 1e-12);
        assert!((window.half_height - 1.5 * 1.1e-3).abs() < 1e-15);
        assert_eq!(whole.rows(0..11), whole);
        assert_eq!(whole.centre_mm(), DVec2::new(0.3, -0.7));
    }
}
