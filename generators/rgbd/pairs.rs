//! Pairs of picture and depth: two files, or two folders whose files have the same stems.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::error::PictureError;

/// Endings of pictures and of depths.
const IMAGES: [&str; 8] = ["png", "jpg", "jpeg", "tif", "tiff", "exr", "pfm", "npy"];

/// A picture and its depth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The picture.
    pub image: PathBuf,
    /// Its depth.
    pub depth: PathBuf,
}

/// The pairs, in the order of their stems, and what has no other half: a line each.
///
/// # Errors
/// A folder that cannot be read, one that holds a stem twice, no pair at all.
pub fn pairs(image: &Path, depth: &Path) -> Result<(Vec<Pair>, Vec<String>), PictureError> {
    match (image.is_dir(), depth.is_dir()) {
        (false, false) => Ok((
            vec![Pair {
                image: image.into(),
                depth: depth.into(),
            }],
            Vec::new(),
        )),
        (true, true) => in_folders(image, depth),
        (images, _) => {
            let (folder, file) = if images {
                (image, depth)
            } else {
                (depth, image)
            };
            Err(PictureError::Pairs(format!(
                "{} is a folder and {} is none; allowed: two files or two folders",
                folder.display(),
                file.display()
            )))
        }
    }
}

fn in_folders(image: &Path, depth: &Path) -> Result<(Vec<Pair>, Vec<String>), PictureError> {
    let images = by_stem(image)?;
    let mut depths = by_stem(depth)?;
    let (mut pairs, mut alone) = (Vec::new(), Vec::new());
    for (stem, image) in images {
        match depths.remove(&stem) {
            Some(depth) => pairs.push(Pair { image, depth }),
            None => alone.push(format!(
                "{}: no depth of this stem in {}",
                image.display(),
                depth.display()
            )),
        }
    }
    let lonely = depths.values().map(|d| {
        format!(
            "{}: no picture of this stem in {}",
            d.display(),
            image.display()
        )
    });
    alone.extend(lonely);
    match pairs.is_empty() {
        true => Err(PictureError::Pairs(format!(
            "{} and {}: no file of one has the stem of a file of the other; allowed: NAME.png with NAME.exr and the like",
            image.display(),
            depth.display()
        ))),
        false => Ok((pairs, alone)),
    }
}

fn by_stem(folder: &Path) -> Result<BTreeMap<OsString, PathBuf>, PictureError> {
    let failed = |what: String| PictureError::File {
        path: folder.to_owned(),
        what,
    };
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(|e| failed(format!("cannot be read: {e}")))? {
        let path = entry
            .map_err(|e| failed(format!("cannot be read: {e}")))?
            .path();
        let Some(stem) = path.file_stem() else {
            continue;
        };
        if !is_picture(&path) {
            continue;
        }
        if let Some(other) = files.insert(stem.to_owned(), path.clone()) {
            let (a, b) = (other.display(), path.display());
            return Err(PictureError::Pairs(format!(
                "{a} and {b} have one stem; allowed: one file of each stem"
            )));
        }
    }
    Ok(files)
}

/// Whether a file has an ending of a picture or a depth.
pub(super) fn is_picture(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str());
    ending.is_some_and(|e| IMAGES.contains(&e.to_ascii_lowercase().as_str()))
}
