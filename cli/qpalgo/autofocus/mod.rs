//! `qpalgo autofocus`: a dataset's focus stacks in, sharpness and phase curves of each out.

mod plot;
mod report;

use std::path::{Path, PathBuf};

use clap::Args;
use quadpixel::file;
use quadpixel::image::exr::read_layers;
use quadpixel::image::views::Side;
use quadpixel_cli::exit::CommandError;
use quadpixel_datasets::{DatasetManifest, paths};

use crate::inputs::{CaptureArgs, in_file};
use quadpixel_algorithms::autofocus::{Region, Step, measure_step, median};
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::disparity::MatchSettings;
use quadpixel_algorithms::metrics::sharpness::SharpnessSettings;
use quadpixel_cli::progress::Progress;
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

/// What the sample's own maps say of the region, for comparison: medians, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
struct Truth {
    /// Signed circle of confusion: the defocus.
    coc_px: Option<f64>,
    /// x_L − x_R by the traced rays.
    shift_px: Option<f64>,
}

/// One sample of a curve.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
struct Measured {
    sample: String,
    #[serde(flatten)]
    step: Step,
    truth: Truth,
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
    file::write_folder(&args.out, &files)?;
    drop(progress);
    if args.json {
        println!(
            "{}",
            serde_json::json!({ "preset": kind, "scenes": curves })
        );
    } else {
        print!("{}", report::words(&curves));
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

fn measure(
    sample: &str,
    folder: &Path,
    region: Option<Region>,
    settings: &MatchSettings,
    kind: &SharpnessSettings,
) -> Result<Measured, CommandError> {
    let capture = CaptureArgs::default().read(folder)?;
    let [width, height] = capture.size_px();
    let region = region.unwrap_or(Region::middle(width, height));
    if !region.fits(width, height) {
        return Err(in_file(folder)(format!(
            "--region does not lie in a view; allowed: inside {width} × {height} px"
        )));
    }
    let step = measure_step(&capture, region, settings, kind).map_err(in_file(folder))?;
    // The truth is looked at last: nothing above depends on it.
    Ok(Measured {
        sample: sample.to_owned(),
        step,
        truth: truth(folder, &capture, region)?,
    })
}

fn truth(folder: &Path, capture: &Capture, region: Region) -> Result<Truth, CommandError> {
    let [width, _] = capture.size_px();
    let read = |name: &str| read_layers(&folder.join(name)).map_err(CommandError::input);
    let middle = |value: &dyn Fn(usize) -> f64| {
        median(
            region
                .pixels(width)
                .map(value)
                .filter(|v| v.is_finite())
                .collect(),
        )
    };
    let mut truth = Truth::default();
    if folder.join("coc.exr").is_file() {
        let layers = read("coc.exr")?;
        let map = layers.first().map(|l| &l.image);
        let at = |i| {
            map.and_then(|m| m.data().get(i))
                .map_or(f64::NAN, |&v| f64::from(v))
        };
        truth.coc_px = middle(&at);
    }
    if folder.join("disparity.exr").is_file() {
        let layers = read("disparity.exr")?;
        let subpixels = capture.views.subpixels();
        let mean = |side: Side, i: usize| {
            let members = side.members(subpixels);
            let dx = |v: &usize| {
                let layer = layers.iter().find(|l| l.name == subpixels.name(*v));
                let at = layer.and_then(|l| {
                    let channel = l.channels.iter().position(|c| c == "dx")?;
                    l.image.data().get(i * l.channels.len() + channel)
                });
                at.map_or(f64::NAN, |&v| f64::from(v))
            };
            members.iter().map(dx).sum::<f64>() / members.len() as f64
        };
        truth.shift_px = middle(&|i| mean(Side::Left, i) - mean(Side::Right, i));
    }
    Ok(truth)
}
