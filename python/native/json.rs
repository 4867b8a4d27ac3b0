//! JSON between Python and the libraries, and their errors as Python's.

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use quadpixel_cli::exit::CommandError;
use serde_json::Value;
use serde_json::de::from_str;

/// An error in the command line's words: a `ValueError` where the caller can mend it, else an `OSError`.
pub fn raised(error: CommandError) -> PyErr {
    match error {
        CommandError::Input(text) => PyValueError::new_err(text),
        CommandError::Failed(text) => PyOSError::new_err(text),
    }
}

/// As [`raised`], of an error that the caller can mend.
pub fn refused(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Reads what `what` is called in errors.
pub fn read<T: serde::de::DeserializeOwned>(text: &str, what: &str) -> PyResult<T> {
    from_str(text).map_err(|e| refused(format!("{what}: {e}")))
}

/// Text of what the libraries describe.
pub fn text(value: &impl serde::Serialize) -> Result<String, CommandError> {
    serde_json::to_string(value).map_err(|e| CommandError::failed(format!("JSON: {e}")))
}

/// As [`text`], of a value that is JSON already.
pub fn of(value: Value) -> String {
    value.to_string()
}
