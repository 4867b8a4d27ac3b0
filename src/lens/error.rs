//! What can be wrong with a lens, or with what is asked of one.

use crate::range::OutOfRange;

/// Why a lens cannot be made, changed or used as asked. Each message names the file, the field, its value and what is
/// allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LensError {
    /// The text is not what the format asks for: bad syntax, a missing or unknown field, a wrong type.
    #[error("{file}: {field}: {reason}")]
    Format {
        /// The file, or the name of a built-in lens.
        file: String,
        /// The field, such as `surfaces[3].nd`, or the line.
        field: String,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// A value that no lens can have, or a request that this one cannot meet.
    #[error(transparent)]
    Value(#[from] OutOfRange),
    /// No built-in lens has this name.
    #[error("there is no built-in lens `{name}`; there are: {known}")]
    UnknownLens {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the operating system said.
        reason: String,
    },
}
