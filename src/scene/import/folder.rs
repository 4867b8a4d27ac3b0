//! Files beside an imported one: read within its folder only, and only up to a stated size.

use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::{ImportError, MAX_FILE_BYTES};
use crate::file::{self, FileError};
use crate::memory;

/// The folder of an imported file, or none (a file in memory may refer to no other).
#[derive(Clone, Debug, Default)]
pub(super) struct Folder(Option<PathBuf>);

/// What a URI stands for.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) enum Source<'a> {
    /// The base64 text of a `data:` URI.
    Data(&'a str),
    /// A file below the folder, by its one path without links.
    File(PathBuf),
}

impl Source<'_> {
    /// Its length, bytes, before it is read.
    pub fn length(&self) -> Result<u64, String> {
        match self {
            // Three bytes of four letters; padding is none.
            Self::Data(text) => Ok(text.trim_end_matches('=').len() as u64 * 3 / 4),
            Self::File(path) => match file::open(path).map(|file| file.metadata()) {
                Ok(Ok(data)) => Ok(data.len()),
                Ok(Err(cause)) => Err(format!("{}: {cause}", path.display())),
                Err(error) => Err(error.to_string()),
            },
        }
    }

    /// Its bytes.
    pub fn read(&self) -> Result<Vec<u8>, String> {
        match self {
            Self::Data(text) => base64(text).ok_or_else(|| "broken base64".to_string()),
            Self::File(path) => read_limited(path).map_err(|e| e.to_string()),
        }
    }
}

/// Reads a whole file of at most [`MAX_FILE_BYTES`]; its size is asked before the first byte is read.
pub(super) fn read_limited(path: &Path) -> Result<Vec<u8>, ImportError> {
    let failed = |cause| FileError::new(path, "read", cause);
    let file = file::open(path)?;
    let bytes = file.metadata().map_err(failed)?.len();
    let too_large = |bytes| ImportError::TooLarge {
        file: path.display().to_string(),
        bytes,
        limit: MAX_FILE_BYTES,
    };
    if bytes > MAX_FILE_BYTES {
        return Err(too_large(bytes));
    }
    memory::check(path.display().to_string(), bytes)?;
    let mut data = Vec::new();
    // It may grow while it is read.
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut data)
        .map_err(failed)?;
    if data.len() as u64 > MAX_FILE_BYTES {
        return Err(too_large(data.len() as u64));
    }
    Ok(data)
}

impl Folder {
    /// The folder of a file.
    pub fn of(file: &Path) -> Self {
        Self(Some(
            file.parent()
                .filter(|p| !p.as_os_str().is_empty())
                .unwrap_or(Path::new("."))
                .to_path_buf(),
        ))
    }

    /// What a URI stands for: a `data:` URI, or a file below the folder. `Err` says why not.
    pub fn source<'a>(&self, uri: &'a str) -> Result<Source<'a>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, text) = data
                .split_once(";base64,")
                .ok_or("a data: URI that is not base64")?;
            return Ok(Source::Data(text));
        }
        let name = percent_decoded(uri).ok_or("a broken % escape")?;
        Ok(Source::File(self.path_of(&name)?))
    }

    /// Reads what a URI stands for. `Err` says why not.
    pub fn read(&self, uri: &str) -> Result<Vec<u8>, String> {
        self.source(uri)?.read()
    }

    /// Reads a file below the folder by its relative name. `Err` says why not.
    pub fn read_name(&self, name: &str) -> Result<Vec<u8>, String> {
        read_limited(&self.path_of(name)?).map_err(|e| e.to_string())
    }

    /// The path of a relative name (either slash parts it), guarded twice: by its text, and by where links lead.
    fn path_of(&self, name: &str) -> Result<PathBuf, String> {
        let outside = || {
            format!(
                "{name:?} is not a file in the folder of the scene (no network, no absolute path, no ..)"
            )
        };
        let folder = self.0.as_ref().ok_or_else(outside)?;
        let relative = PathBuf::from(name.replace('\\', "/"));
        let normal = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
        if name.contains(':') || name.contains('\0') || !relative.components().all(normal) {
            return Err(outside());
        }
        let path = folder.join(relative);
        let unreadable = |e: std::io::Error| format!("{}: {e}", path.display());
        let real = fs::canonicalize(&path).map_err(unreadable)?;
        let real_folder = fs::canonicalize(folder).map_err(unreadable)?;
        if real.starts_with(&real_folder) {
            Ok(real)
        } else {
            Err(outside())
        }
    }
}

/// RFC 3986 escapes; `None` where one is broken or the result is no UTF-8.
fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(b) = rest.next() {
        if b != b'%' {
            bytes.push(b);
            continue;
        }
        let digit = |b: Option<u8>| (b? as char).to_digit(16);
        let (high, low) = (digit(rest.next())?, digit(rest.next())?);
        bytes.push((16 * high + low) as u8);
    }
    String::from_utf8(bytes).ok()
}

/// RFC 4648 base64 with or without padding.
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for b in text.trim_end_matches('=').bytes() {
        let value = match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    // One letter alone holds no byte.
    (count < 6).then_some(out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn base64_and_escapes_follow_the_rfcs() {
        // Test vectors of RFC 4648, section 10.
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(coded).unwrap(), plain.as_bytes());
        }
        assert!(base64("Z").is_none() && base64("Zm9 v").is_none());
        assert_eq!(percent_decoded("a%20b").unwrap(), "a b");
        for broken in ["%", "%2", "%zz", "%ff"] {
            assert!(percent_decoded(broken).is_none(), "{broken}");
        }
    }

    #[test]
    fn no_name_leads_out_of_the_folder() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("inner");
        fs::create_dir(&inner).unwrap();
        fs::write(outer.path().join("secret"), b"x").unwrap();
        fs::write(inner.join("a b.bin"), b"yes").unwrap();
        let folder = Folder::of(&inner.join("scene.gltf"));
        assert_eq!(folder.read("a%20b.bin").unwrap(), b"yes");
        assert_eq!(folder.read("./a b.bin").unwrap(), b"yes");
        let absolute = outer.path().join("secret").display().to_string();
        for bad in [
            "../secret",
            "..%2Fsecret",
            "..\\secret",
            "%2e%2e/secret",
            "file:///etc/passwd",
            "http://example.com/a.bin",
            "C:\\a",
            "a\0b",
            "",
            "missing.bin",
            absolute.as_str(),
        ] {
            assert!(folder.read(bad).is_err(), "{bad:?}");
        }
        assert!(Folder::default().read("a b.bin").is_err());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.path().join("secret"), inner.join("link")).unwrap();
            assert!(folder.read("link").is_err());
        }
    }
}
