//! `qpalgo autofocus`: a dataset's focus stacks in, sharpness and phase curves of each out.

mod measured;
mod plot;
mod report;

use crate::{out, outln};
use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use clap::Args;
use quadpixel::file;
use quadpixel_datasets::{DatasetManifest, paths};

use crate::progress::Progress;
use measured::measure;
use quadpixel_algorithms::autofocus::Region;
use quadpixel_algorithms::disparity::MatchSettings;
use quadpixel_algorithms::metrics::sharpness::SharpnessSettings;
use report::Curve;

/// Arguments of `qpalgo autofocus`.
#[derive(Clone, Debug, Args)]
pub struct AutofocusArgs {
    /// Folder of a dataset with focus stacks (`[sweep]` in its configuration): scenes of three samples or more.
    dataset: PathBuf,
    /// Folder to write: autofocus.csv (one line per sample), focus.csv (one line per scene), SCENE.svg.
    #[arg(long, short)]
    out: PathBuf,
    /// Part of the picture that is to be in focus: x,y,width,height in px of a view; absent: the middle half.
    #[arg(long, value_parser = region)]
    region: Option<Region>,
    /// Sharpness preset: wee-abstract or table-2.
    #[arg(long, default_value = SharpnessSettings::PRESETS[0])]
    preset: String,
    /// Side of the matching window, px: odd, 5 to 31.
    #[arg(long, default_value_t = 21)]
    window: usize,
    /// Largest phase difference looked for, px.
    #[arg(long, default_value_t = 8)]
    search: usize,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

fn region(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) => Ok(Region {
            x,
            y,
            width,
            height,
        }),
        _ => Err("must be x,y,width,height in px, such as 32,24,64,48".into()),
    }
}

/// Measures every stack; no file is written before all are made.
pub fn run(args: &AutofocusArgs, progress: Progress) -> Result<(), CommandError> {
    let kind: SharpnessSettings =
        (args.preset.parse()).map_err(|e| CommandError::input(format!("--preset: {e}")))?;
    let settings = MatchSettings {
        window_px: args.window,
        search_px: args.search,
        ..MatchSettings::default()
    };
    let mut curves = Vec::new();
    for (scene, samples) in stacks(&args.dataset)? {
        let mut measured = Vec::new();
        for sample in &samples {
            progress.stage(format!("{scene}: sample {sample}"));
            let folder = args.dataset.join(paths::SAMPLES).join(sample);
            measured.push(measure(sample, &folder, args.region, &settings, &kind)?);
        }
        measured.sort_by(|a, b| a.step.focus_per_m.total_cmp(&b.step.focus_per_m));
        curves.push(Curve::new(scene, measured));
    }
    let mut files = vec![
        (
            "autofocus.csv".to_owned(),
            report::samples_csv(&curves).into_bytes(),
        ),
        (
            "focus.csv".to_owned(),
            report::scenes_csv(&curves).into_bytes(),
        ),
    ];
    files.extend(curves.iter().map(|curve| {
        let name = format!("{}.svg", paths::sanitised(&curve.scene));
        (name, plot::curves(curve).into_bytes())
    }));
    file::write_reports(&args.out, &files)?;
    drop(progress);
    if args.json {
        outln!(
            "{}",
            serde_json::json!({ "preset": kind, "scenes": curves })
        );
    } else {
        out!("{}", report::words(&curves));
    }
    Ok(())
}

/// The scenes of three samples or more, with the names of their samples in order.
fn stacks(root: &Path) -> Result<Vec<(String, Vec<String>)>, CommandError> {
    let path = root.join(paths::DATASET);
    let named = |what: String| CommandError::input(format!("{}: {what}", path.display()));
    let bytes = file::read(&path).map_err(CommandError::input)?;
    let manifest: DatasetManifest =
        serde_json::from_slice(&bytes).map_err(|e| named(e.to_string()))?;
    let mut stacks: Vec<(String, Vec<String>)> = Vec::new();
    for entry in manifest.samples {
        paths::checked_name(&entry.id).map_err(|e| named(e.to_string()))?;
        match stacks.iter_mut().find(|(scene, _)| *scene == entry.scene) {
            Some((_, samples)) => samples.push(entry.id),
            None => stacks.push((entry.scene, vec![entry.id])),
        }
    }
    stacks.retain(|(_, samples)| samples.len() >= 3);
    if stacks.is_empty() {
        let what = "no scene has three samples or more; allowed: a dataset of focus stacks, [sweep] in its configuration";
        return Err(named(what.into()));
    }
    Ok(stacks)
}
