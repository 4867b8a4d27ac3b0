//! What an FDTD run refuses, and why.

use crate::em::light::SolverError;
use crate::range::{self, OutOfRange};

/// A run that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FdtdError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A pixel or a material that cannot be.
    #[error(transparent)]
    Pixel(#[from] crate::em::StackError),
}

impl FdtdError {
    /// An error of `field`, which is `value` and may be `allowed`.
    pub fn value(
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Range(OutOfRange::new("fdtd", field, value, allowed.into()))
    }
}

impl From<FdtdError> for SolverError {
    fn from(error: FdtdError) -> Self {
        Self::Solver(Box::new(error))
    }
}

/// `Ok` if `value` lies in `low..=high` (a NaN does not).
pub(super) fn within(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<(), FdtdError> {
    Ok(range::within("fdtd", field, value, low..=high)?)
}
