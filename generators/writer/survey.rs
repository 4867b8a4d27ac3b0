//! One pass over the samples on disk, one description in memory at a time: what the lists, the gallery and the data
//! card need.

use std::path::Path;

use quadpixel::file;
use quadpixel_datasets::{FileEntry, SampleEntry, SampleMeta, Split, paths, split_scenes};

use super::error::WriteError;
use crate::card::Census;

/// Most samples that the gallery shows; of more, every k-th.
const SHOWN: usize = 240;

/// What the samples are, all together.
pub(super) struct Survey {
    /// In the order of their names.
    pub entries: Vec<SampleEntry>,
    /// Their files, below the dataset's folder.
    pub files: Vec<FileEntry>,
    /// For the gallery: places in `entries`, and descriptions.
    pub shown: Vec<(usize, SampleMeta)>,
    /// For the data card.
    pub census: Census,
}

/// Reads the descriptions of the samples of these names (in order) below `root`.
pub(super) fn survey(root: &Path, names: &[String]) -> Result<Survey, WriteError> {
    let every = names.len().div_ceil(SHOWN).max(1);
    let mut survey = Survey {
        entries: Vec::with_capacity(names.len()),
        files: Vec::new(),
        shown: Vec::new(),
        census: Census::default(),
    };
    for (place, name) in names.iter().enumerate() {
        let folder = format!("{}/{name}", paths::SAMPLES);
        let path = root.join(&folder).join(paths::META);
        if !path.symlink_metadata().is_ok_and(|data| data.is_file()) {
            let what = "is a link, or not there; allowed: a sample's description".into();
            return Err(WriteError::Occupied { path, what });
        }
        let bytes = file::read(&path)?;
        let meta: SampleMeta =
            quadpixel_datasets::read_description(&bytes).map_err(|e| WriteError::Occupied {
                path: path.clone(),
                what: format!("is no description of a sample: {e}"),
            })?;
        survey
            .files
            .push(FileEntry::new(&format!("{folder}/{}", paths::META), &bytes));
        survey
            .files
            .extend(meta.contents.iter().map(|entry| FileEntry {
                path: format!("{folder}/{}", entry.path),
                ..entry.clone()
            }));
        survey.entries.push(SampleEntry {
            id: name.clone(),
            scene: meta.scene.id.clone(),
            split: Split::Train,
        });
        survey.census.count(&meta);
        if place.is_multiple_of(every) {
            survey.shown.push((place, meta));
        }
    }
    let splits = split_scenes(survey.entries.iter().map(|entry| entry.scene.as_str()));
    for entry in &mut survey.entries {
        entry.split = splits.get(&entry.scene).copied().unwrap_or(Split::Train);
    }
    Ok(survey)
}
