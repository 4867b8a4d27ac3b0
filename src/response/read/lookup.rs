//! One call for the renderer, whatever the pixel model.

use std::ops::Range;

use super::{Interpolator, ShiftedInterpolator};
use crate::em::geometric::GeometricResponse;
use crate::response::{AngularResponse, ChiefRayShifts};
use crate::sensor::{MovingFrame, Subpixels};

/// A pixel's response: a table, or the exact geometric pixel.
#[derive(Clone, Debug, PartialEq)]
// A program holds one or two of these, so the size of the larger variant costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum Response {
    /// A table, from any model or file.
    Table(AngularResponse),
    /// Boxes (eq. 2), evaluated exactly.
    Geometric(GeometricResponse),
}

/// A [`Response`] at one wavelength, ready to be read.
#[derive(Clone, Debug)]
pub enum ResponseLookup {
    /// Bilinear lookup in a table of the centred lens; a shifted one is read in its moving frame.
    Table(Interpolator),
    /// Lookup in a table of all shifts.
    Shifted(ShiftedInterpolator),
    /// Bilinear lookup in the table of one lens shift, whichever shift is asked for.
    Fixed(Interpolator),
    /// Boxes (eq. 2), evaluated exactly.
    Geometric(GeometricResponse),
}

impl ResponseLookup {
    /// Whether mirrored directions under a mirrored lens shift have mirrored sub-pixels.
    pub fn is_mirrored(&self) -> bool {
        match self {
            Self::Table(table) => table.is_mirrored(),
            // Of such tables one quadrant of shifts is kept.
            Self::Shifted(_) | Self::Geometric(_) => true,
            Self::Fixed(_) => false,
        }
    }
}

impl Response {
    /// The lookup at `wavelength_nm` (the geometric pixel is the same at all).
    pub fn at(&self, wavelength_nm: f64) -> ResponseLookup {
        match self {
            Self::Table(t) => match t.shifted_interpolator(wavelength_nm) {
                Some(shifted) => ResponseLookup::Shifted(shifted),
                None => ResponseLookup::Table(t.interpolator(wavelength_nm)),
            },
            Self::Geometric(g) => ResponseLookup::Geometric(*g),
        }
    }
    /// The wavelength that [`Self::at`] reads in place of `wavelength_nm`: the nearest within the table's, which is not
    /// extrapolated; 0 of the geometric pixel, which has none.
    pub fn read_nm(&self, wavelength_nm: f64) -> f64 {
        match self {
            Self::Table(t) => {
                let w = &t.axes().wavelengths_nm;
                wavelength_nm.clamp(w[0], w[w.len() - 1])
            }
            Self::Geometric(_) => 0.0,
        }
    }
    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        match self {
            Self::Table(t) => t.subpixels(),
            Self::Geometric(g) => g.subpixels(),
        }
    }
    /// Which lens shift each chief ray needs, where the table knows.
    pub fn chief_ray_shifts(&self) -> Option<&ChiefRayShifts> {
        match self {
            Self::Table(t) => t.meta().chief_ray_shifts.as_ref(),
            Self::Geometric(_) => None,
        }
    }
    /// Pitch in µm.
    pub fn pitch_um(&self) -> f64 {
        match self {
            Self::Table(t) => t.meta().pitch_um,
            Self::Geometric(g) => g.pitch_um(),
        }
    }
    /// How a lens shift moves the response.
    pub fn frame(&self) -> MovingFrame {
        match self {
            Self::Table(t) => t.frame(),
            Self::Geometric(g) => g.frame(),
        }
    }
}

impl ResponseLookup {
    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        match self {
            Self::Table(t) | Self::Fixed(t) => t.subpixels(),
            Self::Shifted(t) => t.subpixels(),
            Self::Geometric(g) => g.subpixels(),
        }
    }
    /// Where light lands behind the microlens.
    pub fn frame(&self) -> MovingFrame {
        match self {
            Self::Table(t) | Self::Fixed(t) => t.frame(),
            Self::Shifted(t) => t.frame(),
            Self::Geometric(g) => g.frame(),
        }
    }
    /// The weights P_i of one direction under a centred lens; `out` has one place per sub-pixel.
    pub fn weights(&self, u: f32, v: f32, out: &mut [f32]) {
        if let Some(out) = out.get_mut(..self.subpixels().count()) {
            self.weights_batch(&[u], &[v], out);
        }
    }
    /// The weights of many directions under a centred lens: `out` is `[direction][sub-pixel]`. The shortest slice
    /// counts.
    pub fn weights_batch(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        match self {
            Self::Table(t) | Self::Fixed(t) => t.weights_batch(u, v, out),
            Self::Shifted(t) => t.weights_batch([0.0, 0.0], u, v, out),
            Self::Geometric(g) => g.weights_batch(u, v, out),
        }
    }
    /// [`Self::weights_batch`] under a lens shifted by `shift_um`; a table of the centred lens moves the directions in
    /// place.
    pub fn weights_under(&self, shift_um: [f64; 2], u: &mut [f32], v: &mut [f32], out: &mut [f32]) {
        let n = u
            .len()
            .min(v.len())
            .min(out.len() / self.subpixels().count());
        self.weights_of_parts(std::iter::once((0..n, shift_um)), [u, v], out);
    }
    /// [`Self::weights_under`] for parts of the directions that each have a shift of their own, and which together are
    /// all of them.
    pub(crate) fn weights_of_parts(
        &self,
        parts: impl Iterator<Item = (Range<usize>, [f64; 2])>,
        [u, v]: [&mut [f32]; 2],
        out: &mut [f32],
    ) {
        match self {
            Self::Shifted(t) => {
                let count = t.subpixels().count();
                for (part, shift_um) in parts {
                    let out = &mut out[part.start * count..part.end * count];
                    t.weights_batch(shift_um, &u[part.clone()], &v[part], out);
                }
            }
            Self::Fixed(t) => t.weights_batch(u, v, out),
            Self::Table(_) | Self::Geometric(_) => {
                for (part, shift_um) in parts {
                    let (u, v) = (&mut u[part.clone()], &mut v[part]);
                    self.frame().centred_batch(shift_um, u, v);
                }
                self.weights_batch(u, v, out);
            }
        }
    }
    /// [`Self::weights_under`] for directions that each stand for a cell of `spread` in slope: the edges of boxes are
    /// averaged over it ([`GeometricResponse::weights_spread`]); tables are smooth as they are.
    pub(crate) fn weights_of_cells(
        &self,
        shift_um: [f64; 2],
        spread: f64,
        [u, v]: [&mut [f32]; 2],
        out: &mut [f32],
    ) {
        match self {
            Self::Geometric(g) => {
                self.frame().centred_batch(shift_um, u, v);
                g.weights_spread(u, v, spread, out);
            }
            _ => self.weights_under(shift_um, u, v, out),
        }
    }
}
