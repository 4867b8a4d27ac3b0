//! `qpgen dataset`: draws, renders and writes sample after sample, and finishes the dataset.

use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel::shard::Shard;
use quadpixel_datasets::{DatasetManifest, FileEntry, paths};

use crate::config::DatasetConfig;
use crate::observer::{Event, Observer};
use crate::production::error::GenerateError;
use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;
use crate::production::line::{Line, Writer};
use crate::production::out_folder::{check_folder, refuse_fewer, shard_neighbours};
use crate::production::recipes::Recipes;
use crate::production::run_folder::RunFolder;
use crate::sample::stages::Stages;
use crate::writer::{Dataset, Foreign, Pages, finish_dataset, is_whole_sample};

/// Licence of what is made: charts and fonts allow it.
pub const LICENCE: &str = "CC0-1.0";

/// What a run did.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Samples of the dataset, or of the part of it.
    pub samples: usize,
    /// Those of them that an earlier run had finished.
    pub reused: usize,
    /// The gallery; none for a part.
    pub gallery: Option<PathBuf>,
    /// Where the time went; one sample is rendered while the last is written and the next put together.
    pub stages: Stages,
}

impl Summary {
    /// Counts a sample that was made.
    pub(super) fn add(&mut self, stages: Stages) {
        self.samples += 1;
        self.stages = self.stages.plus(stages);
    }
}

/// Makes the whole dataset in `out`, as [`make_part`] does.
///
/// # Errors
/// As there.
pub fn make(
    config: &DatasetConfig,
    out: &Path,
    observer: &dyn Observer,
) -> Result<Summary, GenerateError> {
    make_part(config, out, Shard::WHOLE, Foreign::Refuse, observer)
}

/// Makes the dataset in `out`, or a part of it in a folder of its own there, which [`super::merge`] joins. A folder
/// that holds samples of the same configuration goes on where it stopped; a dataset that is whole is only read.
/// `foreign`: what to do with files of others where gallery, data card and lists go.
///
/// # Errors
/// A bad configuration or folder (2); a disk that fails or a signal that ended the run (1). What was written stays
/// valid.
pub fn make_part(
    config: &DatasetConfig,
    out: &Path,
    shard: Shard,
    foreign: Foreign,
    observer: &dyn Observer,
) -> Result<Summary, GenerateError> {
    config.check()?;
    check_folder(out)?;
    let identity = Identity::new(config)?;
    let recipes = Recipes::checked(config, shard)?;
    let in_whole = shard_neighbours(out, shard, &identity)?;
    let place = match shard.is_whole() {
        true => out.to_path_buf(),
        false => out.join(paths::shard_folder(shard.number(), shard.count())),
    };
    refuse_fewer(&place, config.count)?;
    if shard.is_whole() && is_finished(out, &identity)? {
        return reused(out, config, &recipes, observer);
    }
    if shard.is_whole() {
        Pages::open(out, foreign)?.check()?;
    }
    let writer = Writer {
        folder: RunFolder::open(&place, &identity, shard)?,
        hash: identity.hash(),
        observer,
    };
    let mut done = Summary::default();
    observer.event(Event::Start {
        samples: recipes.indices.len(),
        rays: recipes.rays,
    });
    let mut line = Line::new(&writer);
    for &index in &recipes.indices {
        let recipe = recipes.draw(config, index)?;
        if (in_whole && writer.has(out, index)?) || writer.has(&place, index)? {
            done.reused += 1;
            done.samples += 1;
            let rays = recipe.rays();
            observer.event(Event::SampleReused { rays });
            continue;
        }
        if observer.stop_asked() {
            break;
        }
        line.advance(Some((&recipe, index)), &mut done)?;
    }
    line.end(&mut done)?;
    if done.samples < recipes.indices.len() {
        observer.event(Event::End);
        return Err(GenerateError::Stopped {
            done: done.samples,
            samples: recipes.indices.len(),
        });
    }
    writer.folder.still_there()?;
    if shard.is_whole() {
        let text = format!("{} samples: lists, gallery and data card", done.samples);
        observer.event(Event::Info(&text));
        finish(&place, &identity, foreign)?;
        writer.folder.end()?;
        done.gallery = Some(place.join(paths::INDEX));
    }
    observer.event(Event::End);
    Ok(done)
}

/// Whether the dataset of this identity is whole in `out`: nothing is to be done.
fn is_finished(out: &Path, identity: &Identity) -> Result<bool, GenerateError> {
    let path = out.join(paths::DATASET);
    if !path.is_file()
        || [paths::RUN, paths::PAGES]
            .iter()
            .any(|name| out.join(name).exists())
    {
        return Ok(false);
    }
    let Ok(manifest) = quadpixel_datasets::read_description::<DatasetManifest>(&file::read(&path)?)
    else {
        return Ok(false); // told where the folder is opened
    };
    let same = manifest.tool.version == identity.version
        && manifest.configuration == identity.configuration
        && manifest.inputs == identity.inputs;
    let pages = Pages::open(out, Foreign::Refuse)?;
    let only_ours = pages.check().is_ok() && pages.half_made(&[paths::RUN])?.is_empty();
    drop(pages);
    let hash = identity.hash();
    let mut samples = manifest.samples.iter();
    let mut pages = manifest
        .files
        .iter()
        .filter(|entry| !entry.path.starts_with(paths::SAMPLES));
    let unchanged = |entry: &FileEntry| {
        let content = paths::inside(out, &entry.path)
            .ok()
            .and_then(|path| file::read(&path).ok());
        content.is_some_and(|bytes| FileEntry::new(&entry.path, &bytes) == *entry)
    };
    Ok(same
        && only_ours
        && samples.all(|sample| is_whole_sample(out, &sample.id, &hash))
        && pages.all(unchanged))
}

/// What a run in a folder did whose dataset is whole.
fn reused(
    out: &Path,
    config: &DatasetConfig,
    recipes: &Recipes,
    observer: &dyn Observer,
) -> Result<Summary, GenerateError> {
    observer.event(Event::Start {
        samples: recipes.indices.len(),
        rays: recipes.rays,
    });
    for &index in &recipes.indices {
        let rays = recipes.draw(config, index)?.rays();
        observer.event(Event::SampleReused { rays });
    }
    observer.event(Event::End);
    let samples = recipes.indices.len();
    Ok(Summary {
        samples,
        reused: samples,
        gallery: Some(out.join(paths::INDEX)),
        stages: Stages::default(),
    })
}

/// Makes the dataset of the samples in `out` whole.
///
/// # Errors
/// A sample that cannot be read, or the disk.
pub(crate) fn finish(
    out: &Path,
    identity: &Identity,
    foreign: Foreign,
) -> Result<(), GenerateError> {
    let number = |name: &str| {
        identity
            .configuration
            .get(name)
            .and_then(serde_json::Value::as_u64)
    };
    let (Some(seed), Some(count)) = (number("seed"), number("count")) else {
        let what = "its configuration has no count and seed";
        return Err(FolderError::refused(out.display(), what).into());
    };
    let dataset = Dataset {
        seed,
        configuration: identity.configuration.clone(),
        inputs: identity.inputs.clone(),
        licence: LICENCE,
        count: u32::try_from(count).unwrap_or(u32::MAX),
    };
    finish_dataset(out, &dataset, foreign)?;
    Ok(())
}
