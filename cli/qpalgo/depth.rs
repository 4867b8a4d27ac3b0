//! `qpalgo depth`: a capture in, metric depth and its confidence out.

use crate::number::number;
use crate::outln;
use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use clap::Args;
use quadpixel::file;
use quadpixel::image::colour::viridis;
use quadpixel::image::raster::encode_png8;
use quadpixel::image::{Image, ImageError};

use crate::progress::Progress;
use crate::qpalgo::inputs::{
    CaptureArgs, MapFormatArg, calibrated_camera, in_file, read_calibration, sample_folder,
};
use crate::qpalgo::network::NetworkArgs;
use quadpixel_algorithms::calibration::Calibration;
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::dense::DenseSettings;
use quadpixel_algorithms::depth::{
    CameraCurve, CurveError, DepthMaps, DepthScore, DescribedCurve, FieldCurve, ParaxialCurve,
    ShiftError, Shifts,
};
use quadpixel_algorithms::disparity::{Axes, MatchSettings};
use quadpixel_algorithms::maps::{MapFormat, Maps};
use quadpixel_datasets::CameraDescription;

/// Arguments of `qpalgo depth`.
#[derive(Clone, Debug, Args)]
pub struct DepthArgs {
    /// A sample's folder, or a mosaic with camera.json beside it: lens, focus and the pixel's ratio are read from it.
    #[arg(required_unless_present = "left")]
    capture: Option<PathBuf>,
    /// Left view of a camera without description.
    #[arg(long, requires_all = ["right", "curve"], conflicts_with_all = ["capture", "calibration"])]
    left: Option<PathBuf>,
    /// Its right view.
    #[arg(long, requires = "left")]
    right: Option<PathBuf>,
    /// The views are pictures in sRGB: its transfer function is undone.
    #[arg(long, requires = "left")]
    srgb: bool,
    /// Curve file: the camera's disparity against distance over the field (JSON, see docs/guide/captures.md), in place
    /// of the description's numbers; depth then counts from where the file says.
    #[arg(long, conflicts_with_all = ["kappa", "score"])]
    curve: Option<PathBuf>,
    /// Folder to write: depth.FORMAT (Z, m), confidence.FORMAT (0 to 1, standard deviation of Z in m, disparity in px),
    /// depth.png. There is a depth at every pixel whose disparity is one of this camera; NaN elsewhere.
    #[arg(long, short)]
    out: PathBuf,
    /// Kind of file for the numbers.
    #[arg(long, value_enum, default_value_t = MapFormatArg::Exr)]
    format: MapFormatArg,
    /// Description of the camera, as a sample's camera.json: lens, focus, and the ratio of disparity to circle of
    /// confusion; absent: the camera.json beside the capture.
    #[arg(long, conflicts_with = "left")]
    camera: Option<PathBuf>,
    /// Ratio of disparity to circle of confusion, of a lens without aberrations; absent: the camera's own disparity
    /// against distance, aberrations included, from its description.
    #[arg(value_parser = number, long)]
    kappa: Option<f64>,
    /// Calibration file: takes the aberration's own disparity out first; the rest is converted by the ratio. With
    /// --sparse.
    #[arg(long, requires = "sparse")]
    calibration: Option<PathBuf>,
    /// Only where windows match surely, as `qpalgo disparity` does; NaN elsewhere. Absent: at every pixel, as
    /// `qpalgo disparity --dense` does.
    #[arg(long, conflicts_with = "network")]
    sparse: bool,
    #[command(flatten)]
    network: NetworkArgs,
    /// Side of the matching window, px: odd, 5 to 31. With --sparse.
    #[arg(long, default_value_t = 21, requires = "sparse")]
    window: usize,
    /// Largest disparity looked for, px. With --sparse.
    #[arg(long, default_value_t = 4, requires = "sparse")]
    search: usize,
    /// Pixels from match to match; pixels between them take the nearest. With --sparse.
    #[arg(long, default_value_t = 2, requires = "sparse")]
    stride: usize,
    /// Compares with the sample's depth.exr, after all is estimated.
    #[arg(long)]
    score: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Measures, converts, writes; no file is written before all are made.
pub fn run(args: &DepthArgs, progress: Progress) -> Result<(), CommandError> {
    let network = args.network.read()?;
    let path =
        (args.capture.as_ref().or(args.left.as_ref())).map_or(Path::new(""), PathBuf::as_path);
    progress.stage(format!("reading {}", path.display()));
    let capture = match (&args.left, &args.right) {
        (Some(left), Some(right)) => {
            Capture::from_pair(left, right, args.srgb).map_err(CommandError::input)?
        }
        _ => CaptureArgs::with_camera(args.camera.as_ref()).read(path)?,
    };
    let curve = match &args.curve {
        Some(path) => {
            let curve = field_curve(path, &capture)?;
            if let Some(warning) = unlike(args, &curve) {
                progress.warn(&format!("{}: {warning}", path.display()));
            }
            CameraCurve::Field(curve)
        }
        None => camera_curve(args, path, &capture)?,
    };
    let calibration = (args.calibration.as_ref())
        .map(|file| calibration(file, path, &capture))
        .transpose()?;
    let settings = MatchSettings {
        window_px: args.window,
        stride_px: args.stride,
        search_px: args.search,
        ..MatchSettings::default()
    };
    let known = match &curve {
        CameraCurve::Field(curve) => curve.dense_settings(),
        CameraCurve::Described(_) | CameraCurve::Paraxial(_) => DenseSettings::default(),
    };
    let mut shifts = if args.sparse && network.is_none() {
        sparse(&capture, &settings, &progress)
    } else {
        progress.stage("matching");
        match &network {
            Some(network) => Shifts::learned(&capture, &known, network),
            None => Shifts::dense(&capture, &known),
        }
    }
    .map_err(in_file(path))?;
    if let Some(calibration) = &calibration {
        shifts = (shifts.without_aberration(&capture, calibration)).map_err(in_file(path))?;
    }
    let maps = DepthMaps::new(&shifts, &curve, settings.limits.deviation_px);
    progress.stage("encoding the maps");
    let files = files(args.format.into(), &maps).map_err(CommandError::failed)?;
    // The truth is looked at last: nothing above depends on it.
    let score = match (sample_folder(path, &capture), &curve) {
        (_, CameraCurve::Field(_)) => None,
        (Some(sample), _) if args.score => {
            let truth = sample.join("depth.exr");
            let curve = paraxial_curve(args.kappa, path, &capture)?;
            Some(DepthScore::read(&truth, &maps.depth_m, &curve).map_err(CommandError::input)?)
        }
        _ => None,
    };
    file::write_reports(&args.out, &files)?;
    drop(progress);
    report(args, &files, &maps, &curve, score)
}

/// What is said where a curve is not of the shifts that are measured.
fn unlike(args: &DepthArgs, curve: &FieldCurve) -> Option<String> {
    match (curve.matched_window_px, args.sparse) {
        (Some(window), false) => Some(format!(
            "the curve is of shifts as windows of {window} px match them, which --sparse measures"
        )),
        (Some(window), true) if window != args.window => Some(format!(
            "the curve is of windows of {window} px, and --window is {}",
            args.window
        )),
        _ => None,
    }
}

fn sparse(
    capture: &Capture,
    settings: &MatchSettings,
    progress: &Progress,
) -> Result<Shifts, ShiftError> {
    let begins = |axes| {
        progress.stage(match axes {
            Axes::Vertical => "matching top and bottom",
            _ => "matching left and right",
        });
    };
    Shifts::measure(capture, settings, &begins)
}

fn report(
    args: &DepthArgs,
    files: &[(String, Vec<u8>)],
    maps: &DepthMaps,
    curve: &CameraCurve,
    score: Option<DepthScore>,
) -> Result<(), CommandError> {
    let gain_px_m = match curve {
        CameraCurve::Paraxial(curve) => Some(curve.mean_gain_px_m()),
        CameraCurve::Described(_) | CameraCurve::Field(_) => None,
    };
    if args.json {
        let names: Vec<&String> = files.iter().map(|(name, _)| name).collect();
        let summary = serde_json::json!({
            "files": names, "measured_share": maps.measured_share, "kappa_fx_a_px_m": gain_px_m, "score": score,
        });
        outln!("{summary}");
        return Ok(());
    }
    outln!(
        "{}: depth of {:.1} % of the pixels",
        args.out.display(),
        100.0 * maps.measured_share
    );
    if let Some(s) = score {
        outln!(
            "against depth.exr: median error {:.2} %, 95 % below {:.2} %; disparity RMS {:.4} px",
            100.0 * s.median_relative,
            100.0 * s.p95_relative,
            s.disparity_rms_px
        );
    }
    Ok(())
}

fn field_curve(path: &Path, capture: &Capture) -> Result<FieldCurve, CommandError> {
    let bytes = file::read(path).map_err(CommandError::input)?;
    let text = String::from_utf8(bytes).map_err(in_file(path))?;
    let curve = FieldCurve::from_json(&text, &path.display().to_string());
    let curve = curve.map_err(CommandError::input)?;
    let [width, height] = capture.size_px();
    if [curve.width_px, curve.height_px] != [width, height] {
        return Err(in_file(path)(format!(
            "width_px × height_px are {} × {}; allowed: those of the views, {width} × {height}",
            curve.width_px, curve.height_px
        )));
    }
    Ok(curve)
}

/// The camera's own curve, or the paraxial one where κ is given or a calibration has taken the aberrations out.
fn camera_curve(
    args: &DepthArgs,
    path: &Path,
    capture: &Capture,
) -> Result<CameraCurve, CommandError> {
    if args.kappa.is_some() || args.calibration.is_some() {
        return paraxial_curve(args.kappa, path, capture).map(CameraCurve::Paraxial);
    }
    let camera = camera_of(path, capture)?;
    let channel = &capture.channels[capture.reference_channel()];
    match DescribedCurve::new(camera, channel) {
        Ok(curve) if args.sparse => Ok(CameraCurve::Described(curve)),
        Ok(curve) => Ok(CameraCurve::Described(curve.of_centroids())),
        Err(CurveError::NoRatio) => Err(in_file(path)(
            "no camera.json says the disparity of this camera against distance: --camera or --calibration is needed, or --kappa for a lens \
             without aberrations",
        )),
        Err(error) => Err(in_file(path)(error)),
    }
}

fn camera_of<'a>(path: &Path, capture: &'a Capture) -> Result<&'a CameraDescription, CommandError> {
    (capture.camera.as_ref())
        .ok_or_else(|| in_file(path)("depth needs a camera.json beside the capture, or --camera"))
}

fn paraxial_curve(
    kappa: Option<f64>,
    path: &Path,
    capture: &Capture,
) -> Result<ParaxialCurve, CommandError> {
    let camera = camera_of(path, capture)?;
    ParaxialCurve::new(camera, kappa).map_err(|error| match error {
        CurveError::NoRatio => in_file(path)(
            "no camera.json says the ratio of disparity to circle of confusion: --camera or --kappa is needed",
        ),
        error => in_file(path)(error),
    })
}

/// The calibration in `file`, which must be of the camera of the capture at `path`.
fn calibration(file: &Path, path: &Path, capture: &Capture) -> Result<Calibration, CommandError> {
    let calibration = read_calibration(file)?;
    let camera = calibrated_camera(capture, None, path)?;
    match calibration.camera.difference(&camera) {
        None => Ok(calibration),
        Some(difference) => Err(in_file(file)(format!(
            "it is of another camera: {difference}"
        ))),
    }
}

fn files(format: MapFormat, maps: &DepthMaps) -> Result<Vec<(String, Vec<u8>)>, ImageError> {
    let depth = &maps.depth_m;
    let encode = |stem: &str, channels: &[&str], image: &Image| {
        let maps = &[(String::new(), image.clone())];
        Maps {
            stem,
            channels,
            maps,
        }
        .encode(format)
    };
    let mut files = encode("depth", &["Z"], depth)?;
    let names = &DepthMaps::CONFIDENCE_CHANNELS;
    files.extend(encode("confidence", names, &maps.confidence)?);
    let (width, height) = (depth.width(), depth.height());
    let picture = encode_png8(Path::new("depth.png"), &colours(depth), width, height, 3)?;
    files.push(("depth.png".to_owned(), picture));
    Ok(files)
}

/// From dark violet (farthest) to yellow (nearest), linear in 1/Z between its 2nd and 98th percentile; black where
/// there is none.
fn colours(depth: &Image) -> Vec<u8> {
    let inverse = |z: f32| (!z.is_nan()).then(|| 1.0 / z);
    let mut known: Vec<f32> = depth.data().iter().filter_map(|z| inverse(*z)).collect();
    known.sort_by(f32::total_cmp);
    let at = |percent: usize| known.get(known.len().saturating_sub(1) * percent / 100);
    let (low, high) = (
        at(2).copied().unwrap_or(0.0),
        at(98).copied().unwrap_or(1.0),
    );
    let span = (high - low).max(f32::MIN_POSITIVE);
    (depth.data().iter())
        .flat_map(|z| inverse(*z).map_or([0; 3], |v| viridis((v - low) / span)))
        .collect()
}
