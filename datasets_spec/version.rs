//! Reading a description: its version first, so that one of another release is named as such and not as a fault of some
//! field.

use serde::de::DeserializeOwned;

use crate::manifest::DatasetManifest;
use crate::paths::{PathError, checked_path, checked_sample_name};
use serde_json::Value;

/// Version of the layout and of both schemas. It changes when a reader of the old one would misread the new one.
pub const SCHEMA_VERSION: u32 = 3;

/// Why a `dataset.json`, `meta.json` or `camera.json` cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// Of an earlier release.
    #[error(
        "schema version {0}: it was made by an earlier release, and this one reads version {SCHEMA_VERSION}; make it again with \
         `qpgen render` of a sample's meta.json, or with `qpgen dataset`"
    )]
    Earlier(u64),
    /// Of a later release.
    #[error(
        "schema version {0}: it was made by a later release, and this one reads version {SCHEMA_VERSION}"
    )]
    Later(u64),
    /// It says no version.
    #[error("has no schema version")]
    NoVersion,
    /// A name in it that leads elsewhere.
    #[error(transparent)]
    Name(#[from] PathError),
    /// It does not follow the schema.
    #[error("does not follow the schema: {0}")]
    Schema(#[from] serde_json::Error),
}

/// Whether a description is of this release's version.
///
/// # Errors
/// [`ParseError::Earlier`], [`ParseError::Later`], [`ParseError::NoVersion`].
pub fn check_version(description: &Value) -> Result<(), ParseError> {
    let version = description.get("schema_version").and_then(Value::as_u64);
    match version.ok_or(ParseError::NoVersion)? {
        version if version == u64::from(SCHEMA_VERSION) => Ok(()),
        version if version < u64::from(SCHEMA_VERSION) => Err(ParseError::Earlier(version)),
        version => Err(ParseError::Later(version)),
    }
}

/// A description whose names lead nowhere else. To have one means that its names were looked at.
pub trait Description: DeserializeOwned {
    /// Looks at every name that a path is made of.
    ///
    /// # Errors
    /// The first that is not allowed.
    fn check_names(&self) -> Result<(), PathError>;
}

impl Description for DatasetManifest {
    fn check_names(&self) -> Result<(), PathError> {
        for sample in &self.samples {
            checked_sample_name(&sample.id)?;
        }
        for file in &self.files {
            checked_path(&file.path)?;
        }
        Ok(())
    }
}

/// Reads a `dataset.json` or `meta.json` that a stranger may have written: [`parse`], and its names.
///
/// # Errors
/// See [`ParseError`].
pub fn read_description<T: Description>(bytes: &[u8]) -> Result<T, ParseError> {
    let description: T = parse(bytes)?;
    description.check_names()?;
    Ok(description)
}

/// Reads a `dataset.json`, `meta.json` or `camera.json`; its names are anything: see [`read_description`].
///
/// # Errors
/// See [`ParseError`].
pub fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, ParseError> {
    check_version(&serde_json::from_slice(bytes)?)?;
    Ok(serde_json::from_slice(bytes)?)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::{CameraDescription, DatasetManifest, SampleMeta};

    #[test]
    fn no_name_of_a_manifest_leads_elsewhere() {
        let with = |id: &str, path: &str| {
            let text = serde_json::json!({
                "schema_version": SCHEMA_VERSION, "tool": { "name": "t", "version": "1" }, "seed": 1,
                "configuration": null, "inputs": {}, "units": {}, "conventions": {}, "licence": "CC0-1.0",
                "samples": [{ "id": id, "scene": "../<script>", "split": "train" }],
                "files": [{ "path": path, "bytes": 0, "blake3": "" }],
            });
            read_description::<DatasetManifest>(text.to_string().as_bytes())
        };
        with("000001", "samples/000001/raw.png").unwrap();
        for id in ["../../outside", "/etc", "1", "<script>", "00000a", ""] {
            let text = with(id, "README.md").unwrap_err().to_string();
            assert!(text.contains("six digits"), "{id}: {text}");
        }
        for path in ["../x", "/etc/passwd", "a//b", "samples/../../x", "a<b"] {
            let text = with("000001", path).unwrap_err().to_string();
            assert!(
                text.contains("below the dataset's folder"),
                "{path}: {text}"
            );
        }
    }

    #[test]
    fn what_an_earlier_release_made_is_named_with_how_to_make_it_again() {
        // Of another version no field may be looked at: there is nothing else in this one.
        let early = br#"{ "schema_version": 1, "lens": 3 }"#;
        let said = [
            parse::<SampleMeta>(early).unwrap_err().to_string(),
            parse::<DatasetManifest>(early).unwrap_err().to_string(),
            parse::<CameraDescription>(early).unwrap_err().to_string(),
        ];
        for text in said {
            assert!(text.contains("earlier release"), "{text}");
            assert!(text.contains("qpgen render") && text.contains("qpgen dataset"));
        }
        let later = parse::<SampleMeta>(br#"{ "schema_version": 99 }"#);
        assert!(matches!(later, Err(ParseError::Later(99))));
        assert!(matches!(
            parse::<SampleMeta>(b"{}"),
            Err(ParseError::NoVersion)
        ));
        assert!(matches!(
            parse::<SampleMeta>(b"{"),
            Err(ParseError::Schema(_))
        ));
    }
}
