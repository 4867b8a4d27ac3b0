//! What a dataset will take, said before it is begun: time, memory, disk, noise.
//!
//! Nothing is a constant of some machine: a few samples of the very configuration, spread over it, are made whole with
//! a quarter of their rays, or a few more, and written where the dataset will be, each while the next is rendered, and
//! measured. What a ray costs, and the size of noisy files, is followed from a sixteenth to a quarter of the rays, and
//! on to all; noise falls by a known power. Response tables that are not kept yet are timed on a coarser grid.

mod tables;

use std::path::Path;
use std::time::Instant;

use quadpixel::em::{Level, Preset};
use quadpixel::file::{self, FolderAside};
use quadpixel::render::LEAST_RAYS_PER_SUBPIXEL;
use quadpixel::shard::Shard;
use quadpixel_datasets::Effects;
use serde::Serialize;

use crate::assemble::Responses;
use crate::config::{DatasetConfig, ResponseConfig};
use crate::ledger::Ledger;
use crate::observer::{Event, Observer};
use crate::production::error::GenerateError;
use crate::production::folder_error::FolderError;
use crate::production::recipes::Recipes;
use crate::recipe::{Recipe, SampleId};
use crate::sample::{Rays, Sample, SampleError, prepare};
use crate::writer::write_alone;

/// Samples that are tried.
const SAMPLES: usize = 4;
/// Parts of the rays with which they are.
const PART: usize = 4;
/// Part of the rays' stage that is taken to grow with the rays, at least.
const LEAST_BY_RAYS: f64 = 0.5;
/// Fewest rays: below, a ray costs more.
const LEAST_RAYS: usize = 8;
/// Power of the number of rays with which a sub-pixel's error falls, as measured from 24 to 96 rays on charts with
/// diffraction at the lens (`benches/runs/2026-11-29/footprints.md`).
const SPREAD_FALLS: f64 = -0.6;

/// What to expect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Expected {
    /// Samples.
    pub samples: usize,
    /// Of all, s, response tables included.
    pub seconds: f64,
    /// Of the response tables that are not kept yet, s.
    pub response_seconds: f64,
    /// Of one sample, s.
    pub seconds_a_sample: f64,
    /// Largest memory, bytes; `None` where the system does not tell.
    pub memory_bytes: Option<u64>,
    /// Size of the dataset, bytes.
    pub disk_bytes: u64,
    /// RMS error of a sub-pixel that the rays leave, over the mean; `None` if all that was tried is black.
    pub relative_spread: Option<f64>,
    /// What the response is off by.
    pub response_error: String,
    /// What the samples that were tried contain of the light's way, and what they leave out.
    pub effects: Ledger,
}

/// All samples that were tried.
struct Tried {
    /// The first with a sixteenth of its rays.
    few: Trial,
    /// Each with a quarter.
    more: Vec<Trial>,
    /// That these took.
    seconds: f64,
}

/// One sample that was tried.
struct Trial {
    /// Of its rays alone, and of its response's table.
    rays_s: f64,
    response_s: f64,
    bytes: u64,
    spread: Option<f64>,
    rays: usize,
    effects: Effects,
}

/// What the part `shard` of a dataset that is to be made in `out` will take on this machine.
///
/// # Errors
/// A configuration that cannot be made, or the disk.
pub fn estimate(
    config: &DatasetConfig,
    out: &Path,
    shard: Shard,
    observer: &dyn Observer,
) -> Result<Expected, GenerateError> {
    config.check()?;
    let recipes = Recipes::checked(config, shard)?;
    let count = recipes.indices.len();
    let chosen = tried(count);
    let text = format!("trying {} samples with fewer rays", chosen.len());
    observer.event(Event::Info(&text));
    let mut drawn = Vec::new();
    for &k in &chosen {
        drawn.push(recipes.draw(config, recipes.indices[k])?);
    }
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let folder = FolderAside::new(out, format!("{name}-estimate-"))?;
    let mut responses = Responses::new();
    let response_seconds = tables::seconds_of_missing(config, &recipes, &mut responses)?;
    let half = tried_rays(&drawn[0]).div_ceil(2);
    let few = half.max(LEAST_RAYS.min(drawn[0].render.rays_per_pixel));
    let few = rendered(&drawn[0], few, &mut responses)?;
    let few = written(&few, folder.path())?;
    // Nearly as a dataset is made: one sample is written while the next is put together and rendered.
    let began = Instant::now();
    let mut trials = Vec::new();
    let mut last: Option<(Sample, usize)> = None;
    for recipe in &drawn {
        if observer.stop_asked() {
            return Err(GenerateError::EstimateStopped);
        }
        let (next, trial) = rayon::join(
            || rendered(recipe, tried_rays(recipe), &mut responses),
            || last.as_ref().map(|sample| written(sample, folder.path())),
        );
        trials.extend(trial.transpose()?);
        last = Some(next?);
    }
    if let Some(sample) = last {
        trials.push(written(&sample, folder.path())?);
    }
    let tried = Tried {
        few,
        seconds: began.elapsed().as_secs_f64(),
        more: trials,
    };
    Ok(expected(config, count, &tried, response_seconds))
}

/// Numbers of the samples that are tried: spread over all, and over what comes in turn.
fn tried(count: usize) -> Vec<usize> {
    let n = SAMPLES.min(count);
    let mut all: Vec<usize> = (0..n).map(|i| (i * (count / n) + i) % count).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn expected(
    config: &DatasetConfig,
    count: usize,
    tried: &Tried,
    response_seconds: f64,
) -> Expected {
    let Tried { few, more, seconds } = tried;
    let n = more.len() as f64;
    let rays = config.rays() as f64;
    // The part of the rays' stage that each ray adds to, by the sample that was rendered twice.
    let a_ray_s = (more[0].rays_s - few.rays_s) / (more[0].rays as f64 - few.rays as f64);
    let by_rays = (a_ray_s * more[0].rays as f64 / more[0].rays_s).clamp(LEAST_BY_RAYS, 1.0);
    let by_rays = if by_rays.is_nan() { 1.0 } else { by_rays };
    // Tables are counted apart.
    let missing = |t: &Trial| (rays / t.rays as f64 - 1.0) * by_rays * t.rays_s - t.response_s;
    let seconds_a_sample = (seconds + more.iter().map(missing).sum::<f64>()) / n;
    // From few to more rays, in powers of two; more[0] is the same sample.
    let octaves = (more[0].rays as f64 / few.rays as f64).log2();
    let left = (rays / more[0].rays as f64).log2();
    let per_octave = |few: f64, more: f64| {
        if octaves > 0.0 {
            (more - few) / octaves
        } else {
            0.0
        }
    };
    let slope = per_octave(few.bytes as f64, more[0].bytes as f64) / more[0].bytes.max(1) as f64;
    let bytes =
        more.iter().map(|t| t.bytes as f64).sum::<f64>() / n * (1.0 + slope * left).max(0.25);
    let spreads: Vec<f64> = more.iter().filter_map(|t| t.spread).collect();
    let relative_spread = (!spreads.is_empty())
        .then(|| spreads.iter().sum::<f64>() / spreads.len() as f64 * (SPREAD_FALLS * left).exp2());
    let response_error = match &config.response {
        ResponseConfig::Simulated(table) => table.level.error_text(table.choice.preset),
        ResponseConfig::Ideal => Level::IDEAL.error_text(Preset::default()),
        ResponseConfig::Files { .. } => "that of the tables, told where they were made",
    };
    let response_error = response_error.to_owned();
    let mut effects = Ledger::default();
    more.iter().for_each(|trial| effects.count(&trial.effects));
    Expected {
        samples: count,
        seconds: response_seconds + count as f64 * seconds_a_sample,
        response_seconds,
        seconds_a_sample,
        memory_bytes: peak_memory_bytes(),
        disk_bytes: (count as f64 * bytes) as u64,
        relative_spread,
        response_error,
        effects,
    }
}

/// Rays that tell the noise of all: half of them enough for the known light of a white wall, if all of them are.
fn tried_rays(recipe: &Recipe) -> usize {
    let all = recipe.render.rays_per_pixel;
    let known = LEAST_RAYS_PER_SUBPIXEL * recipe.sensor.subpixels.count();
    let part = (all / PART).max(LEAST_RAYS.min(all));
    match all >= known {
        true => part.max(2 * known).min(all),
        false => part,
    }
}

/// A sample with so many of its rays, and how many.
fn rendered(
    recipe: &Recipe,
    rays: usize,
    responses: &mut Responses,
) -> Result<(Sample, usize), GenerateError> {
    let mut recipe = recipe.clone();
    let all_rays = recipe.render.rays_per_pixel;
    recipe.render.rays_per_pixel = rays;
    let id = SampleId {
        index: 0,
        configuration_blake3: "0".repeat(64),
    };
    let mut prepared = prepare(&recipe, responses, &()).map_err(SampleError::from)?;
    // As with all rays: few of them are not worth a map.
    prepared.make_maps_for(all_rays);
    let (sample, _) = prepared.render(id, Rays::Trace, &())?;
    Ok((sample, rays))
}

/// Writes a sample that is tried, and takes it away.
fn written((sample, rays): &(Sample, usize), folder: &Path) -> Result<Trial, GenerateError> {
    let place = folder.join("sample");
    write_alone(&place, &sample.files())?;
    let bytes = size_of(&place)?;
    file::remove(&place)?;
    Ok(Trial {
        rays_s: sample.made.stages.rays_s,
        response_s: sample.made.stages.response_s,
        bytes,
        spread: sample.made.description.errors.map(|e| e.rms_over_mean),
        rays: *rays,
        effects: sample.made.description.effects.clone(),
    })
}

/// The largest memory that this process has had, bytes.
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// Length of all files in a folder.
fn size_of(folder: &Path) -> Result<u64, GenerateError> {
    let failed = |cause| FolderError::disk(folder, cause);
    let mut bytes = 0;
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        bytes += entry.and_then(|e| e.metadata()).map_err(failed)?.len();
    }
    Ok(bytes)
}

impl std::fmt::Display for Expected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mega = |bytes: u64| bytes as f64 * 1e-6;
        write!(
            f,
            "{} samples: {:.0} s ({:.2} s per sample, {:.0} s of response tables), {:.1} MB on disk",
            self.samples,
            self.seconds,
            self.seconds_a_sample,
            self.response_seconds,
            mega(self.disk_bytes)
        )?;
        if let Some(bytes) = self.memory_bytes {
            write!(f, ", {:.0} MB of memory", mega(bytes))?;
        }
        if let Some(spread) = self.relative_spread {
            write!(f, "\nspread of a sub-pixel: {:.1} %", 100.0 * spread)?;
        }
        write!(f, "\nresponse: {}", self.response_error)?;
        let ledger = self.effects.to_string();
        write!(
            f,
            "\neffects of the samples that were tried:\n{}",
            ledger.trim_end()
        )
    }
}
