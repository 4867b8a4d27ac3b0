//! The lens alone, between air and its own resin without end: what it makes of light from above and from below.

use super::basis::Basis;
use super::layers;
use super::lens::LensSlices;
use super::linear::{C, Matrix, plus_one, solve};
use super::uniform::Uniform;

/// Tangential E of waves going up and down.
pub(super) struct FreeLens {
    /// Going down below the lens of the incident waves, a column each.
    pub down: Matrix,
    /// Going up in the air of the same.
    pub up: Matrix,
    /// Thrown back down of waves that come from below.
    pub back: Matrix,
    /// Going up in the air of waves that come from below.
    pub out: Matrix,
}

impl FreeLens {
    /// Of resin of this ε, lit by `incident` (E, a column each).
    pub fn new(
        slices: &LensSlices,
        basis: &Basis,
        epsilon: C,
        k0_per_um: f64,
        incident: &Matrix,
    ) -> Self {
        let (air, resin) = (Uniform::new(basis, C::ONE), Uniform::new(basis, epsilon));
        let mut admittance = resin.matrix();
        let mut passages = Vec::new();
        for slice in (0..slices.count()).rev() {
            let climbed = slices.climb(basis, slice, k0_per_um, &admittance);
            passages.push(climbed.passage);
            admittance = climbed.above;
        }
        let twice = air.times(incident) * faer::Scale(C::from(2.0));
        let e = solve(&(air.matrix() + &admittance), &twice);
        let up = &e - incident;
        let down = passages.iter().rev().fold(e, |e, passage| passage * &e);

        // Upside down: with z and h turned round, a slice has the same equations.
        let mut admittance = air.matrix();
        let mut out = Matrix::identity(basis.len(), basis.len());
        for slice in 0..slices.count() {
            let climbed = slices.climb(basis, slice, k0_per_um, &admittance);
            out = &out * &climbed.passage;
            admittance = climbed.above;
        }
        let back = layers::reflection(&resin, &admittance);
        let out = out * plus_one(back.clone());
        Self {
            down,
            up,
            back,
            out,
        }
    }
}
