//! Lines with the hash of what they say: a damaged one is known.

/// What a sealed line begins with, before the hash and after it.
const SEAL: [&str; 2] = ["{\"blake3\":\"", "\","];

fn hash(key: &str, result: &str) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(key.as_bytes());
    hash.update(b"\n");
    hash.update(result.as_bytes());
    hash.finalize().to_hex().to_string()
}

/// `{…}` of a result with its hash as the first field.
pub(super) fn sealed(key: &str, result: &str) -> String {
    let fields = result.strip_prefix('{').unwrap_or(result);
    format!("{}{}{}{fields}", SEAL[0], hash(key, result), SEAL[1])
}

/// The result in a line whose hash is that of its content.
pub(super) fn unsealed(line: &str, key: &str) -> Option<String> {
    let (stated, fields) = line.strip_prefix(SEAL[0])?.split_once(SEAL[1])?;
    let result = format!("{{{fields}");
    (hash(key, &result) == stated).then_some(result)
}
