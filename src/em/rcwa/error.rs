//! What the Fourier modal level refuses, and why.

use crate::em::light::SolverError;
use crate::range::{self, OutOfRange};

/// A solution that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RcwaError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// The modes of a layer were not found.
    #[error(
        "rcwa: the eigenvalue iteration on {size} functions did not converge; other orders may help"
    )]
    Eigen {
        /// Functions.
        size: usize,
    },
    /// A matrix could not be inverted.
    #[error("rcwa: the powers are not finite; a direction a hair off, or other orders, may help")]
    NotFinite,
    /// A pixel or a material that cannot be.
    #[error(transparent)]
    Pixel(#[from] crate::em::StackError),
}

impl From<RcwaError> for SolverError {
    fn from(error: RcwaError) -> Self {
        Self::Solver(Box::new(error))
    }
}

/// `Ok` if `value` lies in `low..=high` (a NaN does not).
pub(super) fn within(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<(), RcwaError> {
    Ok(range::within("rcwa", field, value, low..=high)?)
}
