//! `qpalgo table`: a list of captures in, Table 2 out.

use crate::number::number;
use crate::{out, outln};
use std::path::{Path, PathBuf};

use clap::Args;
use quadpixel::file;

use crate::exit::CommandError;
use crate::progress::Progress;
use crate::qpalgo::correct::{not_corrected, smoothing};
use crate::qpalgo::inputs::{AlignArg, CaptureArgs, in_file};
use quadpixel_algorithms::calibration::CalibrationSettings;
use quadpixel_algorithms::disparity::MatchSettings;
use quadpixel_algorithms::metrics::sharpness::SharpnessSettings;
use quadpixel_algorithms::table::{self, Entry, Row, RowError, TableList, csv, markdown};

/// Arguments of `qpalgo table`.
#[derive(Clone, Debug, Args)]
pub struct TableArgs {
    /// TOML with one `[[row]]` per measurement: setup, position, calibration, capture (samples' folders, relative to
    /// the list).
    list: PathBuf,
    /// Folder to write: table.md and table.csv.
    #[arg(long, short)]
    out: PathBuf,
    /// Sharpness preset: wee-abstract or table-2.
    #[arg(long, default_value = SharpnessSettings::PRESETS[1])]
    preset: String,
    /// Largest shift looked for, px.
    #[arg(long, default_value_t = CalibrationSettings::default().matching.search_px)]
    search: usize,
    /// Degree of the field's polynomial, 0 to 6.
    #[arg(long, default_value_t = CalibrationSettings::default().degree)]
    degree: usize,
    /// What to line up: the chart's texture by block matching, as the paper does, or the centroids of the spots.
    #[arg(long, value_enum, default_value_t = AlignArg::Texture)]
    align: AlignArg,
    /// With --align centroid: smoothing before centroids are fitted (σ, px, 1.5 to 100); absent: as views ask for.
    #[arg(value_parser = number, long)]
    smoothing: Option<f64>,
    /// Prints one JSON object on stdout instead of the table.
    #[arg(long)]
    json: bool,
}

/// Calibrates and corrects each row's capture; no file is written before all are done.
pub fn run(args: &TableArgs, progress: Progress) -> Result<(), CommandError> {
    let input = |text: String| CommandError::input(text);
    let bytes = file::read(&args.list).map_err(|e| input(e.to_string()))?;
    let bad = |text: String| input(format!("{}: {text}", args.list.display()));
    let text = String::from_utf8(bytes).map_err(|e| bad(e.to_string()))?;
    let list: TableList =
        toml::from_str(&text).map_err(|e| bad(e.to_string().trim_end().replace('\n', " ")))?;
    if list.row.is_empty() {
        return Err(bad("row is []; allowed: at least one row".into()));
    }
    let sharpness: SharpnessSettings =
        (args.preset.parse()).map_err(|e| input(format!("--preset: {e}")))?;
    let settings = CalibrationSettings {
        matching: MatchSettings {
            search_px: args.search,
            ..CalibrationSettings::default().matching
        },
        degree: args.degree,
        align: args.align.into(),
        smoothing_px: smoothing(args.smoothing, args.align)?,
    };
    let folder = args.list.parent().unwrap_or(Path::new(""));
    let rows = (list.row.iter().enumerate())
        .map(|(i, entry)| {
            let (setup, position) = (&entry.setup, &entry.position);
            progress.stage(format!(
                "row {}/{}: {setup}, {position}",
                i + 1,
                list.row.len()
            ));
            measure(entry, folder, &settings, &sharpness)
        })
        .collect::<Result<Vec<Row>, _>>()?;
    let table = markdown(&rows);
    let files = [
        ("table.md", table.clone().into_bytes()),
        ("table.csv", csv(&rows).into_bytes()),
    ];
    file::write_reports(&args.out, &files)?;
    drop(progress);
    if args.json {
        outln!(
            "{}",
            serde_json::json!({ "preset": sharpness, "rows": rows })
        );
    } else {
        out!("{table}");
    }
    Ok(())
}

fn measure(
    entry: &Entry,
    folder: &Path,
    settings: &CalibrationSettings,
    sharpness: &SharpnessSettings,
) -> Result<Row, CommandError> {
    let [chart_path, path] = [&entry.calibration, &entry.capture].map(|p| folder.join(p));
    let source = CaptureArgs::default();
    let (chart, capture) = (source.read(&chart_path)?, source.read(&path)?);
    let sharpness = table::measure(&chart, &capture, settings, sharpness).map_err(|e| match e {
        RowError::Chart(error) => in_file(&chart_path)(error),
        RowError::Correct(error) => not_corrected(&path)(error),
        error => in_file(&path)(error),
    })?;
    Ok(Row {
        setup: entry.setup.clone(),
        position: entry.position.clone(),
        sharpness,
    })
}
