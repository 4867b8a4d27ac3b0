//! What an FDTD run refuses, and why.

/// A run that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FdtdError {
    /// A value out of its range.
    #[error("fdtd: {field} is {value}; allowed: {allowed}")]
    Value {
        /// The field.
        field: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

impl FdtdError {
    /// An error of `field`, which is `value` and may be `allowed`.
    pub fn value(
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Value {
            field,
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }
}

/// `Ok` if `value` lies in `low..=high` (a NaN does not).
pub(super) fn within(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<(), FdtdError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(FdtdError::value(field, value, format!("{low} to {high}")))
    }
}
