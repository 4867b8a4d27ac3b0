//! `qpgen response`: a pixel's angular response, as a table for the renderer or at a few angles for a person.

mod colours;
mod directions;

use std::path::{Path, PathBuf};

use clap::Args;
use quadpixel::em::PixelStack;
use quadpixel::response::{
    AngularResponse, CachedTable, ImportSettings, ResponseCache, ResponseError, ShiftSettings,
    TablePlan, TableSettings,
};
use quadpixel::sensor::{Subpixels, check_simulated};
use quadpixel::shard::Shard;
use quadpixel_datasets::paths::sanitised;

use self::colours::ColourArg;
use crate::pixel_model::PixelModelArgs;
use quadpixel_cli::exit::CommandError;
use quadpixel_cli::log::Log;
use quadpixel_cli::progress::Progress;
use quadpixel_cli::shard_env::ShardArgs;
use quadpixel_generators::assemble::pixel;

/// Arguments of `qpgen response`.
#[derive(Args)]
pub struct ResponseArgs {
    /// Pixel: a built-in name, such as 1.6um, or a TOML file (see --print-pixel).
    #[arg(long, default_value = "2.8um")]
    pixel: String,
    /// Sub-pixels, columns x rows, such as 2x1; absent: as the pixel says.
    #[arg(long)]
    subpixels: Option<Subpixels>,
    /// Which microlens of a pixel with a mosaic of colour filters (such as 1.6um-bayer; models rcwa, fdtd): that of a
    /// colour; all: one table per colour, from one simulation; absent: as the pixel says.
    #[arg(long, value_enum)]
    colour: Option<ColourArg>,
    /// With --colour bands: number of wavelengths per channel.
    #[arg(long, default_value_t = 4, value_name = "N")]
    band_wavelengths: usize,
    #[command(flatten)]
    model: PixelModelArgs,
    /// Wavelengths, nm, separated by commas, such as 450,550,650.
    #[arg(
        long,
        alias = "wavelength",
        value_delimiter = ',',
        default_value = "550"
    )]
    wavelength_nm: Vec<f64>,
    /// Number of steps between simulated directions, from the normal to the table's end, along u and along v; absent:
    /// as the preset says.
    #[arg(long)]
    grid: Option<usize>,
    /// The table's end: largest direction cosines |u| and |v|, such as 0.8; absent: as the preset says.
    #[arg(long)]
    cosine_max: Option<f64>,
    /// Makes a table of all microlens shifts (5D), for sensors whose microlenses follow the chief ray: N shifts per
    /// pitch along x and along y, even, 4 to 32. Exact from 4 n pitch / λ on, n of the layer above the silicon: 18 at
    /// 1.6 µm, 30 at 2.8 µm and 550 nm.
    #[arg(long, value_name = "N", conflicts_with = "theta_deg")]
    shifts: Option<usize>,
    /// With --shifts: F-number of the cone of light that the sub-pixels share equally.
    #[arg(long, default_value_t = 2.0, requires = "shifts")]
    cone_f_number: f64,
    /// Prints P at these angles of incidence (deg, separated by commas) and makes no table.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    theta_deg: Vec<f64>,
    /// With --theta-deg: azimuths, deg, separated by commas.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0",
        allow_negative_numbers = true
    )]
    phi_deg: Vec<f64>,
    /// Makes the table of a CSV file of another tool, with the columns theta_deg, phi_deg, subpixel, P (and
    /// wavelength_nm, if there are several).
    #[arg(long, value_name = "CSV", conflicts_with = "theta_deg")]
    import: Option<PathBuf>,
    /// With --import: the file holds a part of the directions; the pixel's symmetry gives the others.
    #[arg(long, requires = "import")]
    symmetric: bool,
    #[command(flatten)]
    shard: ShardArgs,
    /// Table to write, an .npz that NumPy reads; absent: NAME-MODEL.npz.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Prints the pixel as a TOML file with comments, to start from, and stops.
    #[arg(long)]
    print_pixel: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Computes, prints, writes.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &ResponseArgs, log: Log) -> Result<(), CommandError> {
    let mut stack = pixel(&args.pixel)?;
    if let Some(subpixels) = args.subpixels {
        check_simulated("pixel", subpixels).map_err(CommandError::input)?;
        stack.subpixels = subpixels;
    }
    let all_colours = match args.colour {
        Some(colour) => colours::choose(colour, &mut stack)?,
        None => false,
    };
    if args.print_pixel {
        return print_pixel(args, &stack);
    }
    if all_colours {
        return colours::tables(args, &stack, log);
    }
    if let Some(csv) = &args.import {
        import(args, &stack, csv)
    } else if args.theta_deg.is_empty() {
        table(args, &stack, log)
    } else {
        directions::print(args, &stack, log.json(args.json))
    }
}

fn print_pixel(args: &ResponseArgs, stack: &PixelStack) -> Result<(), CommandError> {
    let commented = PixelStack::builtin_toml(&args.pixel)
        .filter(|_| args.subpixels.is_none() && args.colour.is_none());
    match commented {
        Some(text) => print!("{text}"),
        None => {
            let text =
                toml::to_string(stack).map_err(|e| CommandError::failed(format!("pixel: {e}")))?;
            print!(
                "# `qpgen response --pixel 2.8um-tungsten --print-pixel` explains every field.\n{text}"
            );
        }
    }
    Ok(())
}

/// The settings of a preset as the arguments change them.
fn changed(args: &ResponseArgs, preset: TableSettings) -> TableSettings {
    TableSettings {
        wavelengths_nm: args.wavelength_nm.clone(),
        steps: args.grid.unwrap_or(preset.steps),
        cosine_max: args.cosine_max.unwrap_or(preset.cosine_max),
        ..preset
    }
}

/// What is tabulated: of the pixel's own lens shift, or of all.
fn settings(args: &ResponseArgs, stack: &PixelStack) -> TableSettings {
    let Some(per_pitch) = args.shifts else {
        return changed(args, args.model.table(stack));
    };
    let shifts = ShiftSettings {
        per_pitch,
        cone_f_number: args.cone_f_number,
    };
    TableSettings {
        shifts: Some(shifts),
        ..changed(args, args.model.shifted(stack, per_pitch))
    }
}

fn plan(args: &ResponseArgs, stack: &PixelStack) -> Result<TablePlan, CommandError> {
    TablePlan::new(stack, &settings(args, stack)).map_err(CommandError::input)
}

/// The table asked for, from the cache or made for it.
fn made(
    args: &ResponseArgs,
    stack: &PixelStack,
    angles: &dyn quadpixel::progress::Progress,
) -> Result<CachedTable, CommandError> {
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let made = cache.table(&plan(args, stack)?, angles);
    made.map_err(CommandError::input)
}

fn table(args: &ResponseArgs, stack: &PixelStack, log: Log) -> Result<(), CommandError> {
    let progress = Progress::new(log.json(args.json));
    let angles = |done: usize, total: usize| progress.table(done, total);
    let shard = args.shard.shard(&progress)?;
    if !shard.is_whole() {
        return part(args, &plan(args, stack)?, shard, &progress);
    }
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
        eprintln!(
            "corrected by {} exact runs: off by {:.4} rms, {:.4} at most (wave alone: {:.4}, {:.4}), each run left out in turn",
            error.runs, error.left_rms, error.left_max, error.before_rms, error.before_max
        );
    }
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| default_output(stack, args.model.name()));
    written(&made.table, &path)?;
    if args.json {
        let report = made.report.as_ref();
        println!(
            "{}",
            serde_json::json!({
                "file": path, "nodes": nodes(&made.table), "seconds": seconds, "key": made.table.meta().key,
                "from_cache": report.is_none(), "build": report, "shifts": made.table.axes().shifts_um.len(),
                "chief_ray_shifts": made.table.meta().chief_ray_shifts, "corrections": made.table.meta().corrections
            })
        );
        return Ok(());
    }
    println!(
        "{}: {} directions in {seconds:.1} s",
        path.display(),
        nodes(&made.table)
    );
    if let Some(lookup) = made.table.shifted_interpolator(args.wavelength_nm[0]) {
        println!(
            "{} lens shifts, the others by symmetry; {:.0} MB here, {:.0} MB when read by a renderer",
            made.table.axes().shifts_um.len(),
            std::mem::size_of_val(made.table.table()) as f64 * 1e-6,
            lookup.bytes() as f64 * 1e-6
        );
    }
    match made.report {
        None => println!("computed earlier and kept"),
        Some(r) => println!(
            "{} runs, {} of them kept from an earlier build; before cutting, P from {:.4} and sums up to {:.4}; interpolation cut by at most \
             {:.4}; worst residual {:.1e}, worst imbalance of power {:+.4}",
            r.runs, r.reused, r.least, r.largest_sum, r.most_cut, r.residual, r.imbalance
        ),
    }
    Ok(())
}

/// Simulates a part of the directions into the cache.
fn part(
    args: &ResponseArgs,
    plan: &TablePlan,
    shard: Shard,
    progress: &Progress,
) -> Result<(), CommandError> {
    let angles = |done: usize, total: usize| progress.table(done, total);
    let began = std::time::Instant::now();
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let part = cache.make_part(plan, shard, &angles).map_err(|e| match e {
        ResponseError::Io { .. } => CommandError::failed(e),
        other => CommandError::input(other),
    })?;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    if args.json {
        let object = serde_json::json!({
            "shard": shard.to_string(), "file": part.path, "runs": part.runs, "reused": part.reused, "seconds": seconds
        });
        println!("{object}");
    } else {
        println!(
            "shard {shard}: {} runs ({} of an earlier call) in {seconds:.1} s, kept in {}\n\
             when all shards are done, the same command with --shard 1/1 makes the table",
            part.runs,
            part.reused,
            part.path.display()
        );
    }
    Ok(())
}

fn import(args: &ResponseArgs, stack: &PixelStack, csv: &Path) -> Result<(), CommandError> {
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
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| default_output(stack, "import"));
    written(&response, &path)?;
    let wavelengths = &response.axes().wavelengths_nm;
    if args.json {
        let key = &response.meta().key;
        println!(
            "{}",
            serde_json::json!({ "file": path, "nodes": nodes(&response), "wavelengths_nm": wavelengths, "key": key })
        );
    } else {
        println!(
            "{}: {} directions at {wavelengths:?} nm from {}",
            path.display(),
            nodes(&response),
            csv.display()
        );
    }
    Ok(())
}

fn written(response: &AngularResponse, path: &Path) -> Result<(), CommandError> {
    response.write_npz(path).map_err(CommandError::failed)
}

/// `NAME-what.npz` in the working folder, whatever a file calls its pixel.
fn default_output(stack: &PixelStack, what: &str) -> PathBuf {
    PathBuf::from(format!("{}-{what}.npz", sanitised(&stack.name)))
}

fn nodes(response: &AngularResponse) -> usize {
    let axes = response.axes();
    axes.u.len() * axes.v.len() * axes.wavelengths_nm.len() * axes.shifts_um.len()
}
