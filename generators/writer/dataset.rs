//! The end of a run: split lists, gallery, data card, and `dataset.json`, which is written last and makes the dataset
//! whole.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use quadpixel::file::{self, FileError};
use quadpixel_datasets::{DatasetManifest, SCHEMA_VERSION, Split, Tool, conventions, paths, units};

use super::error::WriteError;
use super::is_half_made_sample;
use super::json::{VERSION, json};
use super::pages::{Foreign, Pages};
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
pub fn finish_dataset(
    root: &Path,
    dataset: &Dataset<'_>,
    foreign: Foreign,
) -> Result<DatasetManifest, WriteError> {
    let names: Vec<String> = (0..dataset.count)
        .map(paths::sample_name)
        .collect::<Result<_, _>>()?;
    clear_samples(&root.join(paths::SAMPLES), &names)?;
    let survey = survey(root, &names)?;
    let mut own = Pages::open(root, foreign)?;
    own.clear_half_made(&[paths::RUN])?;
    let mut files =
        own.write(&[pages(&survey, dataset.licence)?, split_lists(&survey)].concat())?;
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
    own.end(&manifest)?;
    Ok(manifest)
}

/// Writes the gallery and the data card again, from the descriptions on disk, and brings their entries in the manifest
/// up to date; all other entries stay, so that damage to a sample is still found by the check. While a run is not at
/// its end, the pages show the samples that there are, and `licence`.
///
/// # Errors
/// A description that cannot be read, a file of somebody else in the place of a page, or the disk.
pub fn rebuild_pages(root: &Path, licence: &str, foreign: Foreign) -> Result<usize, WriteError> {
    // Locked before it is looked at whether the run is at its end.
    let mut own = Pages::open(root, foreign)?;
    let path = root.join(paths::DATASET);
    let finished = path.is_file() && !root.join(paths::RUN).is_file();
    let manifest: Option<DatasetManifest> = match finished {
        true => Some(
            quadpixel_datasets::read_description(&file::read(&path)?).map_err(|e| {
                WriteError::Occupied {
                    path: path.clone(),
                    what: e.to_string(),
                }
            })?,
        ),
        false => None,
    };
    let names = match &manifest {
        Some(manifest) => manifest.samples.iter().map(|s| s.id.clone()).collect(),
        None => finished_samples(&root.join(paths::SAMPLES))?,
    };
    let survey = survey(root, &names)?;
    let licence = manifest.as_ref().map_or(licence, |m| m.licence.as_str());
    let written = own.write(&pages(&survey, licence)?)?;
    if let Some(mut manifest) = manifest {
        own.clear_half_made(&[])?;
        let page =
            |path: &str| !path.starts_with(paths::SAMPLES) && !path.starts_with(paths::SPLITS);
        let before = manifest.files.clone();
        manifest.files.retain(|entry| !page(&entry.path));
        manifest.files.extend(written);
        manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        if manifest.files != before {
            write_manifest(root, &manifest)?;
        }
        own.end(&manifest)?;
    }
    Ok(names.len())
}

fn write_manifest(root: &Path, manifest: &DatasetManifest) -> Result<(), WriteError> {
    let path = root.join(paths::DATASET);
    Ok(file::write_aside(&path, &json(&path, manifest)?)?)
}

/// Gallery, data card and plots: path and content.
fn pages(survey: &Survey, licence: &str) -> Result<Vec<(String, Vec<u8>)>, WriteError> {
    let gallery = gallery::page(&survey.entries, &survey.shown)?;
    let card = card::pages(&survey.census, &survey.entries, &survey.files, licence);
    let pages = std::iter::once((paths::INDEX.to_string(), gallery)).chain(card);
    Ok(pages
        .map(|(path, text)| (path, text.into_bytes()))
        .collect())
}

/// The names of the samples of each split: path and content.
fn split_lists(survey: &Survey) -> Vec<(String, Vec<u8>)> {
    let list = |split: Split| {
        let of_split = survey.entries.iter().filter(|entry| entry.split == split);
        let list: String = of_split.map(|entry| format!("{}\n", entry.id)).collect();
        (paths::split_list(split), list.into_bytes())
    };
    Split::ALL.map(list).to_vec()
}

/// Names of the samples that are whole.
fn finished_samples(samples: &Path) -> Result<Vec<String>, WriteError> {
    let error = |cause| FileError::new(samples, "read", cause);
    let mut names = Vec::new();
    if !samples.is_dir() {
        return Ok(names); // a run that has just begun
    }
    for entry in fs::read_dir(samples).map_err(error)? {
        let entry = entry.map_err(error)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if paths::is_sample_name(&name) && entry.path().join(paths::META).is_file() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Removes unfinished samples; a finished one that is not of this dataset is an error.
fn clear_samples(samples: &Path, names: &[String]) -> Result<(), WriteError> {
    let error = |cause| FileError::new(samples, "read", cause);
    file::own_folder(samples)?;
    for entry in fs::read_dir(samples).map_err(error)? {
        let entry = entry.map_err(error)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if is_half_made_sample(&name) {
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
