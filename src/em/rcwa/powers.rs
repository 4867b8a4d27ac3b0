//! Incident waves, and powers of their fluxes.

use super::basis::Basis;
use super::linear::{C, Matrix};
use super::silicon::InSilicon;
use crate::em::SolverError;
use crate::em::light::Powers;

/// Order 0, a column per wave.
pub(super) fn order_zero(basis: &Basis, waves: &[[f64; 2]]) -> Matrix {
    let mut out = Matrix::zeros(basis.len(), waves.len());
    for (i, (orders, first)) in [(&basis.x, 0), (&basis.y, basis.x.len())]
        .into_iter()
        .enumerate()
    {
        if let Some(at) = orders.iter().position(|o| o.n == [0, 0]) {
            for (j, wave) in waves.iter().enumerate() {
                out[(first + at, j)] = C::from(wave[i]);
            }
        }
    }
    out
}

/// Sum of all powers, the photodiodes' last.
pub(super) fn balance(p: &Powers) -> f64 {
    p.reflected + p.transmitted + p.elsewhere + p.absorbed.iter().sum::<f64>()
}

/// # Errors
/// Powers that are not finite: a matrix could not be inverted.
pub(super) fn check_finite<'a>(
    powers: impl IntoIterator<Item = &'a Powers>,
) -> Result<(), SolverError> {
    if powers.into_iter().all(|p| balance(p).is_finite()) {
        return Ok(());
    }
    let why = "rcwa: the powers are not finite; a direction a hair off, or other orders, may help";
    Err(SolverError::NotFound(why.into()))
}

/// Powers of fluxes.
pub(super) fn powers(inside: &InSilicon, entering: f64, reflected: f64, unit: f64) -> Powers {
    Powers {
        absorbed: inside.absorbed.iter().map(|p| p * unit).collect(),
        // What trenches and isolation absorb is known by this difference only: with them both ways are equal.
        absorbed_by_flux: vec![(inside.entering - inside.leaving - inside.between) * unit],
        reflected: reflected * unit,
        transmitted: inside.leaving * unit,
        elsewhere: (entering - inside.entering + inside.between) * unit,
    }
}
