//! `qpgen fit`: a camera's pixel, lens and shift law from what anybody can measure of it.

mod args;
mod known;
mod report;
mod trials;

use std::path::Path;
use std::time::Instant;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use crate::{out, outln};
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::file;
use quadpixel::response::ResponseCache;
use quadpixel_generators::camera_file::CameraFile;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_laboratory::fit::camera_file::camera_file;
use quadpixel_laboratory::fit::camera_model::{CameraModel, Fineness};
use quadpixel_laboratory::fit::capture::{CaptureDescription, EXAMPLE_TOML};
use quadpixel_laboratory::fit::goals::Goal;
use quadpixel_laboratory::fit::keeping::Keeping;
use quadpixel_laboratory::fit::measurements::Measurements;
use quadpixel_laboratory::fit::parameters::{LAYERS, with_prior};
use quadpixel_laboratory::fit::prediction::Prediction;
use quadpixel_laboratory::fit::target::DotTarget;
use quadpixel_laboratory::fit::{Fitted, fit, pictures};

pub use args::FitArgs;
use known::{known, pixel, priors};

/// Correlations that are told.
const STRONG: f64 = 0.8;

/// Fits, predicts and writes.
///
/// # Errors
/// A capture that cannot be used (2); a disk that fails (1).
pub fn run(args: &FitArgs, log: Log) -> Result<(), CommandError> {
    if args.print_capture {
        out!("{EXAMPLE_TOML}");
        return Ok(());
    }
    if args.print_target {
        out!("{}", target(args)?);
        return Ok(());
    }
    let progress = Progress::new(log.json(args.json));
    if let Some(count) = args.trials {
        return trials::trials(args, count, &progress);
    }
    let Some(path) = &args.capture else {
        return Err(CommandError::input(
            "CAPTURE is missing; see --print-capture",
        ));
    };
    let began = Instant::now();
    let description = CaptureDescription::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut measured = description.measurements(folder)?;
    match args.all {
        true => measured.hold_out_nothing(description.camera.wavelength_nm),
        false => measured.hold_out_chessboard(),
    }
    measured.check()?;
    file::probe_folder(&args.out)?;
    let camera = &description.camera;
    let (known, optics) = known(&description, folder, &measured)?;
    let stack = pixel(args, &description)?;
    let model = CameraModel::new(&stack, camera.wavelength_nm, optics, fineness(args))?;
    let mut usual = known.parameters();
    if !known.has_kernels {
        // Shifts alone do not tell layers from each other.
        for (name, value) in LAYERS.into_iter().zip(model.layers()?) {
            with_prior(&mut usual[name as usize], value, 0.0).map_err(CommandError::input)?;
        }
    }
    let parameters = priors(usual, &args.prior)?;
    let are_held = LAYERS
        .iter()
        .all(|&name| parameters[name as usize].sigma == 0.0);
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let observer: &dyn Observer = &progress;
    let keeping = Keeping {
        cache: &cache,
        progress: &observer,
    };
    // Layers that are fitted make hundreds of tables.
    let model = match are_held {
        true => model.keeping(keeping),
        false => model,
    };
    let fitted = fit(&model, &measured, &parameters, None, &progress)?;
    if measured
        .planes
        .iter()
        .any(|p| p.wavelength_nm != camera.wavelength_nm)
    {
        progress.event(Event::Info("fit: the pixel's answers in other light"));
    }
    let predicted = Prediction::new(&model, &fitted.values, &measured)?;
    let confirmed = args
        .confirm
        .then(|| confirmed(&model, keeping, &fitted, &measured, args));
    let confirmed = confirmed.transpose()?;
    let seconds = began.elapsed().as_secs_f64();
    progress.finish();
    let half_mm = (measured.sheet.iter().map(|column| column.x_mm.abs()))
        .chain(measured.fields.iter().map(|field| field.place_mm[0].abs()))
        .chain(measured.planes.iter().map(|plane| 0.5 * plane.width_mm))
        .fold(0.1, f64::max);
    let camera_file = camera_file(&description, &model, &fitted, half_mm);
    let camera_file = camera_file.map_err(CommandError::input)?;
    let report = serde_json::json!({
        "camera": camera.name, "parameters": fitted.table(), "covariance": fitted.covariance, "noise": fitted.noise,
        "correlations": fitted.correlations(STRONG), "goals": predicted.goals(), "prediction": predicted,
        "goals_by_rcwa": confirmed,
        "steps": fitted.steps, "seconds": seconds,
    });
    let picture = args.out.join("residuals.png");
    let picture = match measured.fields.is_empty() {
        true => None,
        false => Some(pictures::residuals_png(&picture, &measured, &predicted)),
    };
    let picture = picture.transpose().map_err(CommandError::failed)?;
    write(args, &report, &camera_file, picture)?;
    if args.json {
        outln!("{report}");
    } else {
        report::print(&fitted, &predicted, confirmed.as_deref(), seconds, args)?;
    }
    Ok(())
}

/// The goals by Fourier modes.
fn confirmed<'k>(
    model: &CameraModel<'k>,
    keeping: Keeping<'k>,
    fitted: &Fitted,
    measured: &Measurements,
    args: &FitArgs,
) -> Result<Vec<Goal>, CommandError> {
    let settings = match args.draft {
        true => RcwaSettings::draft(),
        false => RcwaSettings::standard(),
    };
    // This stack is not changed any more, so that its answers can be kept.
    let model = model.by_modes(settings)?.keeping(keeping);
    let predicted = Prediction::new(&model, &fitted.values, measured)?;
    Ok(predicted.goals())
}

/// The grid of dots.
fn target(args: &FitArgs) -> Result<String, CommandError> {
    let sides = args.target_mm.split_once('x');
    let sheet_mm = sides.and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let Some(sheet_mm) = sheet_mm else {
        let text = format!(
            "--target-mm is {}; allowed: such as 420x297",
            args.target_mm
        );
        return Err(CommandError::input(text));
    };
    let target = DotTarget {
        sheet_mm,
        pitch_mm: args.dot_pitch_mm,
        dot_mm: args.dot_mm,
    };
    target.svg().map_err(CommandError::input)
}

fn fineness(args: &FitArgs) -> Fineness {
    match args.draft {
        true => Fineness::draft(),
        false => Fineness::standard(),
    }
}

fn write(
    args: &FitArgs,
    report: &serde_json::Value,
    camera: &CameraFile,
    residuals: Option<Vec<u8>>,
) -> Result<(), CommandError> {
    let json = serde_json::to_vec_pretty(report).map_err(CommandError::failed)?;
    let toml = toml::to_string(camera).map_err(CommandError::failed)?;
    let mut files = vec![("fit.json", json), ("camera.toml", toml.into_bytes())];
    files.extend(residuals.map(|bytes| ("residuals.png", bytes)));
    Ok(file::write_reports(&args.out, &files)?)
}
