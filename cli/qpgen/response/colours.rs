//! Pixels in a mosaic of colour filters: which microlens a response is of, or a table of each.

use crate::exit::CommandError;
use crate::outln;
use quadpixel::em::PixelStack;
use quadpixel::em::mosaic::FilterColour;
use quadpixel::response::{AngularResponse, BuildReport, CachedTables, ResponseCache, TablePlan};
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use std::path::Path;

use super::args::{ColourArg, ResponseArgs};
use super::tables::{default_output, nodes, part, unnamed, written};
use crate::log::Log;
use crate::progress::Progress;
use quadpixel_generators::observer::Observer;

/// The default of --wavelength-nm.
const DEFAULT_NM: f64 = 550.0;

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

/// A table of each colour, NAME-MODEL-red.npz and so on, or NAME.red.npz for an output NAME.npz; or one of all bands,
/// NAME-MODEL-bands.npz.
pub(super) fn tables(
    args: &ResponseArgs,
    stack: &PixelStack,
    log: Log,
) -> Result<(), CommandError> {
    if !args.theta_deg.is_empty() || args.import.is_some() {
        return Err(CommandError::input(
            "--colour all or bands with --theta-deg or --import; allowed: tables (or one colour)",
        ));
    }
    let channels = channels(args)?;
    let plan = plan(args, stack, channels.as_ref())?;
    let progress = Progress::new(log.json(args.json));
    let angles: &dyn Observer = &progress;
    let shard = args.shard.shard(&progress)?;
    if !shard.is_whole() {
        return part(args, &plan, shard, &progress);
    }
    let began = std::time::Instant::now();
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let made = cache.tables(&plan, &angles)?;
    let seconds = began.elapsed().as_secs_f64();
    for warning in &made.warnings {
        progress.warn(&warning.to_string());
    }
    for (colour, (_, report)) in plan.colours().into_iter().zip(&made.tables) {
        if let Some(violation) = report.as_ref().and_then(BuildReport::violation) {
            let text = format!("{}: {violation}; cut in the table", colour.name());
            progress.warn(&text);
        }
    }
    progress.finish();
    let Some(channels) = channels else {
        return colour_tables(args, &plan, &made, seconds);
    };
    let tables: Vec<&AngularResponse> = made.tables.iter().map(|(table, _)| table).collect();
    let [red, green, blue] = tables[..] else {
        return Err(CommandError::failed("response: not three colours"));
    };
    let table = AngularResponse::from_channels([red, green, blue], &channels);
    let table = table.map_err(CommandError::input)?;
    let path = match &args.output {
        Some(path) => path.clone(),
        None => default_output(stack, &format!("{}-bands", args.model.name()))?,
    };
    band_table(args, &table, &path, seconds)
}

/// The bands of --colour bands.
fn channels(args: &ResponseArgs) -> Result<Option<ChannelWavelengths>, CommandError> {
    if args.colour != Some(ColourArg::Bands) {
        return Ok(None);
    }
    if args.wavelength_nm != [DEFAULT_NM] {
        return Err(CommandError::input(
            "--colour bands with --wavelength-nm; allowed: --band-wavelengths, as the bands are those of [spectrum]",
        ));
    }
    let bands = Bands {
        wavelengths: args.band_wavelengths,
        ..Bands::default()
    };
    let channels = ChannelWavelengths::from_bands(bands);
    channels.map(Some).map_err(CommandError::input)
}

fn plan(
    args: &ResponseArgs,
    stack: &PixelStack,
    channels: Option<&ChannelWavelengths>,
) -> Result<TablePlan, CommandError> {
    let mut settings = args.settings(stack);
    if let Some(channels) = channels {
        settings.wavelengths_nm = channels.all_response_nm();
    }
    TablePlan::new(stack, &settings)
        .and_then(TablePlan::of_mosaic)
        .map_err(CommandError::input)
}

fn colour_tables(
    args: &ResponseArgs,
    plan: &TablePlan,
    made: &CachedTables,
    seconds: f64,
) -> Result<(), CommandError> {
    let mut rows = Vec::new();
    for (colour, (table, report)) in plan.colours().into_iter().zip(&made.tables) {
        let colour = colour.name();
        // All names are looked at before the first is written.
        let path = match &args.output {
            Some(path) => unnamed(path.with_extension(format!("{colour}.npz")))?,
            None => default_output(plan.stack(), &format!("{}-{colour}", args.model.name()))?,
        };
        rows.push((colour, path, table, report));
    }
    for (_, path, table, _) in &rows {
        written(table, path)?;
    }
    if args.json {
        let tables = rows.iter().map(|(colour, path, table, report)| {
            serde_json::json!({
                "colour": colour, "file": path.display().to_string(), "nodes": nodes(table), "key": table.meta().key, "build": report
            })
        });
        let tables: Vec<_> = tables.collect();
        outln!(
            "{}",
            serde_json::json!({ "seconds": seconds, "tables": tables })
        );
        return Ok(());
    }
    for (colour, path, table, report) in rows {
        let sums = match report {
            Some(report) => format!("sums up to {:.4}", report.largest_sum),
            None => "computed earlier and kept".to_owned(),
        };
        outln!(
            "{}: {colour}, {} directions, {sums}",
            path.display(),
            nodes(table)
        );
    }
    outln!("{seconds:.1} s");
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
        outln!(
            "{}",
            serde_json::json!({ "seconds": seconds, "file": path.display().to_string(), "nodes": nodes(table), "wavelengths_nm": nm, "key": key })
        );
        return Ok(());
    }
    outln!(
        "{}: {} directions at {nm:?} nm, each by the microlens of its channel, {seconds:.1} s\n\
         in a dataset: [response] model = \"table\", files = [\"{}\"], and [spectrum] wavelengths = {}",
        path.display(),
        nodes(table),
        path.display(),
        args.band_wavelengths
    );
    Ok(())
}
