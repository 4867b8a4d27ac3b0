//! JSON files, and the version of the program in them.

use std::path::Path;

use super::error::WriteError;

/// Version of this program, as written into the files.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Pretty JSON with a final line feed.
pub(super) fn json<T: serde::Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, WriteError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|cause| WriteError::Json {
        path: path.to_path_buf(),
        cause,
    })?;
    bytes.push(b'\n');
    Ok(bytes)
}
