//! The shards of a dataset become the dataset, with the bytes of a run in one go.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use quadpixel::file::{self, FolderAside};
use quadpixel::shard::Shard;
use quadpixel_datasets::paths;

use crate::observer::{Event, Observer};
use crate::production::dataset::finish;
use crate::production::error::GenerateError;
use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;
use crate::production::out_folder::shard_folders;
use crate::production::run_folder::RunFolder;
use crate::writer::{Foreign, Pages, half_made, half_made_prefix, is_half_made_sample};

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
pub fn merge(
    out: &Path,
    from: &[PathBuf],
    foreign: Foreign,
    observer: &dyn Observer,
) -> Result<(), GenerateError> {
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
        if inside && ended_merge(out, foreign)? {
            return Ok(());
        }
        let what = "holds no shards; allowed: the --out of qpgen dataset --shard, or --from";
        return Err(FolderError::refused(out.display(), what).into());
    };
    let count = one_dataset(first, &parts)?;
    let names = (0..count).map(paths::sample_name);
    let names: Vec<String> = names.collect::<Result<_, _>>().map_err(FolderError::Path)?;
    refuse_missing(out, first.shard, &parts, &names)?;
    if inside {
        refuse_foreign(&parts, foreign)?;
    }
    Pages::open(out, foreign)?.check()?;
    let whole = RunFolder::open(out, &first.identity, Shard::WHOLE)?;
    let samples = out.join(paths::SAMPLES);
    file::own_folder(&samples)?;
    observer.event(Event::Start {
        samples: names.len(),
        rays: 0,
    });
    let owners: BTreeMap<usize, &Part> = parts.iter().map(|p| (p.shard.number(), p)).collect();
    for (place, name) in names.iter().enumerate() {
        whole.still_there()?;
        let to = samples.join(name);
        let owner = owners.get(&(place % first.shard.count() + 1));
        if let Some(part) = owner.filter(|_| to.symlink_metadata().is_err()) {
            let from = part.folder.path().join(paths::SAMPLES).join(name);
            take(&from, &to, inside)?;
            if !inside {
                observer.event(Event::SampleDone);
            }
        }
    }
    observer.event(Event::End);
    finish(out, &first.identity, foreign)?;
    if inside {
        // What is left of them are descriptions and leftovers: see refuse_foreign.
        for part in &parts {
            file::remove(part.folder.path())?;
        }
    }
    whole.end()?;
    let text = format!("{} shards joined, {count} samples", parts.len());
    observer.event(Event::Info(&text));
    Ok(())
}

/// Ends a merge that was killed when it had no shard left: what is there is the dataset, but for its last step.
fn ended_merge(out: &Path, foreign: Foreign) -> Result<bool, GenerateError> {
    if out.join(paths::RUN).is_file() && out.join(paths::DATASET).is_file() {
        let (whole, identity, shard) = RunFolder::existing(out)?;
        if shard.is_whole() {
            finish(out, &identity, foreign)?;
            whole.end()?;
            return Ok(true);
        }
    }
    Ok(out.join(paths::DATASET).is_file())
}

/// Shard folders go with the merge: what is not ours in them is not lost with them.
fn refuse_foreign(parts: &[Part], foreign: Foreign) -> Result<(), GenerateError> {
    if foreign == Foreign::Replace {
        return Ok(());
    }
    let refused = |path: &Path| {
        let what = "is not what qpgen wrote, and would go with its shard; move it away, or give --force, which removes it";
        Err(FolderError::refused(path.display(), what).into())
    };
    for part in parts {
        let root = part.folder.path();
        let pages = Pages::open(root, foreign)?;
        let mut folders = vec![String::new()];
        while let Some(folder) = folders.pop() {
            let path = root.join(&folder);
            for entry in fs::read_dir(&path).map_err(|e| FolderError::disk(&path, e))? {
                let entry = entry.map_err(|e| FolderError::disk(&path, e))?;
                let name = entry.file_name().to_string_lossy().into_owned();
                let below = match folder.as_str() {
                    "" => name.clone(),
                    folder => format!("{folder}/{name}"),
                };
                let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
                let own = match (folder.as_str(), name.as_str(), is_folder) {
                    ("", paths::RUN | paths::PAGES, false) => true,
                    ("", paths::SAMPLES | paths::PLOTS | paths::SPLITS, true) => {
                        folders.push(below.clone());
                        true
                    }
                    (paths::SAMPLES, name, true) => {
                        paths::is_sample_name(name) || is_half_made_sample(name)
                    }
                    (_, name, false) => half_made(name).is_some() || pages.wrote(&below)?,
                    _ => false,
                };
                if !own {
                    return refused(&entry.path());
                }
            }
        }
    }
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
    let by_number: BTreeMap<usize, &Part> = parts.iter().map(|p| (p.shard.number(), p)).collect();
    // By the number of the shard: how many are missing, and the first.
    let mut missing: BTreeMap<usize, (usize, &String)> = BTreeMap::new();
    for (place, name) in names.iter().enumerate() {
        let number = place % any.count() + 1;
        let part = by_number.get(&number);
        if !there(out, name) && !part.is_some_and(|part| there(part.folder.path(), name)) {
            missing.entry(number).or_insert((0, name)).0 += 1;
        }
    }
    let line = |(number, (n, first)): (usize, (usize, &String))| {
        let shard = Shard::new(number, any.count());
        let shard = shard.map_err(|e| FolderError::refused(out.display(), e))?;
        Ok(format!(
            "shard {shard}: {n} samples are missing, the first {first}; run it again"
        ))
    };
    let lines: Vec<String> = missing
        .into_iter()
        .map(line)
        .collect::<Result<_, FolderError>>()?;
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
    let aside = FolderAside::new(to, half_made_prefix(&name))?;
    let entries = fs::read_dir(from).map_err(|e| FolderError::disk(from, e))?;
    for entry in entries {
        let entry = entry.map_err(|e| FolderError::disk(from, e))?;
        if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            let what = "is a link, folder or device in a sample; allowed: plain files";
            return Err(FolderError::refused(entry.path().display(), what));
        }
        let bytes = file::read(&entry.path())?;
        file::write_synced(&aside.path().join(entry.file_name()), &bytes)?;
    }
    Ok(aside.persist(to)?)
}
