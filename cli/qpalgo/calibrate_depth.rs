//! `qpalgo calibrate-depth`: planes at known distances bring a curve to a real camera.

use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use crate::number::number;
use crate::outln;
use crate::progress::Progress;
use clap::Args;
use quadpixel::file;
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::dense::{BlurRatio, DenseSettings};
use quadpixel_algorithms::depth::{
    CalibrateError, DepthCalibration, FieldCurve, PlaneShifts, Shifts, calibrate_by,
};
use quadpixel_algorithms::disparity::MatchSettings;

use crate::qpalgo::inputs::{CaptureArgs, in_file};

/// Arguments of `qpalgo calibrate-depth`.
#[derive(Clone, Debug, Args)]
pub struct CalibrateDepthArgs {
    /// Planes with texture that fill the picture, square to the camera: DISTANCE_M=LEFT,RIGHT (two pictures) or
    /// DISTANCE_M=CAPTURE (a sample's folder, or a mosaic with its camera.json), the distance counted as the curve
    /// counts it; two or more.
    #[arg(required = true, value_name = "PLANE")]
    planes: Vec<String>,
    /// Curve to start from (JSON): of the simulated camera, made by `qpgen curve`. The planes are matched at every
    /// pixel, or in windows where the curve is of such shifts.
    #[arg(long)]
    curve: PathBuf,
    /// File of the calibrated curve, for `qpalgo depth --curve`.
    #[arg(long, short)]
    out: PathBuf,
    /// The pictures are in sRGB: its transfer function is undone.
    #[arg(long)]
    srgb: bool,
    /// Largest disparity looked for in windows, px.
    #[arg(long, default_value_t = 4)]
    search: usize,
    /// Replaces a file that is there; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// A plane as the user names it.
struct Plane {
    distance_m: f64,
    files: Vec<PathBuf>,
}

impl Plane {
    fn parse(text: &str) -> Result<Self, CommandError> {
        let bad = |why: &str| {
            CommandError::input(format!(
                "{text}: {why}; allowed: DISTANCE_M=LEFT,RIGHT or DISTANCE_M=CAPTURE, such as 0.6=l.png,r.png"
            ))
        };
        let (distance, files) = text.split_once('=').ok_or_else(|| bad("no ="))?;
        let files: Vec<PathBuf> = files.split(',').map(PathBuf::from).collect();
        if files.len() > 2 || files.iter().any(|file| file.as_os_str().is_empty()) {
            return Err(bad("not one or two files"));
        }
        Ok(Self {
            distance_m: number(distance).map_err(|why| bad(&why))?,
            files,
        })
    }

    fn capture(&self, srgb: bool) -> Result<Capture, CommandError> {
        match &self.files[..] {
            [left, right] => Capture::from_pair(left, right, srgb).map_err(CommandError::input),
            files => CaptureArgs::default().read(&files[0]),
        }
    }

    fn path(&self) -> &Path {
        &self.files[0]
    }
}

/// Measures the planes, fits, writes.
pub fn run(args: &CalibrateDepthArgs, progress: Progress) -> Result<(), CommandError> {
    let planes = (args.planes.iter()).map(|text| Plane::parse(text));
    let planes = planes.collect::<Result<Vec<_>, _>>()?;
    if args.out.exists() && !args.force {
        let text = format!(
            "{}: is there already; allowed: another name, or --force",
            args.out.display()
        );
        return Err(CommandError::input(text));
    }
    file::probe_file(&args.out)?;
    let text = file::read_text(&args.curve).map_err(CommandError::input)?;
    let curve = FieldCurve::from_json(&text, &args.curve.display().to_string());
    let curve = curve.map_err(CommandError::input)?;
    let measure = |capture: &Capture, ratios: Option<&BlurRatio>| match curve.matched_window_px {
        None => {
            let known = DenseSettings {
                ratio: ratios.cloned(),
                ..DenseSettings::default()
            };
            Shifts::dense(capture, &known)
        }
        Some(window_px) => {
            let settings = MatchSettings {
                window_px,
                search_px: args.search,
                ..MatchSettings::default()
            };
            Shifts::measure(capture, &settings, &|_| ())
        }
    };
    let mut captures = Vec::new();
    for plane in &planes {
        progress.stage(format!("reading {}", plane.path().display()));
        let capture = plane.capture(args.srgb)?;
        if let Some(view) = capture.views.images().first()
            && (view.width(), view.height()) != (curve.width_px, curve.height_px)
        {
            let size = CalibrateError::Size {
                distance_m: plane.distance_m,
                size: format!("{} x {}", view.width(), view.height()),
                curve: format!("{} x {}", curve.width_px, curve.height_px),
            };
            return Err(in_file(plane.path())(size));
        }
        captures.push(capture);
    }
    let found = calibrate_by(&curve, |ratios| {
        let matched = planes.iter().zip(&captures).map(|(plane, capture)| {
            progress.stage(format!("matching {}", plane.path().display()));
            let shifts = measure(capture, ratios).map_err(in_file(plane.path()))?;
            let left_right = shifts.left_right.ok_or_else(|| {
                in_file(plane.path())("the pixels are not parted into left and right")
            })?;
            Ok(PlaneShifts {
                distance_m: plane.distance_m,
                size_px: shifts.size_px,
                shifts: left_right,
            })
        });
        matched.collect::<Result<Vec<_>, CommandError>>()
    })?;
    let encoded = serde_json::to_vec(&found.curve).map_err(CommandError::failed)?;
    file::write_aside(&args.out, &encoded)?;
    drop(progress);
    report(args, &found)
}

fn report(args: &CalibrateDepthArgs, found: &DepthCalibration) -> Result<(), CommandError> {
    let ([g, sigma_g], [delta, sigma_delta]) = (found.gain, found.shift_per_m);
    let [least, largest] = found.gain_range;
    // 1/Z of the focus, less the curve's, is −δ.
    let [farthest, nearest] = [found.shift_range_per_m[1], found.shift_range_per_m[0]].map(|d| -d);
    if args.json {
        let object = serde_json::json!({
            "file": args.out.display().to_string(), "gain": g, "gain_sigma": sigma_g,
            "gain_range": found.gain_range, "focus_shift_per_m": -delta,
            "focus_shift_sigma_per_m": sigma_delta, "focus_shift_range_per_m": [farthest, nearest],
            "rms_px": found.rms_px, "matching_error_px": found.curve.matching_error_px, "parts": found.parts,
        });
        outln!("{object}");
        return Ok(());
    }
    outln!("distance m   at px          measured px   before     after");
    for p in &found.parts {
        let [x, y] = p.at_px;
        outln!(
            "{:<12} {x:>6.0}, {y:<6.0} {:>11.3} {:>10.3} {:>9.3}",
            p.distance_m,
            p.measured_px,
            p.before_px,
            p.after_px
        );
    }
    outln!(
        "{}: gain {g:.4} ± {sigma_g:.4} ({least:.3} to {largest:.3} over the picture), focus {:+.4} ± {sigma_delta:.4} per m from the curve's ({farthest:+.4} to {nearest:+.4}); {:.3} px RMS left",
        args.out.display(),
        -delta,
        found.rms_px
    );
    Ok(())
}
