//! `qpalgo correct-aberrations`: a chart in, a calibration out; a calibration and a capture in, corrected pictures out.

use crate::number::number;
use crate::outln;
use crate::print::say;
use std::path::{Path, PathBuf};

use clap::Args;
use quadpixel::image::ImageError;
use quadpixel::image::raster::encode_png8;
use quadpixel::{file, range};

use crate::exit::CommandError;
use crate::progress::Progress;
use crate::qpalgo::inputs::{
    AlignArg, CaptureArgs, PictureFormatArg, calibrated_camera, in_file, read_calibration,
    sample_folder,
};
use quadpixel_algorithms::aberration_score::AberrationScore;
use quadpixel_algorithms::calibration::{Calibration, CalibrationSettings};
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::correct::{BeforeAfter, CorrectError, Corrected, correct};
use quadpixel_algorithms::disparity::MatchSettings;
use quadpixel_algorithms::metrics::sharpness::SharpnessSettings;
use quadpixel_algorithms::pictures::{PictureFormat, Pictures};

/// Arguments of `qpalgo correct-aberrations`.
#[derive(Clone, Debug, Args)]
pub struct CorrectArgs {
    /// Calibrates by this capture of a flat, textured chart in focus: a sample's folder, a mosaic, or an EXR of views.
    #[arg(long, value_name = "CAPTURE", conflicts_with_all = ["apply", "capture"], required_unless_present = "apply")]
    calibration: Option<PathBuf>,
    /// Corrects CAPTURE by this calibration file.
    #[arg(long, value_name = "CALIBRATION", requires = "capture")]
    apply: Option<PathBuf>,
    /// What to correct: of the same camera.
    capture: Option<PathBuf>,
    /// The calibration file to write; with --apply, the folder: corrected, view_NAME, valid.png.
    #[arg(long, short)]
    out: PathBuf,
    #[command(flatten)]
    source: CaptureArgs,
    /// Pitch of the microlenses, µm; absent: as in meta.json.
    #[arg(value_parser = number, long)]
    pitch_um: Option<f64>,
    /// Side of the matching window, px: odd, 5 to 31.
    #[arg(long, default_value_t = CalibrationSettings::default().matching.window_px)]
    window: usize,
    /// Largest shift looked for, px.
    #[arg(long, default_value_t = CalibrationSettings::default().matching.search_px)]
    search: usize,
    /// Degree of the field's polynomial, 0 to 6.
    #[arg(long, default_value_t = CalibrationSettings::default().degree)]
    degree: usize,
    /// What to line up: the centroids of the spots (what depth needs), or the chart's texture as block matching does.
    #[arg(long, value_enum, default_value_t = AlignArg::Centroid)]
    align: AlignArg,
    /// With --align centroid: smoothing before centroids are fitted (σ, px, 1.5 to 100); absent: as views ask for.
    #[arg(value_parser = number, long)]
    smoothing: Option<f64>,
    /// Kind of the pictures; a PNG of a view is full at the mosaic's white, one of the sum at that times the views.
    #[arg(long, value_enum, default_value_t = PictureFormatArg::Exr)]
    format: PictureFormatArg,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Calibrates or applies; scores itself where the capture is a dataset's sample. No file is written before all are
/// made.
pub fn run(args: &CorrectArgs, progress: Progress) -> Result<(), CommandError> {
    match (&args.calibration, &args.apply, &args.capture) {
        (Some(chart), None, None) => calibrate(args, progress, chart),
        (None, Some(calibration), Some(capture)) => apply(args, progress, calibration, capture),
        _ => Err(CommandError::input(
            "either --calibration CAPTURE or --apply CALIBRATION CAPTURE is needed".to_owned(),
        )),
    }
}

fn calibrate(args: &CorrectArgs, progress: Progress, chart: &Path) -> Result<(), CommandError> {
    progress.stage(format!("reading {}", chart.display()));
    let capture = args.source.read(chart)?;
    let camera = calibrated_camera(&capture, args.pitch_um, chart)?;
    let settings = CalibrationSettings {
        matching: MatchSettings {
            window_px: args.window,
            search_px: args.search,
            ..CalibrationSettings::default().matching
        },
        degree: args.degree,
        align: args.align.into(),
        smoothing_px: smoothing(args.smoothing, args.align)?,
    };
    progress.stage("matching every view and channel against the sum");
    let calibration =
        Calibration::from_chart(&capture.views, &camera, &settings).map_err(in_file(chart))?;
    progress.stage("correcting the chart by its own fields, and measuring");
    let corrected = correct(&capture.views, &camera, &calibration).map_err(not_corrected(chart))?;
    let scores = Scores::new(&capture, &corrected, &calibration, chart)?;
    let text = (calibration.to_json()).map_err(CommandError::failed)?;
    file::write_aside(&args.out, text.as_bytes())?;
    drop(progress);
    if !args.json {
        outln!("{}", args.out.display());
        outln!("sub-pixel channel residual_rms_px rejected valid");
        for f in &calibration.fields {
            outln!(
                "{:<9} {:<7} {:<15.4} {:<8.3} {:.3}",
                f.subpixel,
                f.channel,
                f.residual_rms_px,
                f.rejected_share,
                f.valid_share
            );
        }
    }
    scores.print(args.json, &[args.out.display().to_string()], 0)?;
    Ok(())
}

fn apply(
    args: &CorrectArgs,
    progress: Progress,
    calibration_path: &Path,
    path: &Path,
) -> Result<(), CommandError> {
    progress.stage(format!("reading {}", path.display()));
    let calibration = read_calibration(calibration_path)?;
    let capture = args.source.read(path)?;
    let camera = calibrated_camera(&capture, args.pitch_um, path)?;
    progress.stage("warping and adding the views");
    let corrected = correct(&capture.views, &camera, &calibration)
        .map_err(|e| not_corrected(path)(e).within(&calibration_path.display().to_string()))?;
    let scores = Scores::new(&capture, &corrected, &calibration, path)?;
    progress.stage("encoding the pictures");
    let pictures =
        pictures(args.format.into(), &capture, &corrected).map_err(CommandError::input)?;
    file::write_reports(&args.out, &pictures.files)?;
    drop(progress);
    let names: Vec<String> = pictures.names().into_iter().map(String::from).collect();
    if !args.json {
        outln!("{}: {}", args.out.display(), names.join(" "));
        if let Some(text) = pictures.clipping() {
            say(&text);
        }
    }
    scores.print(args.json, &names, pictures.clipped)?;
    Ok(())
}

/// Checks --smoothing, which texture has no use for.
pub(crate) fn smoothing(px: Option<f64>, align: AlignArg) -> Result<Option<f64>, CommandError> {
    match (px, align) {
        (Some(_), AlignArg::Texture) => Err(CommandError::input(
            "--smoothing is of centroids; allowed: with --align centroid",
        )),
        (Some(px), AlignArg::Centroid) => range::within("--smoothing", "px", px, 1.5..=100.0)
            .map(|()| Some(px))
            .map_err(CommandError::input),
        (None, _) => Ok(None),
    }
}

/// What a correction that failed is called, of the capture at `path`.
pub(crate) fn not_corrected(path: &Path) -> impl Fn(CorrectError) -> CommandError {
    move |error| match error {
        CorrectError::OtherCamera(difference) => CommandError::input(format!(
            "the calibration is of another camera than {}: {difference}",
            path.display()
        )),
        error => in_file(path)(error),
    }
}

fn pictures(
    format: PictureFormat,
    capture: &Capture,
    corrected: &Corrected,
) -> Result<Pictures, ImageError> {
    let mut pictures = Pictures::new(format, &capture.channels);
    let views = &corrected.views;
    let count = views.subpixels().count();
    let white = capture.white * count as f64;
    pictures.add("corrected", &corrected.sum, white)?;
    for (index, image) in views.images().iter().enumerate() {
        let name = format!("view_{}", views.subpixels().name(index));
        pictures.add(&name, image, capture.white)?;
    }
    let mask: Vec<u8> = corrected.valid.iter().map(|v| 255 * u8::from(*v)).collect();
    let (width, height) = (corrected.sum.width(), corrected.sum.height());
    let bytes = encode_png8(Path::new("valid.png"), &mask, width, height, 1)?;
    pictures.files.push(("valid.png".to_owned(), bytes));
    Ok(pictures)
}

/// What the correction brought, and on a sample how near it came to the truth.
struct Scores {
    sharpness: BeforeAfter,
    channel: String,
    truth: Option<AberrationScore>,
}

impl Scores {
    fn new(
        capture: &Capture,
        corrected: &Corrected,
        calibration: &Calibration,
        path: &Path,
    ) -> Result<Self, CommandError> {
        let c = capture.reference_channel();
        let settings = SharpnessSettings::table_2();
        let sharpness =
            BeforeAfter::measure(&capture.views, corrected, c, &settings).map_err(in_file(path))?;
        // The truth is looked at last: nothing above depends on it.
        let sample = sample_folder(path, capture).filter(|s| s.join("disparity.exr").is_file());
        let truth = sample.map(|s| AberrationScore::read(calibration, &s));
        let truth = truth.transpose().map_err(CommandError::input)?;
        Ok(Self {
            sharpness,
            channel: capture.channels[c].clone(),
            truth,
        })
    }

    fn print(&self, json: bool, files: &[String], clipped: u64) -> Result<(), CommandError> {
        let s = &self.sharpness;
        if json {
            let object = serde_json::json!({
                "files": files, "clipped": clipped, "channel": self.channel,
                "sharpness_preset": "table-2", "sharpness": s, "aberration": self.truth,
            });
            outln!("{object}");
            return Ok(());
        }
        let gain = |a: f64, b: f64| 100.0 * (b / a - 1.0);
        outln!("channel {}, raw → corrected (preset table-2)", self.channel);
        for (name, a, b) in [
            ("De", s.raw.de, s.corrected.de),
            ("Wee", s.raw.wee, s.corrected.wee),
            ("gradient", s.raw.gradient, s.corrected.gradient),
        ] {
            outln!("{name:<9} {a:.5e} → {b:.5e}  {:+.2} %", gain(a, b));
        }
        if let Some(t) = &self.truth {
            outln!(
                "aberration disparity: true RMS {:.4} px; estimated minus true RMS {:.4} px, 95 % below {:.4} px",
                t.truth.rms_px,
                t.residual.rms_px,
                t.residual.p95_px
            );
        }
        Ok(())
    }
}
