//! Why two pictures cannot be matched.

use crate::plane_error::PlaneError;

/// Pictures or settings that cannot be matched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MatchError {
    /// Not one channel of finite numbers.
    #[error(transparent)]
    Plane(#[from] PlaneError),
    /// A and B differ in size.
    #[error("A has {} × {} pixels and B {} × {}: both must be of one size", .a.0, .a.1, .b.0, .b.1)]
    Size {
        /// Columns and rows of A.
        a: (usize, usize),
        /// Columns and rows of B.
        b: (usize, usize),
    },
    /// No window fits.
    #[error(
        "{width} × {height} pixels: a window of {window} px and its interpolation need at least {least} × {least}"
    )]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Window.
        window: usize,
        /// Smallest side.
        least: usize,
    },
    /// A setting out of its range.
    #[error("{name} = {value}: allowed is {allowed}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Range.
        allowed: &'static str,
    },
}
