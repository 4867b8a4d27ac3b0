//! Hashes of settings: the same hash means the same settings, whatever order their fields were written in.
//!
//! A value is hashed as its canonical JSON: keys sorted, no spaces, numbers in the shortest form that reads back to the
//! bit.

use serde::Serialize;
use serde_json::Value;

/// JSON of a value with sorted keys and no spaces.
///
/// # Errors
/// A value that JSON has no form for, such as a map whose keys are no text.
pub fn canonical_json(value: &impl Serialize) -> Result<String, serde_json::Error> {
    let mut text = String::new();
    write(&serde_json::to_value(value)?, &mut text);
    Ok(text)
}

/// BLAKE3 hash, in hexadecimal digits, of [`canonical_json`].
///
/// # Errors
/// As there.
pub fn settings_hash(value: &impl Serialize) -> Result<String, serde_json::Error> {
    Ok(json_hash(&serde_json::to_value(value)?))
}

/// BLAKE3 hash, in hexadecimal digits, of a value that is JSON already.
pub fn json_hash(value: &Value) -> String {
    let mut text = String::new();
    write(value, &mut text);
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

/// BLAKE3 hash of the content of a file of arrays, bound to what it says of itself.
pub(crate) struct ContentHash(blake3::Hasher);

impl ContentHash {
    /// Begins with the text that says what the file is.
    pub fn new(meta: &[u8]) -> Self {
        let mut hash = blake3::Hasher::new();
        hash.update(&(meta.len() as u64).to_le_bytes());
        hash.update(meta);
        Self(hash)
    }

    /// Adds an array: its length and its numbers.
    pub fn array<T: Copy, const N: usize>(mut self, values: &[T], bytes: fn(T) -> [u8; N]) -> Self {
        self.0.update(&(values.len() as u64).to_le_bytes());
        for part in values.chunks(4096) {
            let part: Vec<u8> = part.iter().flat_map(|&value| bytes(value)).collect();
            self.0.update(&part);
        }
        self
    }

    /// 64 hexadecimal digits.
    pub fn hex(&self) -> String {
        self.0.finalize().to_hex().to_string()
    }
}

// Sorted here and not by serde_json's map, whose order hangs on a feature that any crate may turn on.
fn write(value: &Value, text: &mut String) {
    match value {
        Value::Object(fields) => {
            let mut fields: Vec<_> = fields.iter().collect();
            fields.sort_by_key(|(name, _)| *name);
            text.push('{');
            for (i, (name, field)) in fields.into_iter().enumerate() {
                if i > 0 {
                    text.push(',');
                }
                text.push_str(&Value::from(name.as_str()).to_string());
                text.push(':');
                write(field, text);
            }
            text.push('}');
        }
        Value::Array(items) => {
            text.push('[');
            for (i, item) in items.iter().enumerate() {
                if i > 0 {
                    text.push(',');
                }
                write(item, text);
            }
            text.push(']');
        }
        plain => text.push_str(&plain.to_string()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn the_order_of_fields_does_not_matter_and_every_number_does() {
        #[derive(Serialize)]
        struct OneOrder {
            b: f64,
            a: Vec<Option<&'static str>>,
        }
        #[derive(Serialize)]
        struct OtherOrder {
            a: Vec<Option<&'static str>>,
            b: f64,
        }
        let a = vec![Some("\"x\""), None];
        let one = OneOrder {
            b: 0.1,
            a: a.clone(),
        };
        let other = OtherOrder {
            a: a.clone(),
            b: 0.1,
        };
        assert_eq!(
            canonical_json(&one).unwrap(),
            r#"{"a":["\"x\"",null],"b":0.1}"#
        );
        assert_eq!(settings_hash(&one).unwrap(), settings_hash(&other).unwrap());
        let next = OneOrder {
            b: 0.1f64.next_up(),
            a,
        };
        assert_ne!(settings_hash(&one).unwrap(), settings_hash(&next).unwrap());
    }
}
