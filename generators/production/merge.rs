//! The shards of a dataset become the dataset, with the bytes of a run in one go.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel::shard::Shard;
use quadpixel_datasets::paths;

use crate::observer::{Event, Observer};
use crate::production::dataset::{finish, shard_folders};
use crate::production::error::GenerateError;
use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;
use crate::production::run_folder::RunFolder;

/// A shard on disk, locked.
struct Part {
    folder: RunFolder,
    identity: Identity,
    shard: Shard,
}

/// Joins the shards in `from` (absent: those in `out`, which are moved) into `out`.
///
/// # Errors
/// Shards that do not belong together (2); samples that are missing, or a disk that fails (1). A merge that
/// stopped goes on when it is called again.
pub fn merge(out: &Path, from: &[PathBuf], observer: &dyn Observer) -> Result<(), GenerateError> {
    let inside = from.is_empty();
    let folders = match inside {
        true => shard_folders(out)?,
        false => from.to_vec(),
    };
    let parts = folders.iter().map(|folder| {
        let (folder, identity, shard) = RunFolder::existing(folder)?;
        Ok(Part {
            folder,
            identity,
            shard,
        })
    });
    let parts: Vec<Part> = parts.collect::<Result<_, FolderError>>()?;
    let Some(first) = parts.first() else {
        let what = "holds no shards; allowed: the --out of qpgen dataset --shard, or --from";
        return Err(FolderError::refused(out.display(), what).into());
    };
    let count = one_dataset(first, &parts)?;
    let names = (0..count).map(paths::sample_name);
    let names: Vec<String> = names.collect::<Result<_, _>>().map_err(FolderError::Path)?;
    refuse_missing(out, first.shard, &parts, &names)?;
    let whole = RunFolder::open(out, &first.identity, Shard::WHOLE)?;
    let samples = out.join(paths::SAMPLES);
    file::own_folder(&samples)?;
    observer.event(Event::Start {
        samples: names.len(),
        rays: 0,
    });
    for (place, name) in names.iter().enumerate() {
        whole.still_there()?;
        let to = samples.join(name);
        let owner = parts.iter().find(|part| part.shard.owns(place));
        if let Some(part) = owner.filter(|_| to.symlink_metadata().is_err()) {
            let from = part.folder.path().join(paths::SAMPLES).join(name);
            take(&from, &to, inside)?;
            if !inside {
                observer.event(Event::SampleDone);
            }
        }
    }
    observer.event(Event::End);
    finish(out, &first.identity)?;
    if inside {
        for part in &parts {
            file::remove(part.folder.path())?;
        }
    }
    whole.end()?;
    let text = format!("{} shards joined, {count} samples", parts.len());
    observer.event(Event::Info(&text));
    Ok(())
}

/// The number of samples, if all parts are of one dataset, divided in one way, and none is there twice.
fn one_dataset(first: &Part, parts: &[Part]) -> Result<u32, FolderError> {
    let count_of = |part: &Part| {
        part.identity
            .configuration
            .get("count")
            .and_then(|c| c.as_u64())
    };
    let mut folders = BTreeMap::new();
    for part in parts {
        let path = part.folder.path().display();
        let mut differences = first.identity.differences(&part.identity);
        if part.shard.count() != first.shard.count() {
            differences.push(format!("shard: {} and {}", first.shard, part.shard));
        }
        if count_of(part) != count_of(first) {
            let count_text = |part| count_of(part).map_or("none".into(), |n| n.to_string());
            differences.push(format!(
                "count: {} and {}",
                count_text(first),
                count_text(part)
            ));
        }
        if let Some(other) = folders.insert(part.shard.number(), part.folder.path()) {
            differences.push(format!("shard {}: also in {}", part.shard, other.display()));
        }
        if !differences.is_empty() {
            let what = format!(
                "does not belong to {}:\n  {}",
                first.folder.path().display(),
                differences.join("\n  ")
            );
            return Err(FolderError::refused(path, what));
        }
    }
    let count = count_of(first).and_then(|n| u32::try_from(n).ok());
    count.ok_or_else(|| FolderError::refused(first.folder.path().display(), "has no count"))
}

/// Tells which shards to run again.
fn refuse_missing(
    out: &Path,
    any: Shard,
    parts: &[Part],
    names: &[String],
) -> Result<(), FolderError> {
    let there = |root: &Path, name: &String| {
        root.join(paths::SAMPLES)
            .join(name)
            .join(paths::META)
            .is_file()
    };
    let mut lines = Vec::new();
    for number in 1..=any.count() {
        let shard = Shard::new(number, any.count());
        let shard = shard.map_err(|e| FolderError::refused(out.display(), e))?;
        let part = parts.iter().find(|part| part.shard == shard);
        let names_of_shard = names
            .iter()
            .enumerate()
            .filter(|(place, _)| shard.owns(*place));
        let missing: Vec<&String> = names_of_shard
            .map(|(_, name)| name)
            .filter(|name| {
                !there(out, name) && !part.is_some_and(|part| there(part.folder.path(), name))
            })
            .collect();
        if let Some(first) = missing.first() {
            let n = missing.len();
            lines.push(format!(
                "shard {shard}: {n} samples are missing, the first {first}; run it again"
            ));
        }
    }
    if lines.is_empty() {
        return Ok(());
    }
    Err(FolderError::Incomplete {
        folder: out.to_owned(),
        missing: lines.join("\n  "),
    })
}

/// Moves a sample, or copies it aside and gives it its name.
fn take(from: &Path, to: &Path, may_move: bool) -> Result<(), FolderError> {
    let plain = from.symlink_metadata().is_ok_and(|data| data.is_dir());
    if !plain {
        let what = "is a link or file; allowed: a sample's folder";
        return Err(FolderError::refused(from.display(), what));
    }
    if may_move {
        // The sample is on the disk already; a move that a loss of power undoes is done again.
        return fs::rename(from, to).map_err(|e| FolderError::disk(to, e));
    }
    let name = to.file_name().unwrap_or_default().to_string_lossy();
    let aside = to.with_file_name(format!(".tmp-{name}"));
    file::remove(&aside)?;
    file::own_folder(&aside)?;
    let entries = fs::read_dir(from).map_err(|e| FolderError::disk(from, e))?;
    for entry in entries {
        let entry = entry.map_err(|e| FolderError::disk(from, e))?;
        let bytes = file::read(&entry.path())?;
        file::write_synced(&aside.join(entry.file_name()), &bytes)?;
    }
    Ok(file::rename_synced(&aside, to)?)
}
