//! The angular response as a table, checked when made.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{Interpolator, MovingFrame, ResponseError};
use crate::sensor::Subpixels;

/// What Σ P_i may exceed 1 by: rounding of f32, no more.
pub(super) const SUM_ROUNDING: f32 = 1e-5;

/// Axes of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseAxes {
    /// Wavelengths in nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Shifts (s_x, s_y) of the microlens in µm; the first is (0, 0), the centred lens.
    pub shifts_um: Vec<[f64; 2]>,
    /// Direction cosine u: regular, odd count ≥ 3, symmetric about 0, within ±1.
    pub u: Vec<f64>,
    /// Direction cosine v: as `u`.
    pub v: Vec<f64>,
}

/// Where a table comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponseMeta {
    /// Pixel model and its version, e.g. `wave-1`.
    pub model: String,
    /// Settings of the model.
    pub settings: serde_json::Value,
    /// The pixel, as the model was given it.
    pub pixel: serde_json::Value,
    /// Pitch of the pixel in µm.
    pub pitch_um: f64,
    /// Sub-pixels (m, n).
    pub subpixels: Subpixels,
    /// How a lens shift moves the response.
    pub frame: MovingFrame,
    /// Hash (blake3, hex) of model, settings and pixel: the same key means the same table.
    pub key: String,
}

/// P_i(λ, shift, u, v): power absorbed by sub-pixel i over `irradiance × pitch² × cos θ`.
///
/// Nodes outside the unit disc hold the value of the nearest simulated direction on the same meridian, so that bilinear
/// lookup near the rim stays sensible.
#[derive(Clone, Debug, PartialEq)]
pub struct AngularResponse {
    axes: ResponseAxes,
    meta: ResponseMeta,
    /// `[wavelength][shift][v][u][sub-pixel]`
    table: Vec<f32>,
}

impl AngularResponse {
    /// Checks shapes, axes and 0 ≤ P_i, Σ P_i ≤ 1 at every node. `table` is `[wavelength][shift][v][u][sub-pixel]`.
    pub fn new(
        axes: ResponseAxes,
        meta: ResponseMeta,
        table: Vec<f32>,
    ) -> Result<Self, ResponseError> {
        check_axes(&axes)?;
        MovingFrame::new(meta.frame.index, meta.frame.height_um)?;
        if !(meta.pitch_um > 0.0 && meta.pitch_um.is_finite()) {
            return Err(ResponseError::value(
                "pitch_um",
                meta.pitch_um,
                "finite and > 0",
            ));
        }
        let nodes = axes.wavelengths_nm.len() * axes.shifts_um.len() * axes.v.len() * axes.u.len();
        let count = meta.subpixels.count();
        if table.len() != nodes * count {
            return Err(ResponseError::value(
                "P (length)",
                table.len(),
                "wavelengths × shifts × v × u × sub-pixels",
            ));
        }
        for node in table.chunks_exact(count) {
            if let Some(p) = node.iter().find(|p| !(0.0..=1.0).contains(*p)) {
                return Err(ResponseError::value("P", p, "0 to 1"));
            }
            let sum: f32 = node.iter().sum();
            if sum > 1.0 + SUM_ROUNDING {
                return Err(ResponseError::value(
                    "P summed over sub-pixels",
                    sum,
                    "at most 1",
                ));
            }
        }
        Ok(Self { axes, meta, table })
    }

    /// The axes.
    pub fn axes(&self) -> &ResponseAxes {
        &self.axes
    }
    /// Where the table comes from.
    pub fn meta(&self) -> &ResponseMeta {
        &self.meta
    }
    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.meta.subpixels
    }
    /// How a lens shift moves the response.
    pub fn frame(&self) -> MovingFrame {
        self.meta.frame
    }
    /// All values, `[wavelength][shift][v][u][sub-pixel]`.
    pub fn table(&self) -> &[f32] {
        &self.table
    }
    /// The sub-pixels' values at one node.
    pub fn node(&self, wavelength: usize, shift: usize, iv: usize, iu: usize) -> &[f32] {
        let count = self.meta.subpixels.count();
        let plane = self.plane(wavelength, shift);
        let at = plane.start + (iv * self.axes.u.len() + iu) * count;
        &self.table[at..at + count]
    }

    /// Bilinear lookup of the centred lens at `wavelength_nm`: linear between the two nearest wavelengths of the table, the
    /// end's own table beyond them.
    pub fn interpolator(&self, wavelength_nm: f64) -> Interpolator {
        let w = &self.axes.wavelengths_nm;
        let upper = w.partition_point(|&x| x < wavelength_nm);
        let (a, b) = (upper.saturating_sub(1), upper.min(w.len() - 1));
        let part = if a == b {
            0.0
        } else {
            ((wavelength_nm - w[a]) / (w[b] - w[a])) as f32
        };
        let (low, high) = (&self.table[self.plane(a, 0)], &self.table[self.plane(b, 0)]);
        let plane = low
            .iter()
            .zip(high)
            .map(|(&p, &q)| p * (1.0 - part) + q * part)
            .collect();
        Interpolator::new(
            self.meta.subpixels,
            self.meta.frame,
            (self.axes.u.len(), self.axes.u[self.axes.u.len() - 1] as f32),
            (self.axes.v.len(), self.axes.v[self.axes.v.len() - 1] as f32),
            plane,
        )
    }

    fn plane(&self, wavelength: usize, shift: usize) -> Range<usize> {
        let size = self.axes.v.len() * self.axes.u.len() * self.meta.subpixels.count();
        let at = (wavelength * self.axes.shifts_um.len() + shift) * size;
        at..at + size
    }
}

fn check_axes(axes: &ResponseAxes) -> Result<(), ResponseError> {
    let w = &axes.wavelengths_nm;
    if w.is_empty()
        || w.iter().any(|x| !(x.is_finite() && *x > 0.0))
        || w.windows(2).any(|p| p[1] <= p[0])
    {
        return Err(ResponseError::value(
            "wavelength_nm",
            format!("{w:?}"),
            "at least one, positive and increasing",
        ));
    }
    let s = &axes.shifts_um;
    if s.first() != Some(&[0.0, 0.0]) || s.iter().flatten().any(|x| !x.is_finite()) {
        return Err(ResponseError::value(
            "shift_um",
            format!("{s:?}"),
            "finite, the first one (0, 0)",
        ));
    }
    check_cosines("u", &axes.u)?;
    check_cosines("v", &axes.v)
}

fn check_cosines(field: &'static str, axis: &[f64]) -> Result<(), ResponseError> {
    let wrong = |value: String| {
        Err(ResponseError::value(
            field,
            value,
            "odd count of at least 3, regular, increasing, symmetric about 0, within -1 to 1",
        ))
    };
    let n = axis.len();
    if n < 3 || n.is_multiple_of(2) {
        return wrong(format!("{n} values"));
    }
    let end = axis[n - 1];
    if !(end > 0.0 && end <= 1.0) {
        return wrong(format!("up to {end}"));
    }
    let half = (n / 2) as f64;
    for (i, &x) in axis.iter().enumerate() {
        let wanted = end * (i as f64 - half) / half;
        // A NaN must be refused, too.
        if x.is_nan() || (x - wanted).abs() > 1e-9 {
            return wrong(format!(
                "{x} at place {i} (a regular axis has {wanted} there)"
            ));
        }
    }
    Ok(())
}
