//! `qpgen dataset`: draws, renders and writes sample after sample, and finishes the dataset.

use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel::shard::Shard;
use quadpixel_datasets::{DatasetManifest, FileEntry, paths};

use crate::assemble::Responses;
use crate::config::DatasetConfig;
use crate::observer::{Event, Observer};
use crate::production::error::GenerateError;
use crate::production::folder_error::FolderError;
use crate::production::identity::Identity;
use crate::production::out_folder::{check_folder, refuse_fewer, shard_neighbours};
use crate::production::recipes::Recipes;
use crate::production::run_folder::RunFolder;
use crate::recipe::{Recipe, SampleId};
use crate::sample::stages::{Stages, timed};
use crate::sample::{Rays, Sample, SampleError, prepare};
use crate::writer::{
    Dataset, EarlierSample, Foreign, Pages, Place, WriteError, earlier_sample, finish_dataset,
    is_whole_sample, write_sample,
};

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
    /// Where the time went; one sample is written while the next is rendered.
    pub stages: Stages,
}

impl Summary {
    /// Counts a sample that was made.
    fn add(&mut self, stages: Stages) {
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
    let mut responses = Responses::new();
    let mut done = Summary::default();
    observer.event(Event::Start {
        samples: recipes.indices.len(),
        rays: recipes.rays,
    });
    // One sample is written while the next is rendered; of a large picture both go together.
    let mut rendered: Option<Sample> = None;
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
        let (next, written) = rayon::join(
            || writer.render(&recipe, index, &mut responses),
            || rendered.as_ref().map(|sample| writer.write(sample)),
        );
        if let Some(stages) = written {
            done.add(stages?);
        }
        rendered = match next? {
            Rendered::Whole(sample) => Some(*sample),
            Rendered::Written(stages) => {
                done.add(stages);
                None
            }
        };
    }
    if let Some(last) = rendered {
        done.add(writer.write(&last)?);
    }
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

/// Where the samples of a part go.
struct Writer<'a> {
    folder: RunFolder,
    /// Hash of the configuration.
    hash: String,
    observer: &'a dyn Observer,
}

impl Writer<'_> {
    /// Whether an earlier run finished a sample below `root`; what is broken is reported and taken away.
    fn has(&self, root: &Path, index: u32) -> Result<bool, WriteError> {
        match earlier_sample(root, index, &self.hash)? {
            EarlierSample::Whole => Ok(true),
            EarlierSample::Nothing => Ok(false),
            EarlierSample::Broken(what) => {
                let text = format!("sample {index} was damaged ({what}); it is made again");
                self.observer.event(Event::Warning(&text));
                Ok(false)
            }
        }
    }

    /// Renders a sample; one of a large picture is written with it.
    fn render(
        &self,
        recipe: &Recipe,
        index: u32,
        responses: &mut Responses,
    ) -> Result<Rendered, GenerateError> {
        let id = SampleId {
            index,
            configuration_blake3: self.hash.clone(),
        };
        let failed = |e: SampleError| GenerateError::Sample {
            index,
            cause: Box::new(e),
        };
        let prepared = prepare(recipe, responses, self.observer);
        let prepared = prepared.map_err(|e| failed(e.into()))?;
        for warning in responses.take_warnings() {
            self.observer.event(Event::Warning(&warning));
        }
        let name = format!("sample {index}");
        if prepared.is_large() {
            self.folder.still_there()?;
            let rows = prepared.by_rows(id).map_err(failed)?;
            let made = rows.write(Place::Dataset(self.folder.path()), self.observer)?;
            made.report(self.observer, &name);
            self.tell(index, made.stages);
            return Ok(Rendered::Written(made.stages));
        }
        let (sample, _) = (prepared.render(id, Rays::Trace, self.observer)).map_err(failed)?;
        sample.made.report(self.observer, &name);
        Ok(Rendered::Whole(Box::new(sample)))
    }

    /// Writes a sample. Where the time went.
    fn write(&self, sample: &Sample) -> Result<Stages, GenerateError> {
        self.folder.still_there()?;
        let mut stages = sample.made.stages;
        timed(&mut stages.writing_s, || {
            write_sample(self.folder.path(), &sample.files())
        })?;
        self.tell(sample.made.description.index, stages);
        Ok(stages)
    }

    /// Tells that a sample is done.
    fn tell(&self, index: u32, stages: Stages) {
        let detail = format!("sample {index}: {stages}");
        self.observer.event(Event::Detail(&detail));
        self.observer.event(Event::SampleDone);
    }
}

/// A sample that was rendered.
enum Rendered {
    /// It is to be written.
    Whole(Box<Sample>),
    /// It is written; where the time went.
    Written(Stages),
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
