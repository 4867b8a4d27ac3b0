//! The error of a field that is out of its range.

use std::borrow::Cow;

/// A field of a configuration or recipe that is out of its range. The field's name says whose it is, as in
/// `lens.focus_mm`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} is {value}; allowed: {allowed}")]
pub struct FieldError {
    /// The field.
    pub field: Cow<'static, str>,
    /// The value that was given.
    pub value: String,
    /// What is allowed.
    pub allowed: Cow<'static, str>,
}

impl FieldError {
    /// The error of `field`, which is `value` and may be what `allowed` says.
    pub fn new(
        field: impl Into<Cow<'static, str>>,
        value: impl ToString,
        allowed: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }
}
