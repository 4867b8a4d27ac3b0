//! `qpalgo depth`: a capture in, metric depth and its confidence out.

use std::path::{Path, PathBuf};

use clap::Args;
use quadpixel::command::CommandError;
use quadpixel::file;
use quadpixel::image::colour::viridis;
use quadpixel::image::raster::encode_png8;
use quadpixel::image::{Image, ImageError, channel, raster};

use crate::correct::read_calibration;
use crate::progress::Progress;
use quadpixel_algorithms::calibration::Calibration;
use quadpixel_algorithms::capture::{Capture, Given};
use quadpixel_algorithms::depth::{
    Depth, DepthCurve, MOST_NOISE, Measured, Pair, combine, measure,
};
use quadpixel_algorithms::disparity::{Axes, MatchSettings};
use quadpixel_algorithms::field_curve::FieldCurve;
use quadpixel_algorithms::maps::{MapFormat, Maps};
use quadpixel_algorithms::sai::Side;

/// Arguments of `qpalgo depth`.
#[derive(Clone, Debug, Args)]
pub struct DepthArgs {
    /// A sample's folder, or a mosaic with meta.json beside it: intrinsics and focus are read from it.
    #[arg(required_unless_present = "left")]
    capture: Option<PathBuf>,
    /// Left view of a camera without meta.json.
    #[arg(long, requires_all = ["right", "curve"], conflicts_with_all = ["capture", "calibration"])]
    left: Option<PathBuf>,
    /// Its right view.
    #[arg(long, requires = "left")]
    right: Option<PathBuf>,
    /// The views are pictures in sRGB: its transfer function is undone.
    #[arg(long, requires = "left")]
    srgb: bool,
    /// Curve file: the camera's disparity against distance over the field (JSON, see the module field_curve), in place of meta.json's
    /// numbers; depth then counts from where the file says.
    #[arg(long, conflicts_with_all = ["kappa", "score"])]
    curve: Option<PathBuf>,
    /// Folder to write: depth.FORMAT (Z, m), confidence.FORMAT (0 to 1, standard deviation of Z in m, disparity in px), depth.png;
    /// NaN where there is no trusted match.
    #[arg(long, short)]
    out: PathBuf,
    /// Kind of file for the numbers.
    #[arg(long, value_enum, default_value_t = MapFormat::Exr)]
    format: MapFormat,
    /// Ratio of disparity to circle of confusion; absent: the paraxial one of meta.json.
    #[arg(long)]
    kappa: Option<f64>,
    /// Calibration file: takes the aberration's own disparity out first.
    #[arg(long)]
    calibration: Option<PathBuf>,
    /// Side of the matching window, px: odd, 5 to 31.
    #[arg(long, default_value_t = 21)]
    window: usize,
    /// Largest disparity looked for, px.
    #[arg(long, default_value_t = 4)]
    search: usize,
    /// Pixels from match to match; pixels between them take the nearest.
    #[arg(long, default_value_t = 2)]
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
    let named =
        (args.capture.as_ref().or(args.left.as_ref())).map_or(Path::new(""), PathBuf::as_path);
    let bad = |text: String| CommandError::input(format!("{}: {text}", named.display()));
    progress.stage(format!("reading {}", named.display()));
    let capture = match (&args.left, &args.right) {
        (Some(left), Some(right)) => Capture::of_pair(left, right, args.srgb)?,
        _ => Capture::read(named, &Given::default(), None)?,
    };
    let curve = match &args.curve {
        Some(path) => Curve::Field(field_curve(path, &capture)?),
        None => Curve::OfMeta(curve(args, named, &capture)?),
    };
    let calibration = (args.calibration.as_ref())
        .map(|path| of_this_camera(path, &capture))
        .transpose()?;
    let settings = MatchSettings {
        window_px: args.window,
        stride_px: args.stride,
        search_px: args.search,
        ..MatchSettings::default()
    };
    progress.stage("matching left and right");
    let horizontal = direction(&capture, Axes::Horizontal, calibration.as_ref(), &settings)
        .map_err(|e| bad(e.to_string()))?;
    progress.stage("matching top and bottom");
    let vertical = direction(&capture, Axes::Vertical, calibration.as_ref(), &settings)
        .map_err(|e| bad(e.to_string()))?;
    let found: Vec<Option<Measured>> = match (horizontal, vertical) {
        (Some(h), Some(v)) => h.into_iter().zip(v).map(|(h, v)| combine(h, v)).collect(),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => {
            let subpixels = &capture.camera.subpixels;
            return Err(bad(format!(
                "sub-pixels {subpixels}: depth needs two columns or two rows"
            )));
        }
    };
    let (width, height) = (capture.camera.width_px, capture.camera.height_px);
    let mut depth = Image::zeros(width, height, 1);
    let mut trust = Image::zeros(width, height, 3);
    let limit = settings.limits.deviation_px;
    for (i, found) in found.iter().enumerate() {
        let (to, beside) = (
            &mut depth.data_mut()[i],
            &mut trust.data_mut()[3 * i..3 * i + 3],
        );
        let Some(m) = found else {
            *to = f32::NAN;
            beside.copy_from_slice(&[0.0, f32::NAN, f32::NAN]);
            continue;
        };
        let z = curve.depth([i % width, i / width], *m);
        let confidence = (1.0 - m.sigma_px / limit).max(0.0);
        *to = z.z_m as f32;
        beside.copy_from_slice(&[confidence as f32, z.sigma_m as f32, m.disparity_px as f32]);
    }
    progress.stage("encoding the maps");
    let files = files(args.format, &depth, &trust).map_err(CommandError::failed)?;
    let score = match (&capture.sample, &curve) {
        (Some(sample), Curve::OfMeta(curve)) if args.score => {
            Some(score(&sample.join("depth.exr"), &depth, curve)?)
        }
        _ => None,
    };
    file::write_folder(&args.out, &files).map_err(CommandError::failed)?;
    drop(progress);
    let measured = found.iter().flatten().count() as f64 / found.len() as f64;
    let summary = serde_json::json!({
        "files": files.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "measured_share": measured, "kappa_fx_a_px_m": curve.gain_px_m(), "score": score,
    });
    if args.json {
        println!("{summary}");
        return Ok(());
    }
    println!(
        "{}: depth of {:.1} % of the pixels",
        args.out.display(),
        100.0 * measured
    );
    if let Some(s) = score {
        println!(
            "against depth.exr: median error {:.2} %, 95 % below {:.2} %; disparity RMS {:.4} px",
            100.0 * s.median_relative,
            100.0 * s.p95_relative,
            s.disparity_rms_px
        );
    }
    Ok(())
}

/// Where depth comes from.
enum Curve {
    OfMeta(DepthCurve),
    Field(FieldCurve),
}

impl Curve {
    fn depth(&self, [x, y]: [usize; 2], m: Measured) -> Depth {
        match self {
            Self::OfMeta(curve) => curve.depth(m.disparity_px, m.sigma_px),
            Self::Field(curve) => curve.depth([x as f64, y as f64], m),
        }
    }

    /// The paraxial curve's one number.
    fn gain_px_m(&self) -> Option<f64> {
        match self {
            Self::OfMeta(curve) => Some(curve.gain_px_m),
            Self::Field(_) => None,
        }
    }
}

fn field_curve(path: &Path, capture: &Capture) -> Result<FieldCurve, CommandError> {
    let file = path.display().to_string();
    let input = |what: String| CommandError::input(format!("{file}: {what}"));
    let bytes = file::read(path).map_err(CommandError::input)?;
    let text = String::from_utf8(bytes).map_err(|e| input(e.to_string()))?;
    let curve = FieldCurve::from_json(&text, &file).map_err(CommandError::input)?;
    let (of_curve, of_views) = (
        (curve.width_px, curve.height_px),
        (capture.camera.width_px, capture.camera.height_px),
    );
    if of_curve != of_views {
        return Err(input(format!(
            "width_px × height_px are {} × {}; allowed: those of the views, {} × {}",
            of_curve.0, of_curve.1, of_views.0, of_views.1
        )));
    }
    Ok(curve)
}

fn curve(args: &DepthArgs, named: &Path, capture: &Capture) -> Result<DepthCurve, CommandError> {
    let bad = |text: &str| CommandError::input(format!("{}: {text}", named.display()));
    let meta =
        (capture.meta.as_ref()).ok_or_else(|| bad("depth needs a meta.json beside the capture"))?;
    let of_meta = meta.coc_disparity.as_ref().map(|c| c.paraxial_ratio);
    let kappa = (args.kappa.or(of_meta))
        .ok_or_else(|| bad("meta.json has no coc_disparity: --kappa is needed"))?;
    let (lens, p) = (&meta.intrinsics, meta.intrinsics.pinhole_behind_vertex_m);
    let gain_px_m = kappa * lens.fx_px * lens.entrance_pupil_diameter_m;
    if !(gain_px_m > 0.0 && gain_px_m.is_finite()) {
        return Err(bad("kappa · fx · entrance pupil diameter must be above 0"));
    }
    Ok(DepthCurve {
        inverse_focus_per_m: meta.focus.distance_m.map_or(0.0, |z| 1.0 / (z + p)),
        gain_px_m,
        pupil_behind_vertex_m: p,
    })
}

fn of_this_camera(path: &Path, capture: &Capture) -> Result<Calibration, CommandError> {
    let calibration = read_calibration(path)?;
    match calibration.camera.difference(&capture.camera) {
        None => Ok(calibration),
        Some(difference) => Err(CommandError::input(format!(
            "{}: it is of another camera: {difference}",
            path.display()
        ))),
    }
}

/// D at each pixel in one direction; `None` where the pixel is not parted in it.
fn direction(
    capture: &Capture,
    axes: Axes,
    calibration: Option<&Calibration>,
    settings: &MatchSettings,
) -> Result<Option<Vec<Option<Measured>>>, CommandError> {
    let input = |text: String| CommandError::input(text);
    let (sides, axis) = match axes {
        Axes::Vertical => ([Side::Bottom, Side::Top], 1),
        _ => ([Side::Right, Side::Left], 0),
    };
    let views = &capture.views;
    let [Some(a), Some(b)] = sides.map(|side| views.sum(side)) else {
        return Ok(None);
    };
    let c = capture.camera.reference_channel();
    let (a, b) = (channel(&a, c), channel(&b, c));
    let pair = Pair { a: &a, b: &b, axes };
    let mut found = measure(pair, settings, MOST_NOISE).map_err(|e| input(e.to_string()))?;
    if let Some(calibration) = calibration {
        let fields = (calibration.smooth_fields()).map_err(|e| input(e.to_string()))?;
        let channels = capture.camera.channels.len();
        let mean = |side: Side, at: [f64; 2]| {
            let members = views.partition().side(side);
            let shifts = members
                .iter()
                .map(|v| fields[v * channels + c].at(at)[axis]);
            shifts.sum::<f64>() / members.len() as f64
        };
        let width = a.width();
        for (i, found) in found.iter_mut().enumerate() {
            if let Some(found) = found {
                let at = [(i % width) as f64, (i / width) as f64];
                found.disparity_px -= mean(sides[1], at) - mean(sides[0], at);
            }
        }
    }
    Ok(Some(found))
}

fn files(
    format: MapFormat,
    depth: &Image,
    trust: &Image,
) -> Result<Vec<(String, Vec<u8>)>, ImageError> {
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
    let trusts = ["confidence", "sigma_m", "disparity_px"];
    files.extend(encode("confidence", &trusts, trust)?);
    let (width, height) = (depth.width(), depth.height());
    let picture = encode_png8(Path::new("depth.png"), &colours(depth), width, height, 3)?;
    files.push(("depth.png".to_owned(), picture));
    Ok(files)
}

/// From dark violet (farthest) to yellow (nearest), linear in 1/Z between its 2nd and 98th percentile; black where there is none.
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

/// Estimate against `depth.exr`, over the pixels that have both and are not sky.
#[derive(Clone, Copy, Debug, serde::Serialize)]
struct DepthScore {
    median_relative: f64,
    p95_relative: f64,
    disparity_rms_px: f64,
    count: usize,
}

fn score(path: &Path, depth: &Image, curve: &DepthCurve) -> Result<DepthScore, CommandError> {
    let bad = |text: &str| CommandError::input(format!("{}: {text}", path.display()));
    let truth = raster::read(path).map_err(CommandError::input)?;
    if (truth.width(), truth.height()) != (depth.width(), depth.height()) {
        return Err(bad("its size is not that of the views"));
    }
    let truths = truth.data().iter().step_by(truth.channels());
    let both = (depth.data().iter().zip(truths))
        .map(|(found, truth)| (f64::from(*found), f64::from(*truth)))
        .filter(|(found, truth)| found.is_finite() && truth.is_finite());
    let (mut errors, mut squares) = (Vec::new(), 0.0);
    for (found, truth) in both {
        errors.push((found / truth - 1.0).abs());
        squares += (curve.disparity_px(found) - curve.disparity_px(truth)).powi(2);
    }
    errors.sort_by(f64::total_cmp);
    let at = |percent: usize| errors[(errors.len() - 1) * percent / 100];
    if errors.is_empty() {
        return Err(bad("no pixel has both a depth and an estimate"));
    }
    Ok(DepthScore {
        median_relative: at(50),
        p95_relative: at(95),
        disparity_rms_px: (squares / errors.len() as f64).sqrt(),
        count: errors.len(),
    })
}
