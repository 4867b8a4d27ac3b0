//! Where things lie below the dataset's folder, and the guard that keeps names from leading out of it.

use std::path::{Component, Path, PathBuf};

use crate::split::Split;

/// The manifest.
pub const DATASET: &str = "dataset.json";
/// The gallery.
pub const INDEX: &str = "index.html";
/// The folder of the samples.
pub const SAMPLES: &str = "samples";
/// The folder of the split lists.
pub const SPLITS: &str = "splits";
/// A sample's description.
pub const META: &str = "meta.json";
/// What the sample's camera knows of itself.
pub const CAMERA: &str = "camera.json";
/// A sample's contact sheet.
pub const PREVIEW: &str = "preview.jpg";

/// The data card.
pub const CARD: &str = "README.md";
/// The folder of the data card's plots.
pub const PLOTS: &str = "plots";
/// What an unfinished run was asked for; gone when the dataset is whole.
pub const RUN: &str = "run.json";

/// Pages that no `dataset.json` lists yet, by path and hash; gone when one does.
pub const PAGES: &str = "pages.json";

/// Most samples that a dataset's six digits can name.
pub const MAX_SAMPLES: u32 = 1_000_000;

/// A name or path that is not allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// Not a plain file name.
    #[error(
        "name {0:?}: allowed are 1 to 100 of the characters A-Z a-z 0-9 . _ - , not beginning with a dot"
    )]
    Name(String),
    /// Not a sample's name.
    #[error("sample {0:?}: a sample's name is of six digits")]
    Sample(String),
    /// Leads out of the dataset, or is not relative.
    #[error("path {0:?} does not lie below the dataset's folder")]
    Outside(String),
    /// More samples than six digits can name.
    #[error("sample {0}: a dataset names at most 1000000 samples, 000000 to 999999")]
    SampleNumber(u32),
}

/// The six-digit name of a sample.
pub fn sample_name(index: u32) -> Result<String, PathError> {
    if index < MAX_SAMPLES {
        Ok(format!("{index:06}"))
    } else {
        Err(PathError::SampleNumber(index))
    }
}

/// Whether that is how a sample is named: by six digits.
pub fn is_sample_name(name: &str) -> bool {
    name.len() == 6 && name.bytes().all(|b| b.is_ascii_digit())
}

/// The folder of part `number` (from 1) of `of` of a dataset that is made in parts.
pub fn shard_folder(number: usize, count: usize) -> String {
    format!("shard-{number}-of-{count}")
}

/// Number and count of a part by its folder's name.
pub fn parse_shard_folder(name: &str) -> Option<(usize, usize)> {
    let (number, count) = name.strip_prefix("shard-")?.split_once("-of-")?;
    let (number, count) = (number.parse().ok()?, count.parse().ok()?);
    // Only the spelling that this program writes.
    (shard_folder(number, count) == name).then_some((number, count))
}

/// The list of a split, below the dataset's folder.
pub fn split_list(split: Split) -> String {
    format!("{SPLITS}/{}.txt", split.name())
}

/// `name` if it is a plain file name that means the same on every system.
pub fn checked_name(name: &str) -> Result<&str, PathError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    if (1..=100).contains(&name.len()) && !name.starts_with('.') && name.chars().all(plain) {
        Ok(name)
    } else {
        Err(PathError::Name(name.to_string()))
    }
}

/// `name` if it is a sample's.
pub fn checked_sample_name(name: &str) -> Result<&str, PathError> {
    match is_sample_name(name) {
        true => Ok(name),
        false => Err(PathError::Sample(name.to_string())),
    }
}

/// `path` if it lies below the dataset's folder: plain names parted by `/`.
pub fn checked_path(path: &str) -> Result<&str, PathError> {
    match path.split('/').all(|part| checked_name(part).is_ok()) {
        true => Ok(path),
        false => Err(PathError::Outside(path.to_string())),
    }
}

/// A plain file name made of any text: other characters become `_`, a leading dot is replaced, the length is cut
/// to 100.
pub fn sanitised(text: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-') {
            c
        } else {
            '_'
        }
    };
    let mut name: String = text.chars().take(100).map(plain).collect();
    if name.is_empty() || name.starts_with('.') {
        name.replace_range(..name.len().min(1), "_");
    }
    name
}

/// `root/relative`, where every part of `relative` (parted by `/`) is a plain file name.
pub fn inside(root: &Path, relative: &str) -> Result<PathBuf, PathError> {
    let outside = || PathError::Outside(relative.to_string());
    let mut path = root.to_path_buf();
    for part in relative.split('/') {
        path.push(checked_name(part).map_err(|_| outside())?);
    }
    let normal = |part: Component<'_>| matches!(part, Component::Normal(_));
    let below = path.strip_prefix(root).map_err(|_| outside())?;
    if below.components().all(normal) {
        Ok(path)
    } else {
        Err(outside())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_dataset() {
        let root = Path::new("/data/set");
        for bad in [
            "",
            ".",
            "..",
            "../x",
            "a/../../x",
            "/etc/passwd",
            "a//b",
            "a/",
            "C:\\x",
            "a\\..\\b",
            ".hidden",
            "a/.b",
            "a\0b",
            "é",
            "a b",
            "~",
        ] {
            assert!(inside(root, bad).is_err(), "{bad:?}");
        }
        assert_eq!(
            inside(root, "samples/000001/raw.png"),
            Ok(PathBuf::from("/data/set/samples/000001/raw.png"))
        );
    }

    #[test]
    fn any_text_becomes_an_allowed_name() {
        let long = "x".repeat(500);
        for text in [
            "",
            ".",
            "..",
            "../../etc",
            "a b/ç",
            "日本",
            "ok-1.2_3",
            &long,
            "\0",
        ] {
            let name = sanitised(text);
            assert_eq!(checked_name(&name), Ok(name.as_str()), "{text:?}");
        }
        assert_eq!(sanitised("ok-1.2_3"), "ok-1.2_3");
    }

    #[test]
    fn sample_names_have_six_digits() {
        assert_eq!(sample_name(7).as_deref(), Ok("000007"));
        assert_eq!(sample_name(999_999).as_deref(), Ok("999999"));
        assert!(sample_name(1_000_000).is_err());
    }

    #[test]
    fn a_shard_is_known_by_its_folder() {
        assert_eq!(parse_shard_folder(&shard_folder(2, 4)), Some((2, 4)));
        for other in [
            "shard-02-of-4",
            "shard-2",
            "2-of-4",
            "shard--1-of-4",
            "samples",
        ] {
            assert_eq!(parse_shard_folder(other), None, "{other}");
        }
    }
}
