//! Why a configuration is refused.

use quadpixel::range::OutOfRange;

use crate::field_error::FieldError;

/// Why a configuration is refused.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The text is no configuration.
    #[error("{file}: {cause}")]
    Toml {
        /// The file.
        file: String,
        /// The place and what is wrong there.
        cause: Box<toml::de::Error>,
    },
    /// A field of a file.
    #[error("{file}: {cause}")]
    File {
        /// The file.
        file: String,
        /// The field.
        cause: Box<Self>,
    },
    /// A field out of its range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A list without entries, or a number that is 0.
    #[error("{0} is empty or 0; allowed: at least 1")]
    Empty(&'static str),
    /// Fields that do not go together, and what does.
    #[error("{0}")]
    Together(String),
    /// A tolerance that is none: its field, its value and what is allowed.
    #[error("{0}")]
    Tolerance(String),
    /// A number of lens shifts that no table can have.
    #[error("response.shifts: {0}")]
    Shifts(OutOfRange),
    /// A value that a part of the camera refuses.
    #[error(transparent)]
    Range(#[from] OutOfRange),
}

impl ConfigError {
    /// Whether the caller can mend it: always.
    pub fn is_input(&self) -> bool {
        true
    }
}

/// Checks that no list is empty and no number 0.
pub(super) fn check_filled(fields: &[(&'static str, usize)]) -> Result<(), ConfigError> {
    match fields.iter().find(|(_, n)| *n == 0) {
        Some((field, _)) => Err(ConfigError::Empty(field)),
        None => Ok(()),
    }
}
