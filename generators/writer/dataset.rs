//! The end of a run: split lists, gallery, and `dataset.json`, which is written last and makes the dataset whole.

use std::fs;
use std::path::Path;

use datasets_spec::{
    DatasetManifest, FileEntry, SCHEMA_VERSION, SampleEntry, Split, Tool, conventions, paths,
    split_scenes, units,
};
use quadpixel::file::{self, FileError};

use super::{VERSION, WriteError, WrittenSample, json};
use crate::gallery;

/// What a dataset is made of.
#[derive(Clone, Debug)]
pub struct Dataset<'a> {
    /// The run's seed.
    pub seed: u64,
    /// The whole configuration.
    pub configuration: serde_json::Value,
    /// Licence of the data, SPDX.
    pub licence: &'a str,
    /// All samples, in any order.
    pub samples: &'a [WrittenSample],
}

/// Writes split lists, gallery and manifest below `root`, and removes what an interrupted run left in `samples/`.
pub fn finish_dataset(root: &Path, dataset: &Dataset<'_>) -> Result<DatasetManifest, WriteError> {
    let mut samples: Vec<&WrittenSample> = dataset.samples.iter().collect();
    samples.sort_by(|a, b| a.meta.id.cmp(&b.meta.id));
    let names: Vec<&str> = samples
        .iter()
        .map(|sample| sample.meta.id.as_str())
        .collect();
    clear_samples(&root.join(paths::SAMPLES), &names)?;
    let splits = split_scenes(samples.iter().map(|sample| sample.meta.scene.id.as_str()));
    let entry = |sample: &&WrittenSample| SampleEntry {
        id: sample.meta.id.clone(),
        scene: sample.meta.scene.id.clone(),
        split: splits
            .get(&sample.meta.scene.id)
            .copied()
            .unwrap_or(Split::Train),
    };
    let entries: Vec<SampleEntry> = samples.iter().map(entry).collect();
    let mut files: Vec<FileEntry> = samples.iter().flat_map(|s| s.files.clone()).collect();
    file::create_folder(&root.join(paths::SPLITS))?;
    for split in Split::ALL {
        let own = entries.iter().filter(|entry| entry.split == split);
        let list: String = own.map(|entry| format!("{}\n", entry.id)).collect();
        let path = paths::split_list(split);
        file::write_aside(&root.join(&path), list.as_bytes())?;
        files.push(FileEntry::of(&path, list.as_bytes()));
    }
    let metas: Vec<_> = samples.iter().map(|sample| &sample.meta).collect();
    let page = gallery::page(&entries, &metas);
    file::write_aside(&root.join(paths::INDEX), page.as_bytes())?;
    files.push(FileEntry::of(paths::INDEX, page.as_bytes()));
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let manifest = DatasetManifest {
        schema_version: SCHEMA_VERSION,
        tool: Tool {
            name: "qpgen".to_string(),
            version: VERSION.to_string(),
        },
        seed: dataset.seed,
        configuration: dataset.configuration.clone(),
        units: units(),
        conventions: conventions(),
        licence: dataset.licence.to_string(),
        samples: entries,
        files,
    };
    let path = root.join(paths::DATASET);
    file::write_aside(&path, &json(&path, &manifest)?)?;
    Ok(manifest)
}

/// Removes unfinished samples; a finished one that is not of this dataset is an error.
fn clear_samples(samples: &Path, names: &[&str]) -> Result<(), WriteError> {
    let error = |cause| FileError::new(samples, "read", cause);
    file::create_folder(samples)?;
    for entry in fs::read_dir(samples).map_err(error)? {
        let entry = entry.map_err(error)?;
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if name.starts_with(".tmp-") {
            fs::remove_dir_all(&path).map_err(|cause| FileError::new(&path, "remove", cause))?;
        } else if !names.contains(&name.as_ref()) {
            let what = "is not a sample of this dataset: choose another output folder".into();
            return Err(WriteError::Occupied { path, what });
        }
    }
    Ok(())
}
