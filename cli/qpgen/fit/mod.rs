//! `qpgen fit`: a camera's pixel, lens and shift law from what anybody can measure of it.

mod report;
mod trials;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::exit::CommandError;
use crate::log::Log;
use crate::number::number;
use crate::progress::Progress;
use crate::{out, outln};
use clap::Args;
use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::file;
use quadpixel::response::ResponseCache;
use quadpixel_generators::camera_file::CameraFile;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_laboratory::fit::camera_file::camera_file;
use quadpixel_laboratory::fit::camera_model::{CameraModel, Fineness, Optics};
use quadpixel_laboratory::fit::capture::{CaptureDescription, EXAMPLE_TOML};
use quadpixel_laboratory::fit::conjugates::Conjugates;
use quadpixel_laboratory::fit::goals::Goal;
use quadpixel_laboratory::fit::keeping::Keeping;
use quadpixel_laboratory::fit::measurements::{Measurements, sum_of};
use quadpixel_laboratory::fit::parameters::{Known, LAYERS, Parameter, with_prior};
use quadpixel_laboratory::fit::prediction::Prediction;
use quadpixel_laboratory::fit::target::DotTarget;
use quadpixel_laboratory::fit::{Fitted, fit, pictures};

/// Correlations that are told.
const STRONG: f64 = 0.8;

/// Arguments of `qpgen fit`.
#[derive(Args)]
pub struct FitArgs {
    /// What was captured (TOML, see --print-capture): measured kernels of both views over the field and white sheets,
    /// textured planes at known distances, or all of these; the files that it names stand beside it.
    #[arg(required_unless_present_any = ["print_capture", "print_target", "trials"])]
    capture: Option<PathBuf>,
    /// Prints the grid of dots that is photographed out of focus (SVG in mm, white on black), and ends.
    #[arg(
        long,
        conflicts_with_all = [
            "capture", "print_capture", "out", "all", "prior", "pixel", "draft", "confirm", "trials", "seed", "json",
        ]
    )]
    print_target: bool,
    /// Sheet of --print-target, mm, such as 297x210.
    #[arg(
        long,
        default_value = "420x297",
        value_name = "WxH",
        requires = "print_target"
    )]
    target_mm: String,
    /// Distance of its dots, mm: on the sensor at least 1.4 widths of a dot out of focus.
    #[arg(value_parser = number, long, default_value_t = 20.0, requires = "print_target")]
    dot_pitch_mm: f64,
    /// Diameter of its dots, mm: in focus a pixel or less on the sensor.
    #[arg(value_parser = number, long, default_value_t = 1.0, requires = "print_target")]
    dot_mm: f64,
    /// Prints an example of the description, with every field, and ends.
    #[arg(long, conflicts_with_all = ["capture", "out", "all", "prior", "pixel", "draft", "confirm", "trials", "seed", "json"])]
    print_capture: bool,
    /// Folder of what is found: camera.toml (which --camera of other commands takes, and --pixel for its pixel),
    /// fit.json (parameters, covariance, goals, predictions) and residuals.png.
    #[arg(long, short, default_value = "camera")]
    out: PathBuf,
    /// Fits everything but planes of another wavelength. Absent: every other field, as the squares of a chessboard, the
    /// right half of the sheet, and planes with held_out are kept out and predicted.
    #[arg(long)]
    all: bool,
    /// Prior of a parameter instead of its usual one, such as silicon_um=3,0.5; a deviation of 0 holds it.
    #[arg(long, value_name = "NAME=VALUE,SIGMA")]
    prior: Vec<String>,
    /// Pixel (built-in name or TOML) whose layers are the start, and stay with planes alone: of 2x1 sub-pixels, with a
    /// layer named oxide or wiring, alone or under a mosaic of colour filters; absent: a thin one without.
    #[arg(long)]
    pixel: Option<PathBuf>,
    /// Coarser waves and pupil: a quick look.
    #[arg(long)]
    draft: bool,
    /// Predicts what was kept out by Fourier modes (rcwa), too, with the values that were found by waves: minutes more.
    #[arg(long, conflicts_with = "trials")]
    confirm: bool,
    /// Checks the fit itself: draws so many cameras from the priors, captures them with noise, fits them blind, and
    /// says how far the fits are from what was drawn.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    trials: Option<u64>,
    /// Seed of the first drawn camera.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

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

fn pixel(args: &FitArgs, description: &CaptureDescription) -> Result<PixelStack, CommandError> {
    let Some(path) = &args.pixel else {
        return Ok(description.pixel());
    };
    let name = path.to_str().unwrap_or_default();
    if PixelStack::builtin_toml(name).is_some() {
        return PixelStack::builtin(name).map_err(CommandError::input);
    }
    let text = file::read_text(path).map_err(CommandError::input)?;
    PixelStack::from_toml(&text, &path.display().to_string()).map_err(CommandError::input)
}

/// What is known of the camera before the fit.
fn known(
    description: &CaptureDescription,
    folder: &Path,
    measured: &Measurements,
) -> Result<(Known, Optics), CommandError> {
    let camera = &description.camera;
    let mut conjugates = Conjugates {
        focal_length_mm: camera.focal_length_mm,
        hiatus_mm: 0.0,
    };
    let mut pupil_mm = None;
    if let Some(lens) = description.lens(folder)? {
        let lens = lens
            .paraxial(camera.wavelength_nm)
            .map_err(CommandError::input)?;
        // A lens that stands in for another one is scaled to its focal length.
        let scale = camera.focal_length_mm / lens.efl_mm;
        conjugates.hiatus_mm = scale * (lens.rear_principal_z_mm - lens.front_principal_z_mm);
        let picture_mm = lens.rear_principal_z_mm + lens.efl_mm;
        pupil_mm = Some(scale * (picture_mm - lens.exit_pupil_z_mm));
    }
    let has_kernels = !measured.fields.is_empty();
    let disk_px = match has_kernels {
        true => middle_disk_px(measured),
        false => largest_disk_px(description, &conjugates),
    };
    let known = Known {
        pitch_um: camera.pitch_um,
        f_number: camera.f_number,
        disk_px,
        focal_length_mm: camera.focal_length_mm,
        pupil_mm: pupil_mm.filter(|mm| *mm > 0.0 && mm.is_finite()),
        focus_mm: camera.focus_mm.filter(|_| !measured.planes.is_empty()),
        has_kernels,
    };
    let optics = Optics {
        f_number: camera.f_number,
        unit_mm: known.unit_mm(),
        side: measured.side,
        view_pixel_um: measured.view_pixel_um,
        collected_at: camera.collected_at,
        conjugates,
    };
    Ok((known, optics))
}

/// Diameter of the largest disk of the planes, px.
fn largest_disk_px(description: &CaptureDescription, lens: &Conjugates) -> f64 {
    let focus_mm = description.camera.focus_mm.unwrap_or(f64::NAN);
    let tangent = 0.5 / description.camera.f_number;
    let radius = |mm: f64| lens.disk_radius_mm(focus_mm, mm, tangent).abs();
    let radii = description
        .planes
        .iter()
        .map(|plane| radius(plane.distance_mm));
    2e3 * radii.fold(0.0, f64::max) / description.views.pixel_um
}

/// Diameter of the disk in the middle of the picture, px.
fn middle_disk_px(measured: &Measurements) -> f64 {
    let [columns, rows] = measured.grid;
    let field = &measured.fields[rows / 2 * columns + columns / 2];
    let sum = sum_of(&field.views, field.left_part);
    let figures = quadpixel_laboratory::fit::figures::FieldFigures::new(
        &[sum.clone(), sum],
        0.5,
        measured.side,
    );
    figures.disk_px
}

/// The usual priors, but for those that are given.
fn priors(
    mut parameters: Vec<Parameter>,
    given: &[String],
) -> Result<Vec<Parameter>, CommandError> {
    for text in given {
        let refused = |why: String| CommandError::input(format!("--prior {text}: {why}"));
        let parts = text.split_once('=').and_then(|(name, numbers)| {
            let (value, sigma) = numbers.split_once(',')?;
            Some((name, value.parse().ok()?, sigma.parse().ok()?))
        });
        let Some((name, value, sigma)) = parts else {
            return Err(refused("allowed: such as silicon_um=3,0.5".into()));
        };
        let names: Vec<String> = parameters.iter().map(|p| p.name.clone()).collect();
        let found = parameters.iter_mut().find(|p| p.name == name);
        let Some(parameter) = found else {
            return Err(refused(format!(
                "there is no such parameter; there are: {}",
                names.join(", ")
            )));
        };
        with_prior(parameter, value, sigma).map_err(|e| refused(e.to_string()))?;
    }
    Ok(parameters)
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
