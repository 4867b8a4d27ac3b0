//! The grid of microlenses, and the window of it that is rendered.

use glam::DVec2;

use super::{Subpixels, check_simulated};
use crate::field::SensorWindowMm;
use crate::range::{OutOfRange, require};
use crate::units::MM_PER_UM;

/// Largest number of sub-pixels that one render may hold: 2³⁰, 12 GiB of RGB floats.
const MAX_SUBPIXELS: usize = 1 << 30;

/// A window of `width × height` microlenses (pixels) of pitch `pitch_um`, around `centre_mm`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    pitch_um: f64,
    subpixels: Subpixels,
    width: usize,
    height: usize,
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
            height,
            centre_mm,
        })
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
        self.height
    }
    /// Centre of the window, sensor frame, mm.
    pub fn centre_mm(&self) -> DVec2 {
        self.centre_mm
    }

    /// Sensor position of the stored-image position (column, row), where (0, 0) is the centre of the first pixel; mm.
    #[inline]
    pub fn position_mm(&self, column: f64, row: f64) -> DVec2 {
        let p = self.pitch_mm();
        let half = DVec2::new((self.width - 1) as f64, (self.height - 1) as f64) * 0.5;
        self.centre_mm + (DVec2::new(column, row) - half) * p
    }

    /// The window that the pixels cover.
    pub fn window_mm(&self) -> SensorWindowMm {
        let p = self.pitch_mm();
        SensorWindowMm {
            centre: self.centre_mm,
            half_width: 0.5 * self.width as f64 * p,
            half_height: 0.5 * self.height as f64 * p,
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
