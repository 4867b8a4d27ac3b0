//! What makes the samples of a run what they are: the program's version, the configuration but the number of samples (a
//! dataset may grow), and the content of the files that it names. Runs of different identities never mix.

use std::collections::BTreeMap;
use std::path::Path;

use quadpixel::file;
use quadpixel::hash::json_hash;
use serde_json::Value;

use crate::config::DatasetConfig;

/// Endings of files that a configuration may name.
const ENDINGS: [&str; 18] = [
    "toml", "json", "zmx", "npz", "csv", "png", "jpg", "jpeg", "tif", "tiff", "exr", "hdr", "obj",
    "mtl", "gltf", "glb", "npy", "pfm",
];

/// Why a configuration has no identity.
#[derive(Debug, thiserror::Error)]
pub enum IdentityError {
    /// A configuration that cannot be written as JSON.
    #[error("configuration: {0}")]
    Json(#[from] serde_json::Error),
    /// A file that it names.
    #[error("{name}: cannot read: {cause}")]
    Input {
        /// The file.
        name: String,
        /// Why.
        cause: std::io::Error,
    },
}

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// The whole configuration, the number of samples included.
    pub configuration: Value,
    /// BLAKE3 hash of each file that it names.
    pub inputs: BTreeMap<String, String>,
}

impl Identity {
    /// That of a configuration.
    ///
    /// # Errors
    /// A file that it names and that cannot be read.
    pub fn new(config: &DatasetConfig) -> Result<Self, IdentityError> {
        let configuration = serde_json::to_value(config)?;
        let mut inputs = BTreeMap::new();
        hash_files(&configuration, &mut inputs)?;
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_string(),
            configuration,
            inputs,
        })
    }

    /// Hash that every sample bears.
    pub fn hash(&self) -> String {
        json_hash(&self.compared())
    }

    /// What differs, a line each: the place, what is there and what was asked for. Empty for the same identity.
    pub fn differences(&self, wanted: &Self) -> Vec<String> {
        let mut lines = Vec::new();
        compare("", &self.compared(), &wanted.compared(), &mut lines);
        lines
    }

    fn compared(&self) -> Value {
        let mut configuration = self.configuration.clone();
        if let Some(fields) = configuration.as_object_mut() {
            fields.remove("count");
        }
        serde_json::json!({ "version": self.version, "config": configuration, "inputs": self.inputs })
    }
}

/// Adds every text in `value` that names a file that is there.
fn hash_files(value: &Value, inputs: &mut BTreeMap<String, String>) -> Result<(), IdentityError> {
    match value {
        Value::String(name) => {
            let path = Path::new(name);
            let ending = path
                .extension()
                .and_then(|e| e.to_str())
                .unwrap_or_default();
            let known = ENDINGS.contains(&ending.to_ascii_lowercase().as_str());
            if known && path.is_file() && !inputs.contains_key(name) {
                let bytes = file::read(path).map_err(|e| IdentityError::Input {
                    name: name.clone(),
                    cause: e.cause,
                })?;
                inputs.insert(name.clone(), blake3::hash(&bytes).to_hex().to_string());
            }
            Ok(())
        }
        Value::Array(items) => items.iter().try_for_each(|item| hash_files(item, inputs)),
        Value::Object(fields) => fields
            .values()
            .try_for_each(|item| hash_files(item, inputs)),
        Value::Null | Value::Bool(_) | Value::Number(_) => Ok(()),
    }
}

fn compare(place: &str, there: &Value, wanted: &Value, lines: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (there, wanted) {
        let names: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
        for name in names {
            let place = match place {
                "" | "config" => name.clone(),
                place => format!("{place}.{name}"),
            };
            let field = |fields: &serde_json::Map<String, Value>| {
                fields.get(name).cloned().unwrap_or(Value::Null)
            };
            compare(&place, &field(a), &field(b), lines);
        }
    } else if there != wanted {
        let shown = |v: &Value| match v {
            Value::Null => "nothing".to_string(),
            other => other.to_string(),
        };
        lines.push(format!(
            "{place}: {} there, {} asked for",
            shown(there),
            shown(wanted)
        ));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::config::DEFAULT_TOML;

    fn identity(text: &str) -> Identity {
        Identity::new(&DatasetConfig::from_toml(text, "t").unwrap()).unwrap()
    }

    #[test]
    fn only_what_differs_is_told_and_the_count_is_no_part_of_it() {
        let a = identity(DEFAULT_TOML);
        let grown = identity(&DEFAULT_TOML.replace("count = 8", "count = 9"));
        assert_eq!(a.differences(&grown), Vec::<String>::new());
        assert_eq!(a.hash(), grown.hash());
        let other = DEFAULT_TOML.replace("seed = 1 ", "seed = 2 ");
        let other = identity(&other.replace("cards = { min = 0, ", "cards = { min = 1, "));
        let lines = a.differences(&other);
        assert_eq!(
            lines,
            [
                "scene.cards.min: 0.0 there, 1.0 asked for",
                "seed: 1 there, 2 asked for"
            ]
        );
        assert_ne!(a.hash(), other.hash());
    }

    #[test]
    fn a_file_that_changed_is_another_identity() {
        let folder = tempfile::tempdir().unwrap();
        let chart = folder.path().join("chart.png");
        let text = DEFAULT_TOML.replace("\"alphabet\"", &format!("{:?}", chart.to_str().unwrap()));
        std::fs::write(&chart, b"one").unwrap();
        let one = identity(&text);
        std::fs::write(&chart, b"two").unwrap();
        let two = identity(&text);
        assert!(one.differences(&two)[0].contains("chart.png"));
        assert_ne!(one.hash(), two.hash());
    }
}
