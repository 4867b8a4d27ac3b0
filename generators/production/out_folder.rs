//! What may lie in the folder of a run before it begins: nothing, an earlier run, parts of the same dataset.

use std::path::{Path, PathBuf};

use quadpixel::shard::Shard;
use quadpixel_datasets::paths;

use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;
use crate::production::run_folder::{identity_in, refuse_other};

/// Refuses parts of another dataset, or of another number of parts, in `out`. Says whether samples may lie in `out`
/// itself, from an earlier merge.
pub(super) fn shard_neighbours(
    out: &Path,
    shard: Shard,
    identity: &Identity,
) -> Result<bool, FolderError> {
    let parts = shard_folders(out)?;
    if shard.is_whole() {
        return match parts.is_empty() {
            true => Ok(false),
            false => Err(FolderError::refused(
                format!("--out {}", out.display()),
                "holds shards of a dataset; allowed: --shard i/n, or qpgen merge, or another folder",
            )),
        };
    }
    for part in &parts {
        let numbers = part
            .file_name()
            .and_then(|n| paths::parse_shard_folder(n.to_str()?));
        if numbers.is_some_and(|(_, count)| count != shard.count()) {
            let what = format!(
                "{} is there already; allowed: the same number of shards, or another folder",
                part.display()
            );
            return Err(FolderError::refused(format!("--shard {shard}"), what));
        }
        if let Some(there) = identity_in(part)? {
            refuse_other(part, &there, identity)?;
        }
    }
    let whole = identity_in(out)?;
    if let Some(there) = &whole {
        refuse_other(out, there, identity)?;
    }
    Ok(whole.is_some())
}

/// The folders of parts in `out`, in the order of their names.
pub(super) fn shard_folders(out: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let Ok(entries) = std::fs::read_dir(out) else {
        return Ok(Vec::new());
    };
    let mut folders = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| FolderError::disk(out, e))?;
        let plain = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if plain
            && entry
                .file_name()
                .to_str()
                .and_then(paths::parse_shard_folder)
                .is_some()
        {
            folders.push(entry.path());
        }
    }
    folders.sort();
    Ok(folders)
}

/// A dataset may grow, but not shrink: samples would be left over.
pub(super) fn refuse_fewer(place: &Path, count: usize) -> Result<(), FolderError> {
    let Ok(entries) = std::fs::read_dir(place.join(paths::SAMPLES)) else {
        return Ok(());
    };
    let numbers = entries
        .flatten()
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    match numbers.max() {
        Some(largest @ 0usize..) if largest >= count => Err(FolderError::Fewer {
            folder: place.to_owned(),
            count,
            largest,
        }),
        _ => Ok(()),
    }
}

/// A folder may be absent, empty, or hold an earlier run.
pub(super) fn check_folder(out: &Path) -> Result<(), FolderError> {
    if out.exists() && !out.is_dir() {
        let place = format!("--out {}", out.display());
        return Err(FolderError::refused(place, "is a file; allowed: a folder"));
    }
    let known = [paths::RUN, paths::DATASET].map(|name| out.join(name).is_file());
    let ours = known.contains(&true) || !shard_folders(out)?.is_empty();
    // A run that was killed in its first moment leaves a half-made run.json.
    let begun = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with(paths::RUN);
    let empty = !out.exists()
        || std::fs::read_dir(out)
            .is_ok_and(|entries| entries.flatten().all(|e| begun(&e.file_name())));
    if ours || empty {
        return Ok(());
    }
    Err(FolderError::refused(
        format!("--out {}", out.display()),
        "holds files that are not a dataset; allowed: a new or empty folder, or one of an earlier run",
    ))
}
