//! The end of a run: split lists, gallery, data card, and `dataset.json`, which is written last and makes the dataset
//! whole.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use quadpixel::file::{self, FileError};
use quadpixel_datasets::{
    DatasetManifest, FileEntry, SCHEMA_VERSION, Split, Tool, conventions, paths, units,
};

use super::error::WriteError;
use super::json::{VERSION, json};
use super::survey::{Survey, survey};
use crate::card::{self, gallery};

/// What a dataset is made of.
#[derive(Clone, Debug)]
pub struct Dataset<'a> {
    /// The run's seed.
    pub seed: u64,
    /// The whole configuration.
    pub configuration: serde_json::Value,
    /// Hash of each file that the configuration names.
    pub inputs: BTreeMap<String, String>,
    /// Licence of the data, SPDX.
    pub licence: &'a str,
    /// Number of samples.
    pub count: u32,
}

/// Writes split lists, gallery, data card and manifest below `root`, which holds all samples, and removes what an
/// interrupted run left in `samples/`. Lengths and hashes are those that the samples were written with: a file that
/// changed since is found by the check.
///
/// # Errors
/// A description that cannot be read, something in `samples/` that is no sample of the dataset, or the disk.
pub fn finish_dataset(root: &Path, dataset: &Dataset<'_>) -> Result<DatasetManifest, WriteError> {
    let names: Vec<String> = (0..dataset.count)
        .map(paths::sample_name)
        .collect::<Result<_, _>>()?;
    clear_samples(&root.join(paths::SAMPLES), &names)?;
    clear_half_made(root)?;
    let survey = survey(root, &names)?;
    let mut files = write_pages(root, &survey, dataset.licence)?;
    let splits = root.join(paths::SPLITS);
    file::remove(&splits)?;
    file::own_folder(&splits)?;
    for split in Split::ALL {
        let of_split = survey.entries.iter().filter(|entry| entry.split == split);
        let list: String = of_split.map(|entry| format!("{}\n", entry.id)).collect();
        let path = paths::split_list(split);
        file::write_aside(&root.join(&path), list.as_bytes())?;
        files.push(FileEntry::new(&path, list.as_bytes()));
    }
    files.extend(survey.files);
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let manifest = DatasetManifest {
        schema_version: SCHEMA_VERSION,
        tool: Tool {
            name: "qpgen".to_string(),
            version: VERSION.to_string(),
        },
        seed: dataset.seed,
        configuration: dataset.configuration.clone(),
        inputs: dataset.inputs.clone(),
        units: units(),
        conventions: conventions(),
        licence: dataset.licence.to_string(),
        samples: survey.entries,
        files,
    };
    write_manifest(root, &manifest)?;
    Ok(manifest)
}

/// Writes the gallery and the data card again, from the descriptions on disk, and brings their entries in `manifest` up
/// to date; all other entries stay, so that damage to a sample is still found by the check. Without a manifest, the run
/// is not at its end: the pages show the samples that there are.
///
/// # Errors
/// A description that cannot be read, or the disk.
pub fn rebuild_pages(
    root: &Path,
    manifest: Option<DatasetManifest>,
    licence: &str,
) -> Result<usize, WriteError> {
    let names = match &manifest {
        Some(manifest) => manifest.samples.iter().map(|s| s.id.clone()).collect(),
        None => finished(&root.join(paths::SAMPLES))?,
    };
    let survey = survey(root, &names)?;
    let pages = write_pages(root, &survey, licence)?;
    if let Some(mut manifest) = manifest {
        let page =
            |path: &str| !path.starts_with(paths::SAMPLES) && !path.starts_with(paths::SPLITS);
        manifest.files.retain(|entry| !page(&entry.path));
        manifest.files.extend(pages);
        manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        write_manifest(root, &manifest)?;
    }
    Ok(names.len())
}

fn write_manifest(root: &Path, manifest: &DatasetManifest) -> Result<(), WriteError> {
    let path = root.join(paths::DATASET);
    Ok(file::write_aside(&path, &json(&path, manifest)?)?)
}

/// Gallery and data card.
fn write_pages(root: &Path, survey: &Survey, licence: &str) -> Result<Vec<FileEntry>, WriteError> {
    let mut pages = vec![(
        paths::INDEX.to_string(),
        gallery::page(&survey.entries, &survey.shown),
    )];
    pages.extend(card::pages(
        &survey.census,
        &survey.entries,
        &survey.files,
        licence,
    ));
    // Plots of an earlier, smaller dataset that this one does not have.
    file::remove(&root.join(paths::PLOTS))?;
    file::own_folder(&root.join(paths::PLOTS))?;
    let mut files = Vec::new();
    for (path, text) in pages {
        file::write_aside(&root.join(&path), text.as_bytes())?;
        files.push(FileEntry::new(&path, text.as_bytes()));
    }
    Ok(files)
}

/// Names of the samples that are whole.
fn finished(samples: &Path) -> Result<Vec<String>, WriteError> {
    let error = |cause| FileError::new(samples, "read", cause);
    let mut names = Vec::new();
    for entry in fs::read_dir(samples).map_err(error)? {
        let entry = entry.map_err(error)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let numbered = name.len() == 6 && name.bytes().all(|b| b.is_ascii_digit());
        if numbered && entry.path().join(paths::META).is_file() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Removes files that a killed run was about to name.
fn clear_half_made(root: &Path) -> Result<(), WriteError> {
    let error = |cause| FileError::new(root, "read", cause);
    for entry in fs::read_dir(root).map_err(error)? {
        let entry = entry.map_err(error)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let stem = name.split_once(".tmp-").map(|(stem, _)| stem);
        let ours = [paths::DATASET, paths::INDEX, paths::CARD, paths::RUN];
        if stem.is_some_and(|stem| ours.contains(&stem)) {
            file::remove(&entry.path())?;
        }
    }
    Ok(())
}

/// Removes unfinished samples; a finished one that is not of this dataset is an error.
fn clear_samples(samples: &Path, names: &[String]) -> Result<(), WriteError> {
    let error = |cause| FileError::new(samples, "read", cause);
    file::own_folder(samples)?;
    for entry in fs::read_dir(samples).map_err(error)? {
        let entry = entry.map_err(error)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(".tmp-") {
            file::remove(&entry.path())?;
        } else if names.binary_search(&name).is_err() {
            let (path, what) = (
                entry.path(),
                "is not a sample of this dataset: choose another output folder".into(),
            );
            return Err(WriteError::Occupied { path, what });
        }
    }
    Ok(())
}
