//! `qpgen dataset`: draws, renders and writes sample after sample, and finishes the dataset.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use quadpixel::command::CommandError;
use quadpixel::response::AngularResponse;

use crate::assemble::{Responses, pixel};
use crate::config::DatasetConfig;
use crate::draw;
use crate::progress::Progress;
use crate::recipe::Recipe;
use crate::sample::{SampleId, render_sample};
use crate::stages::{Stages, timed};
use crate::writer::{
    Dataset, WriteError, WrittenSample, configuration_hash, finish_dataset, finished_sample,
    write_sample,
};

/// Licence of what is made: charts and fonts allow it.
const LICENCE: &str = "CC0-1.0";

/// What a run did.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Samples in the dataset.
    pub samples: usize,
    /// Those of them that an earlier run had finished.
    pub reused: usize,
    /// The gallery.
    pub gallery: PathBuf,
    /// Where the time went.
    pub stages: Stages,
}

/// Makes the dataset in `out`. A folder that holds samples of the same configuration goes on where it stopped.
///
/// # Errors
/// A bad configuration or folder, or a disk that fails; what was written stays valid.
pub fn make(
    config: &DatasetConfig,
    out: &Path,
    progress: &Progress,
) -> Result<Summary, CommandError> {
    config.check()?;
    check_folder(out)?;
    let configuration = serde_json::to_value(config)
        .map_err(|e| CommandError::failed(format!("configuration: {e}")))?;
    // The number of samples is no part of what a sample is: a dataset may grow.
    let hash = configuration_hash(
        &serde_json::json!({ "version": env!("CARGO_PKG_VERSION"), "config": without_count(config)? }),
    );
    let beyond = out
        .join(datasets_spec::paths::SAMPLES)
        .join(format!("{:06}", config.count));
    if beyond.exists() {
        return Err(CommandError::input(format!(
            "--count is {}; {} holds more samples already; allowed: at least as many, or a new folder",
            config.count,
            out.display()
        )));
    }
    let recipes = recipes(config)?;
    let mut responses = Responses::new();
    let mut samples: Vec<WrittenSample> = Vec::with_capacity(recipes.len());
    let mut reused = 0;
    let mut stages = Stages::default();
    progress.start(recipes.len(), recipes.iter().map(Recipe::rays).sum());
    for (index, recipe) in recipes.iter().enumerate() {
        let index = u32::try_from(index).map_err(|_| {
            CommandError::input(format!("count is {}; allowed: up to 2^32", config.count))
        })?;
        if let Some(done) = finished_sample(out, index, &hash).map_err(write_error)? {
            samples.push(done);
            reused += 1;
            progress.rays(recipe.rays());
            progress.sample_done();
            continue;
        }
        let id = SampleId {
            index,
            configuration_blake3: hash.clone(),
        };
        let angles = |done: usize, total: usize| progress.angles(done, total);
        let sample = render_sample(recipe, id, &mut responses, &angles, &|n| progress.rays(n))
            .map_err(|e| e.within(&format!("sample {index}")))?;
        let warnings = responses.take_warnings();
        for warning in warnings.iter().chain(sample.warnings()) {
            progress.warn(warning);
        }
        stages = stages.plus(sample.stages());
        let written = timed(&mut stages.writing_s, || write_sample(out, &sample.files()));
        samples.push(written.map_err(write_error)?);
        progress.sample_done();
    }
    let dataset = Dataset {
        seed: config.seed,
        configuration,
        licence: LICENCE,
        samples: &samples,
    };
    finish_dataset(out, &dataset).map_err(write_error)?;
    progress.finish();
    Ok(Summary {
        samples: samples.len(),
        reused,
        gallery: out.join(datasets_spec::paths::INDEX),
        stages,
    })
}

fn without_count(config: &DatasetConfig) -> Result<serde_json::Value, CommandError> {
    serde_json::to_value(DatasetConfig {
        count: 0,
        ..config.clone()
    })
    .map_err(|e| CommandError::failed(format!("configuration: {e}")))
}

/// Pitch of a pixel or of the pixel of a table (`.npz`).
fn pitch_um(name: &str) -> Result<f64, CommandError> {
    if !name.ends_with(".npz") {
        return Ok(pixel(name)?.pitch_um);
    }
    let table = AngularResponse::read_npz(Path::new(name));
    table
        .map(|t| t.meta().pitch_um)
        .map_err(|e| CommandError::input(e.to_string()))
}

/// All recipes, so that a bad one is found before the first ray.
fn recipes(config: &DatasetConfig) -> Result<Vec<Recipe>, CommandError> {
    crate::assemble::subpixels(&config.sensor.subpixels)?;
    let known = RefCell::new(BTreeMap::new());
    let pitch_of = |name: &str| {
        if let Some(&pitch_um) = known.borrow().get(name) {
            return Ok(pitch_um);
        }
        let pitch_um = pitch_um(name)?;
        known.borrow_mut().insert(name.to_owned(), pitch_um);
        Ok(pitch_um)
    };
    (0..config.count as u64)
        .map(|index| draw::recipe(config, index, &pitch_of))
        .collect()
}

/// A folder may be absent, empty, or hold an earlier run.
fn check_folder(out: &Path) -> Result<(), CommandError> {
    if out.exists() && !out.is_dir() {
        return Err(CommandError::input(format!(
            "--out {}: is a file; allowed: a folder",
            out.display()
        )));
    }
    let ours = out.join(datasets_spec::paths::SAMPLES).is_dir();
    let empty =
        !out.exists() || std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_none());
    if ours || empty {
        return Ok(());
    }
    Err(CommandError::input(format!(
        "--out {}: holds files that are not a dataset; allowed: a new or empty folder, or one of an earlier run",
        out.display()
    )))
}

/// What the user can mend is an input error; a disk that fails is not.
pub(crate) fn write_error(error: WriteError) -> CommandError {
    match error {
        WriteError::Occupied { .. } | WriteError::Input { .. } | WriteError::Path(_) => {
            CommandError::input(error.to_string())
        }
        WriteError::File(_) | WriteError::Image(_) | WriteError::Json { .. } => {
            CommandError::failed(error.to_string())
        }
    }
}
