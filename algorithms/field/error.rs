//! Fields that cannot be fitted.

use super::LARGEST_DEGREE;

/// A fit that cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// Degree out of range.
    #[error("degree {0}: allowed is 0 to {LARGEST_DEGREE}")]
    Degree(usize),
    /// Fewer observations than coefficients.
    #[error("{found} observations: a field of degree {degree} needs at least {needed}")]
    TooFew {
        /// Observations.
        found: usize,
        /// Coefficients a component.
        needed: usize,
        /// Degree.
        degree: usize,
    },
    /// The places do not fix all coefficients, or the loss left too few of them.
    #[error(
        "the matches lie so (on a line, in one corner) that they do not fix a field of degree {0}"
    )]
    Singular(usize),
    /// NaN, infinity or a covariance that is none.
    #[error("match {index}: not finite, or its covariance is not positive semidefinite")]
    Observation {
        /// Index of the observation.
        index: usize,
    },
}
