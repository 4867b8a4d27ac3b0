//! Pixels in a mosaic of colour filters: which microlens a response is of, or a table of each.

use clap::ValueEnum;
use quadpixel::command::CommandError;
use quadpixel::em::PixelStack;
use quadpixel::em::mosaic::FilterColour;
use quadpixel::response::{AngularResponse, build_mosaic_tables};
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use std::path::Path;

use super::{ResponseArgs, changed, default_output, nodes, written};
use quadpixel_cli::log::Log;
use quadpixel_cli::progress::Progress;

/// The default of --wavelength-nm.
const DEFAULT_NM: f64 = 550.0;

/// Whose response.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ColourArg {
    Red,
    /// The mean of both greens.
    Green,
    Blue,
    All,
    /// One table for a dataset whose channels are bands (`[spectrum]`): each wavelength of a band under the filter of its colour.
    Bands,
}

/// Sets the colour that the pixel's response is of; whether it is all.
pub(super) fn choose(colour: ColourArg, stack: &mut PixelStack) -> Result<bool, CommandError> {
    let Some(mosaic) = &mut stack.mosaic else {
        return Err(CommandError::input(format!(
            "--colour with the pixel {}; allowed: a pixel with [mosaic], such as 1.6um-bayer",
            stack.name
        )));
    };
    let one = match colour {
        ColourArg::Red => FilterColour::Red,
        ColourArg::Green => FilterColour::Green,
        ColourArg::Blue => FilterColour::Blue,
        ColourArg::All | ColourArg::Bands => return Ok(true),
    };
    mosaic.colour = one;
    Ok(false)
}

/// A table of each colour, NAME-MODEL-red.npz and so on, or NAME.red.npz for an output NAME.npz; or one of all bands, NAME-MODEL-bands.npz.
pub(super) fn tables(
    args: &ResponseArgs,
    stack: &PixelStack,
    log: Log,
) -> Result<(), CommandError> {
    if !args.theta_deg.is_empty() || args.shifts.is_some() || args.import.is_some() {
        return Err(CommandError::input(
            "--colour all with --theta-deg, --shifts or --import; allowed: tables of one lens shift (or one colour)",
        ));
    }
    let bands = args.colour == Some(ColourArg::Bands);
    if bands && args.wavelength_nm != [DEFAULT_NM] {
        return Err(CommandError::input(
            "--colour bands with --wavelength-nm; allowed: --band-wavelengths, as the bands are those of [spectrum]",
        ));
    }
    let mut settings = changed(args, args.model.table(stack));
    let channels = ChannelWavelengths::of_bands(Bands {
        wavelengths: args.band_wavelengths,
        ..Bands::default()
    })
    .map_err(CommandError::input)?;
    if bands {
        settings.wavelengths_nm = channels.all_response_nm();
    }
    let progress = Progress::new(log.json(args.json));
    let angles = |done: usize, total: usize| progress.table(done, total);
    if !args.shard.shard(&progress)?.is_whole() {
        return Err(CommandError::input(
            "--colour all with --shard; allowed: parts of tables of one colour",
        ));
    }
    let began = std::time::Instant::now();
    let made = build_mosaic_tables(stack, &settings, &angles).map_err(CommandError::input)?;
    let seconds = began.elapsed().as_secs_f64();
    for colour in FilterColour::ALL {
        if let Some(violation) = made.of(colour).report.violation() {
            let text = format!("{}: {violation}; cut in the table", colour.name());
            progress.warn(&text);
        }
    }
    if bands {
        progress.finish();
        let table = (made.of_channels(&channels)).map_err(CommandError::input)?;
        let path = args.output.clone();
        let path =
            path.unwrap_or_else(|| default_output(stack, &format!("{}-bands", args.model.name())));
        return band_table(args, &table, &path, seconds);
    }
    let mut rows = Vec::new();
    for colour in FilterColour::ALL {
        let built = made.of(colour);
        let path = match &args.output {
            Some(path) => path.with_extension(format!("{}.npz", colour.name())),
            None => default_output(stack, &format!("{}-{}", args.model.name(), colour.name())),
        };
        written(&built.table, &path)?;
        rows.push((colour.name(), path, built));
    }
    progress.finish();
    if args.json {
        let tables = rows.iter().map(|(colour, path, built)| {
            serde_json::json!({
                "colour": colour, "file": path, "nodes": nodes(&built.table), "key": built.table.meta().key, "build": built.report
            })
        });
        let tables: Vec<_> = tables.collect();
        println!(
            "{}",
            serde_json::json!({ "seconds": seconds, "tables": tables })
        );
        return Ok(());
    }
    for (colour, path, built) in rows {
        println!(
            "{}: {colour}, {} directions, sums up to {:.4}",
            path.display(),
            nodes(&built.table),
            built.report.largest_sum
        );
    }
    println!("{seconds:.1} s");
    Ok(())
}

fn band_table(
    args: &ResponseArgs,
    table: &AngularResponse,
    path: &Path,
    seconds: f64,
) -> Result<(), CommandError> {
    written(table, path)?;
    let nm = &table.axes().wavelengths_nm;
    if args.json {
        let key = &table.meta().key;
        println!(
            "{}",
            serde_json::json!({ "seconds": seconds, "file": path, "nodes": nodes(table), "wavelengths_nm": nm, "key": key })
        );
        return Ok(());
    }
    println!(
        "{}: {} directions at {nm:?} nm, each by the microlens of its channel, {seconds:.1} s\n\
         in a dataset: [response] model = \"table\", files = [\"{}\"], and [spectrum] wavelengths = {}",
        path.display(),
        nodes(table),
        path.display(),
        args.band_wavelengths
    );
    Ok(())
}
