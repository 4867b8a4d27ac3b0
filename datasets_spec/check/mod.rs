//! Checks a whole dataset: manifest, hashes, splits, and every sample. Nothing here panics on any content of a file,
//! and nothing is read outside the dataset's folder.

mod camera_pictures;
mod mosaic;
mod pixels;
mod report;
mod sample;

pub use report::{Finding, Progress, Report};

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use self::report::{Contents, Depth};
use crate::manifest::{DatasetManifest, FileEntry, SampleEntry};
use crate::split::Split;
use crate::{file, parse, paths};

/// What `dataset.json` lists below one folder: names there, and entries.
type Listed<'a> = Vec<(&'a str, &'a FileEntry)>;

/// The largest `dataset.json`: of a million samples of 20 files each, with room to spare.
const LARGEST_DESCRIPTION: u64 = 8 << 30;

/// Reads the dataset at `root` on all threads, one sample per thread, and lists everything that breaks SPEC.md in the
/// order of the samples; `progress` is called after each file.
pub fn check_dataset(root: &Path, progress: &mut (dyn FnMut(Progress) + Send)) -> Report {
    check_to(Depth::Pixels, root, progress)
}

/// As [`check_dataset`], without a look at the pixels: the files that `dataset.json` lists and no other are there, with
/// their lengths and hashes, and the descriptions and split lists are in order. As fast as the disk.
pub fn check_hashes(root: &Path, progress: &mut (dyn FnMut(Progress) + Send)) -> Report {
    check_to(Depth::Hashes, root, progress)
}

fn check_to(depth: Depth, root: &Path, progress: &mut (dyn FnMut(Progress) + Send)) -> Report {
    let mut report = Report::default();
    let Some(manifest) = read_manifest(root, &mut report) else {
        return report;
    };
    report.samples = manifest.samples.len();
    let pages = pages_being_written(root, &mut report);
    check_tree(root, &manifest, &pages, &mut report);

    // Files by folder, so that one sample's content is in memory at a time.
    let mut folders: BTreeMap<&str, Listed<'_>> = BTreeMap::new();
    for entry in &manifest.files {
        let (folder, name) = entry.path.rsplit_once('/').unwrap_or(("", &entry.path));
        folders.entry(folder).or_default().push((name, entry));
    }
    let counted = Mutex::new((0, progress));
    let total = manifest.files.len();
    let load = |folder: &str, report: &mut Report| -> Contents {
        let mut contents = Contents::new();
        for (name, entry) in folders.get(folder).into_iter().flatten() {
            let mut own = Report::default();
            let content = read_entry(root, entry, &mut own);
            let mut others = pages.iter().filter(|page| page.path == entry.path);
            let mut is_other =
                || others.any(|page| read_entry(root, page, &mut Report::default()).is_some());
            if content.is_some() || !is_other() {
                report.merge(own);
            }
            contents.insert((*name).to_string(), content);
            // A poisoned lock only means that another thread stopped.
            let mut counted = counted.lock().unwrap_or_else(PoisonError::into_inner);
            let (done, progress) = &mut *counted;
            *done += 1;
            progress(Progress { done: *done, total });
        }
        contents
    };
    load("", &mut report);
    load(paths::PLOTS, &mut report);
    let lists = load(paths::SPLITS, &mut report);
    check_splits(&manifest, &lists, &mut report);
    let folder_of = |entry: &SampleEntry| format!("{}/{}", paths::SAMPLES, entry.id);
    let one = |entry: &SampleEntry| {
        let (folder, mut part) = (folder_of(entry), Report::default());
        let contents = load(&folder, &mut part);
        let listed = folders.get(folder.as_str()).map_or(&[][..], Vec::as_slice);
        let configuration = sample::check(entry, &folder, listed, &contents, depth, &mut part);
        (part, configuration)
    };
    let checked: Vec<(Report, Option<String>)> = manifest.samples.par_iter().map(one).collect();
    let mut common: Option<String> = None;
    for ((part, configuration), entry) in checked.into_iter().zip(&manifest.samples) {
        report.files += part.files;
        report.bytes += part.bytes;
        report.findings.extend(part.findings);
        let Some(configuration) = configuration else {
            continue;
        };
        if *common.get_or_insert_with(|| configuration.clone()) != configuration {
            let what = "was made with another configuration than the first sample";
            report.add(&format!("{}/{}", folder_of(entry), paths::META), what);
        }
    }
    let samples: BTreeSet<String> = manifest.samples.iter().map(folder_of).collect();
    let known = |folder: &str| ["", paths::SPLITS, paths::PLOTS].contains(&folder);
    for folder in folders
        .keys()
        .filter(|f| !known(f) && !samples.contains(**f))
    {
        report.add(folder, "is the folder of no listed sample");
    }
    report
}

fn read_manifest(root: &Path, report: &mut Report) -> Option<DatasetManifest> {
    let bytes = match file::read(&root.join(paths::DATASET), LARGEST_DESCRIPTION) {
        Ok(bytes) => bytes,
        Err(cause) => {
            let unfinished = root.join(paths::RUN).is_file();
            let hint = if unfinished {
                ": a run has not ended here, or its shards are not merged"
            } else {
                ""
            };
            report.add(paths::DATASET, format!("cannot be read: {cause}{hint}"));
            return None;
        }
    };
    match parse(&bytes) {
        Ok(manifest) => Some(manifest),
        Err(why) => {
            report.add(paths::DATASET, why.to_string());
            None
        }
    }
}

/// Pages that a command was writing when it was killed: each holds what the manifest lists, or what this list says, and
/// the next command goes on with them. The dataset is whole meanwhile.
fn pages_being_written(root: &Path, report: &mut Report) -> Vec<FileEntry> {
    let path = root.join(paths::PAGES);
    if !fs::symlink_metadata(&path).is_ok_and(|data| data.is_file()) {
        return Vec::new();
    }
    let bytes = file::read(&path, LARGEST_DESCRIPTION).map_err(|e| e.to_string());
    let pages =
        bytes.and_then(|b| serde_json::from_slice::<Vec<FileEntry>>(&b).map_err(|e| e.to_string()));
    let pages = pages.map_err(|why| report.add(paths::PAGES, format!("cannot be read: {why}")));
    let is_page = |page: &FileEntry| !page.path.starts_with(paths::SAMPLES);
    pages
        .unwrap_or_default()
        .into_iter()
        .filter(is_page)
        .collect()
}

/// A page, or a list of pages, that a killed command was about to name: the dataset is whole without it, and the next
/// command removes it.
fn is_half_made_page(path: &str) -> bool {
    let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
    let stem = name.rsplit_once(".tmp-").map(|(stem, _)| stem);
    let root = [paths::DATASET, paths::INDEX, paths::CARD, paths::PAGES];
    stem.is_some_and(|stem| match folder {
        "" => root.contains(&stem),
        folder => [paths::PLOTS, paths::SPLITS].contains(&folder),
    })
}

/// The tree holds the listed files and nothing else.
fn check_tree(root: &Path, manifest: &DatasetManifest, pages: &[FileEntry], report: &mut Report) {
    let mut listed = BTreeSet::new();
    let being_written = |path: &str| {
        path == paths::PAGES && !pages.is_empty() || pages.iter().any(|page| page.path == path)
    };
    for entry in &manifest.files {
        if let Err(cause) = paths::inside(root, &entry.path) {
            report.add(paths::DATASET, format!("lists a file it may not: {cause}"));
        }
        if !listed.insert(entry.path.as_str()) {
            report.add(&entry.path, "is listed twice");
        }
    }
    let mut paths = Vec::new();
    walk(root, "", &mut paths, report);
    paths.sort();
    for path in paths {
        if path != paths::DATASET && !listed.contains(path.as_str()) && !being_written(&path) {
            let what = if path == paths::RUN {
                "a run has not ended here: the same qpgen dataset goes on with it"
            } else if is_half_made_page(&path) {
                continue;
            } else if path.contains(".tmp-") {
                "is the leftover of an interrupted run"
            } else {
                "is not listed in dataset.json"
            };
            report.add(&path, what);
        }
    }
}

fn walk(folder: &Path, prefix: &str, paths: &mut Vec<String>, report: &mut Report) {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(cause) => return report.add(prefix, format!("cannot be listed: {cause}")),
    };
    for entry in entries {
        let (entry, kind) = match entry.and_then(|e| e.file_type().map(|kind| (e, kind))) {
            Ok(pair) => pair,
            Err(cause) => {
                report.add(prefix, format!("cannot be listed: {cause}"));
                continue;
            }
        };
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = if prefix.is_empty() {
            name
        } else {
            format!("{prefix}/{name}")
        };
        if kind.is_dir() {
            walk(&entry.path(), &path, paths, report);
        } else if kind.is_file() {
            paths.push(path);
        } else {
            report.add(&path, "is a link or no plain file");
        }
    }
}

fn read_entry(root: &Path, entry: &FileEntry, report: &mut Report) -> Option<Vec<u8>> {
    let path = paths::inside(root, &entry.path).ok()?; // reported with the tree
    let length = fs::symlink_metadata(&path)
        .ok()
        .filter(|data| data.is_file())
        .map(|data| data.len());
    if let Some(length) = length.filter(|length| *length != entry.bytes) {
        let what = format!("has {length} bytes, dataset.json says {}", entry.bytes);
        report.add(&entry.path, what);
        return None;
    }
    let read = if length.is_some() {
        // One of another length is not read at all.
        file::read(&path, entry.bytes).map_err(|cause| cause.to_string())
    } else {
        Err("there is no such file".into())
    };
    let bytes = match read {
        Ok(bytes) => bytes,
        Err(cause) => {
            report.add(&entry.path, format!("cannot be read: {cause}"));
            return None;
        }
    };
    report.files += 1;
    report.bytes += bytes.len() as u64;
    if blake3::hash(&bytes).to_hex().as_str() != entry.blake3 {
        report.add(&entry.path, "differs from its hash in dataset.json");
        return None;
    }
    Some(bytes)
}

/// Every sample stands in exactly one list, that of its entry, and no scene in two.
fn check_splits(manifest: &DatasetManifest, lists: &Contents, report: &mut Report) {
    let mut of_scene: BTreeMap<&str, Split> = BTreeMap::new();
    let mut ids = BTreeSet::new();
    for entry in &manifest.samples {
        if !ids.insert(entry.id.as_str()) {
            report.add(
                paths::DATASET,
                format!("sample {} is listed twice", entry.id),
            );
        }
        let split = *of_scene.entry(&entry.scene).or_insert(entry.split);
        if split != entry.split {
            let what = format!(
                "scene {:?} is in two splits, {} and {}",
                entry.scene,
                split.name(),
                entry.split.name()
            );
            report.add(paths::DATASET, what);
        }
    }
    if !manifest.samples.is_sorted_by(|a, b| a.id < b.id) {
        report.add(
            paths::DATASET,
            "its samples are not in the order of their names",
        );
    }
    for split in Split::ALL {
        let path = paths::split_list(split);
        let name = format!("{}.txt", split.name());
        let Some(content) = lists.get(&name) else {
            report.add(&path, "is not listed in dataset.json");
            continue;
        };
        let Some(bytes) = content else { continue };
        let entries = manifest.samples.iter().filter(|entry| entry.split == split);
        let expected: String = entries.map(|entry| format!("{}\n", entry.id)).collect();
        if String::from_utf8_lossy(bytes) != expected {
            let what = "does not name exactly the samples that dataset.json puts in this split, one a line in order";
            report.add(&path, what);
        }
    }
}
