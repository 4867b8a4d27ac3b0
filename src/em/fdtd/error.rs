//! What an FDTD run refuses.

use super::SolverError;
use crate::range::{self, OutOfRange};

/// The error of `field`, which is `value` and may be `allowed`.
pub(super) fn refused(
    field: &'static str,
    value: impl std::fmt::Display,
    allowed: impl Into<String>,
) -> SolverError {
    OutOfRange::new("fdtd", field, value, allowed.into()).into()
}

/// `Ok` if `value` lies in `low..=high` (a NaN does not).
pub(super) fn within(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<(), SolverError> {
    Ok(range::within("fdtd", field, value, low..=high)?)
}
