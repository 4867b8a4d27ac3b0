//! The angular response as a table, checked when made.

use std::ops::Range;

use super::{ChiefRayShifts, ResponseError, ResponseMeta};
use crate::em::symmetry::symmetries_of;
use crate::em::{PixelStack, ShiftGrid};
use crate::sensor::{Charge, CollectedAt, MovingFrame, Subpixels, check_simulated};
use crate::spectrum::ChannelWavelengths;

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
    /// `table` is `[wavelength][shift][v][u][sub-pixel]`.
    ///
    /// # Errors
    /// Shapes or axes that do not fit, or nodes without 0 ≤ P_i, Σ P_i ≤ 1.
    pub fn new(
        axes: ResponseAxes,
        meta: ResponseMeta,
        table: Vec<f32>,
    ) -> Result<Self, ResponseError> {
        check_axes(&axes)?;
        check_shifts(&axes, &meta)?;
        MovingFrame::new(meta.frame.index, meta.frame.height_um)?;
        if !(meta.pitch_um > 0.0 && meta.pitch_um.is_finite()) {
            return Err(ResponseError::value(
                "pitch_um",
                meta.pitch_um,
                "finite and > 0",
            ));
        }
        let nodes = axes.wavelengths_nm.len() * axes.shifts_um.len() * axes.v.len() * axes.u.len();
        check_simulated("response", meta.subpixels)?;
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

    /// The table of a pixel whose charge wanders.
    ///
    /// # Errors
    /// Numbers that cannot be; diffusion in a table of the centred lens, which does not know what other
    /// shifts give; a place where charge is collected, of a pixel whose silicon is not said to absorb.
    pub fn with_charge(mut self, charge: Charge) -> Result<Self, ResponseError> {
        charge.check()?;
        if charge.diffusion_um > 0.0 && self.meta.shift_grid.is_none() {
            return Err(ResponseError::value(
                "diffusion_um",
                charge.diffusion_um,
                "0 for a table of the centred lens; of all lens shifts (shifts = 8 or more) any",
            ));
        }
        let reference_nm = ChannelWavelengths::default().reference_nm();
        let silicon = self.meta.pixel.silicon_at(reference_nm);
        let absorbs = silicon.is_ok_and(|silicon| silicon.absorption_um.is_finite());
        if charge.collected_at != CollectedAt::Anywhere && !absorbs {
            return Err(ResponseError::value(
                "collected_at",
                format!("{:?}", charge.collected_at),
                "Anywhere for a pixel whose silicon is not said to absorb",
            ));
        }
        self.meta.charge = charge;
        Ok(self)
    }

    /// The same values, said to be of this pixel.
    pub(super) fn with_pixel(mut self, pixel: PixelStack) -> Self {
        self.meta.pixel = pixel;
        self
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

    /// The table with every `divisor`-th of the shift grid's nodes along each axis; `None` for a table of the centred
    /// lens, or where fewer would be no grid.
    pub fn with_fewer_shifts(&self, divisor: usize) -> Option<Self> {
        let grid = self.meta.shift_grid?;
        if divisor == 0 || !grid.per_pitch.is_multiple_of(divisor) {
            return None;
        }
        let fewer = ShiftGrid::new(grid.pitch_um, grid.per_pitch / divisor).ok()?;
        let stored = grid.stored(&symmetries_of(self.meta.subpixels));
        let chosen: Vec<usize> = (0..stored.len())
            .filter(|&i| stored[i].iter().all(|x| x.is_multiple_of(divisor)))
            .collect();
        let mut table = Vec::new();
        for w in 0..self.axes.wavelengths_nm.len() {
            for &i in &chosen {
                table.extend_from_slice(&self.table[self.plane(w, i)]);
            }
        }
        let axes = ResponseAxes {
            shifts_um: chosen.iter().map(|&i| self.axes.shifts_um[i]).collect(),
            ..self.axes.clone()
        };
        let meta = ResponseMeta {
            shift_grid: Some(fewer),
            key: format!("{} / {divisor}", self.meta.key),
            ..self.meta.clone()
        };
        Self::new(axes, meta, table).ok()
    }

    /// The table with the shifts that chief rays need.
    pub(super) fn with_chief_ray_shifts(mut self, shifts: ChiefRayShifts) -> Self {
        self.meta.chief_ray_shifts = Some(shifts);
        self
    }

    pub(super) fn plane(&self, wavelength: usize, shift: usize) -> Range<usize> {
        let size = self.axes.v.len() * self.axes.u.len() * self.meta.subpixels.count();
        let at = (wavelength * self.axes.shifts_um.len() + shift) * size;
        at..at + size
    }
}

/// The shifts of a grid are its stored nodes, and a square pixel's axes are equal, or symmetry could not fill the rest.
fn check_shifts(axes: &ResponseAxes, meta: &ResponseMeta) -> Result<(), ResponseError> {
    if let Some(map) = &meta.chief_ray_shifts {
        map.check(meta.subpixels)?;
    }
    let Some(grid) = &meta.shift_grid else {
        return Ok(());
    };
    ShiftGrid::new(grid.pitch_um, grid.per_pitch)?;
    let stored = grid.stored(&symmetries_of(meta.subpixels));
    let near = |(node, shift): (&[usize; 2], &[f64; 2])| {
        let wanted = grid.shift_um(*node);
        (0..2).all(|a| (wanted[a] - shift[a]).abs() < 1e-9 * grid.pitch_um)
    };
    let same_axes = meta.subpixels.m() != meta.subpixels.n() || axes.u == axes.v;
    let same_shifts =
        stored.len() == axes.shifts_um.len() && stored.iter().zip(&axes.shifts_um).all(near);
    if grid.pitch_um == meta.pitch_um && same_axes && same_shifts {
        return Ok(());
    }
    Err(ResponseError::value(
        "shift_um",
        format!("{} shifts", axes.shifts_um.len()),
        "the octant (of pixels that are not square: the quadrant) of shift_grid, with the pixel's pitch and u as v",
    ))
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
