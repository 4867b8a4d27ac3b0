//! Tables: made, in parts, or of another tool's file; and where they are written.

use crate::outln;
use crate::print::say;
use std::path::{Path, PathBuf};

use quadpixel::em::PixelStack;
use quadpixel::file;
use quadpixel::response::{AngularResponse, CachedTable, ImportSettings, ResponseCache, TablePlan};
use quadpixel::shard::Shard;
use quadpixel_datasets::paths::sanitised;

use super::args::ResponseArgs;
use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use quadpixel_generators::observer::Observer;

fn plan(args: &ResponseArgs, stack: &PixelStack) -> Result<TablePlan, CommandError> {
    TablePlan::new(stack, &args.settings(stack)).map_err(CommandError::input)
}

/// The table asked for, from the cache or made for it.
fn made(
    args: &ResponseArgs,
    stack: &PixelStack,
    angles: &dyn quadpixel::progress::Progress,
) -> Result<CachedTable, CommandError> {
    let cache = ResponseCache::open(ResponseCache::default_dir());
    Ok(cache.table(&plan(args, stack)?, angles)?)
}

pub(super) fn table(args: &ResponseArgs, stack: &PixelStack, log: Log) -> Result<(), CommandError> {
    let progress = Progress::new(log.json(args.json));
    let angles: &dyn Observer = &progress;
    let shard = args.shard.shard(&progress)?;
    if !shard.is_whole() {
        return part(args, &plan(args, stack)?, shard, &progress);
    }
    let path = match &args.output {
        Some(path) => path.clone(),
        None => default_output(stack, args.model.name())?,
    };
    file::probe_file(&path)?;
    let began = std::time::Instant::now();
    let made = made(args, stack, &angles)?;
    let seconds = began.elapsed().as_secs_f64();
    for warning in &made.warnings {
        progress.warn(&warning.to_string());
    }
    if let Some(violation) = made.report.as_ref().and_then(|r| r.violation()) {
        progress.warn(&format!(
            "{violation}; cut in the table. A finer preset should cure it"
        ));
    }
    if let Some((r, first)) = made
        .report
        .as_ref()
        .and_then(|r| Some((r, r.warning.as_ref()?)))
    {
        progress.warn(&format!(
            "{} of {} runs, the first: {first}",
            r.warned, r.runs
        ));
    }
    progress.finish();
    for error in &made.table.meta().corrections {
        say(&format!(
            "corrected by {} exact runs: off by {:.4} rms, {:.4} at most (wave alone: {:.4}, {:.4}), each run left out in turn",
            error.runs, error.left_rms, error.left_max, error.before_rms, error.before_max
        ));
    }
    written(&made.table, &path)?;
    if args.json {
        let report = made.report.as_ref();
        outln!(
            "{}",
            serde_json::json!({
                "file": path.display().to_string(), "nodes": nodes(&made.table), "seconds": seconds, "key": made.table.meta().key,
                "from_cache": report.is_none(), "build": report, "shifts": made.table.axes().shifts_um.len(),
                "chief_ray_shifts": made.table.meta().chief_ray_shifts, "corrections": made.table.meta().corrections
            })
        );
        return Ok(());
    }
    outln!(
        "{}: {} directions in {seconds:.1} s",
        path.display(),
        nodes(&made.table)
    );
    if let Some(lookup) = made.table.shifted_interpolator(args.wavelength_nm[0]) {
        outln!(
            "{} lens shifts, the others by symmetry; {:.0} MB here, {:.0} MB when read by a renderer",
            made.table.axes().shifts_um.len(),
            std::mem::size_of_val(made.table.table()) as f64 * 1e-6,
            lookup.bytes() as f64 * 1e-6
        );
    }
    match made.report {
        None => outln!("computed earlier and kept"),
        Some(r) => outln!(
            "{} runs, {} of them kept from an earlier build; before cutting, P from {:.4} and sums up to {:.4}; interpolation cut by at most \
             {:.4}; worst residual {:.1e}, worst imbalance of power {:+.4}",
            r.runs,
            r.reused,
            r.least,
            r.largest_sum,
            r.most_cut,
            r.residual,
            r.imbalance
        ),
    }
    Ok(())
}

/// Simulates a part of the directions into the cache.
pub(super) fn part(
    args: &ResponseArgs,
    plan: &TablePlan,
    shard: Shard,
    progress: &Progress,
) -> Result<(), CommandError> {
    let angles: &dyn Observer = progress;
    let began = std::time::Instant::now();
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let part = cache.make_part(plan, shard, &angles)?;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    if args.json {
        let object = serde_json::json!({
            "shard": shard.to_string(), "file": part.path.display().to_string(), "runs": part.runs, "reused": part.reused, "seconds": seconds
        });
        outln!("{object}");
    } else {
        outln!(
            "shard {shard}: {} runs ({} of an earlier call) in {seconds:.1} s, kept in {}\n\
             when all shards are done, the same command with --shard 1/1 makes the table",
            part.runs,
            part.reused,
            part.path.display()
        );
    }
    Ok(())
}

pub(super) fn import(
    args: &ResponseArgs,
    stack: &PixelStack,
    csv: &Path,
) -> Result<(), CommandError> {
    let [wavelength_nm] = args.wavelength_nm[..] else {
        return Err(CommandError::input(
            "--wavelength-nm has several values; allowed: one with --import (a column wavelength_nm of the file says the others)",
        ));
    };
    if !(wavelength_nm > 0.0 && wavelength_nm.is_finite()) {
        return Err(CommandError::input(format!(
            "--wavelength-nm is {wavelength_nm}; allowed: a positive number"
        )));
    }
    let settings = ImportSettings {
        wavelength_nm,
        symmetric: args.symmetric,
    };
    let response = AngularResponse::read_csv(csv, stack, &settings).map_err(CommandError::input)?;
    let path = match &args.output {
        Some(path) => path.clone(),
        None => default_output(stack, "import")?,
    };
    written(&response, &path)?;
    let wavelengths = &response.axes().wavelengths_nm;
    if args.json {
        let key = &response.meta().key;
        outln!(
            "{}",
            serde_json::json!({ "file": path.display().to_string(), "nodes": nodes(&response), "wavelengths_nm": wavelengths, "key": key })
        );
    } else {
        outln!(
            "{}: {} directions at {wavelengths:?} nm from {}",
            path.display(),
            nodes(&response),
            csv.display()
        );
    }
    Ok(())
}

pub(super) fn written(response: &AngularResponse, path: &Path) -> Result<(), CommandError> {
    response.write_npz(path).map_err(CommandError::failed)
}

/// `NAME-what.npz` in the working folder, whatever a file calls its pixel.
pub(super) fn default_output(stack: &PixelStack, what: &str) -> Result<PathBuf, CommandError> {
    unnamed(PathBuf::from(format!(
        "{}-{what}.npz",
        sanitised(&stack.name)
    )))
}

/// A file that was not named as the output: only a table of ours is replaced.
pub(super) fn unnamed(path: PathBuf) -> Result<PathBuf, CommandError> {
    match path.symlink_metadata().is_ok() && AngularResponse::read_npz(&path).is_err() {
        false => Ok(path),
        true => Err(CommandError::input(format!(
            "{}: is there already, and is no table of angular responses; move it away, or give another name by --output",
            path.display()
        ))),
    }
}

pub(super) fn nodes(response: &AngularResponse) -> usize {
    let axes = response.axes();
    axes.u.len() * axes.v.len() * axes.wavelengths_nm.len() * axes.shifts_um.len()
}
