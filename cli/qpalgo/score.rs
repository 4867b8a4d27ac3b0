//! `qpalgo score`: a disparity map and its truth in, the errors that the field quotes out.
//!
//! The formulae are in [`quadpixel_algorithms::metrics::disparity_error`] and in the command's help.

use crate::outln;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::exit::CommandError;
use clap::Args;
use quadpixel::image::{Image, raster};

use quadpixel_algorithms::map_channels::{ChannelError, read_channels};
use quadpixel_algorithms::metrics::disparity_error::{AffineInvariantError, EndPointError, Pair};

/// Arguments of `qpalgo score`.
#[derive(Clone, Debug, Args)]
pub struct ScoreArgs {
    /// Estimated disparity, px (EXR, NPY, PFM, or a float TIFF); NaN: no estimate.
    estimate: PathBuf,
    /// True disparity, px, in any of these formats; NaN: no truth.
    truth: PathBuf,
    /// One or two channels of ESTIMATE, separated by a comma, such as G.dx,G.dy (without names in the file: 0,1);
    /// absent: its only channel, or its only dx and dy.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    estimate_channels: Vec<String>,
    /// As many channels of TRUTH; or, of a sample's disparity.exr, left-right (x_L − x_R) or top-bottom (y_T − y_B).
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    truth_channels: Vec<String>,
    /// Picture of TRUTH's size, 0 where it does not count; as a weight it enters AIWE.
    #[arg(long)]
    mask: Option<PathBuf>,
    /// Place of ESTIMATE's numbers in TRUTH where they are fewer, px: the first one's row and column, and the distance
    /// to the next, as `qpalgo disparity` prints them; absent: both are of one size.
    #[arg(long, value_name = "FIRST,STRIDE")]
    grid: Option<Nodes>,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Places first, first + stride, … on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Nodes {
    first_px: usize,
    stride_px: usize,
}

impl FromStr for Nodes {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once(',');
        let parsed = parts.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match parsed {
            Some((first_px, stride_px)) if stride_px > 0 => Ok(Self {
                first_px,
                stride_px,
            }),
            _ => Err("FIRST,STRIDE are two whole numbers, the second above 0".to_owned()),
        }
    }
}

/// What is compared.
struct Score {
    truths: usize,
    end_point: EndPointError,
    affine: Option<AffineInvariantError>,
}

/// Reads both, compares, prints.
pub fn run(args: &ScoreArgs) -> Result<(), CommandError> {
    let estimate = channels(
        &args.estimate,
        &args.estimate_channels,
        "--estimate-channels",
    )?;
    let truth = channels(&args.truth, &args.truth_channels, "--truth-channels")?;
    if estimate.len() != truth.len() {
        return Err(CommandError::input(format!(
            "{} channel(s) of {} and {} of {}: name as many by --estimate-channels and --truth-channels",
            estimate.len(),
            args.estimate.display(),
            truth.len(),
            args.truth.display()
        )));
    }
    let mask = args
        .mask
        .as_deref()
        .map(|path| mask(path, &truth[0]))
        .transpose()?;
    let score = compare(&estimate, &truth, mask.as_ref(), args)?;
    let (e, share) = (
        &score.end_point,
        score.end_point.pixels as f64 / score.truths as f64,
    );
    if args.json {
        let object = serde_json::json!({
            "truths": score.truths, "estimated_share": share, "end_point": e, "affine_invariant": score.affine
        });
        outln!("{object}");
        return Ok(());
    }
    outln!(
        "{} of {} truths have an estimate ({:.1} %)",
        e.pixels,
        score.truths,
        100.0 * share
    );
    outln!("EPE       {:.4} px", e.epe_px);
    outln!("RMS       {:.4} px", e.rms_px);
    for (name, part) in [("0.1", e.bad_01), ("0.5", e.bad_05), ("1", e.bad_1)] {
        outln!("bad-{name:<5} {:.2} %", 100.0 * part);
    }
    if let Some(a) = &score.affine {
        outln!("AIWE(1)   {:.4} px", a.aiwe_1);
        outln!("AIWE(2)   {:.4} px", a.aiwe_2);
        outln!("1-|rho|   {:.4} (Spearman)", a.one_minus_spearman);
    }
    Ok(())
}

/// The channels of a file that `flag` names.
fn channels(path: &Path, names: &[String], flag: &str) -> Result<Vec<Image>, CommandError> {
    read_channels(path, names).map_err(|error| match error {
        ChannelError::Image(error) => CommandError::input(error),
        error => CommandError::input(format!("{flag}: {error}")),
    })
}

fn compare(
    estimate: &[Image],
    truth: &[Image],
    mask: Option<&Image>,
    args: &ScoreArgs,
) -> Result<Score, CommandError> {
    let (width, height) = (estimate[0].width(), estimate[0].height());
    let (full_width, full_height) = (truth[0].width(), truth[0].height());
    let nodes = args.grid.unwrap_or(Nodes {
        first_px: 0,
        stride_px: 1,
    });
    let at =
        |i: usize| (i.checked_mul(nodes.stride_px)).and_then(|p| p.checked_add(nodes.first_px));
    let inside = |count: usize, full: usize| {
        let last = count.checked_sub(1).and_then(at);
        last.is_some_and(|last| last < full)
    };
    let fits = match args.grid {
        None => (width, height) == (full_width, full_height),
        Some(_) => inside(width, full_width) && inside(height, full_height),
    };
    if !fits {
        return Err(CommandError::input(format!(
            "{}: {width} × {height} numbers where {} has {full_width} × {full_height}: both must be of one size, or --grid fit",
            args.estimate.display(),
            args.truth.display()
        )));
    }
    let (mut truths, mut lengths, mut pairs) = (0, Vec::new(), Vec::new());
    for y in 0..height {
        for x in 0..width {
            let [u, v] = [x, y].map(|i| nodes.first_px + i * nodes.stride_px);
            let weight = mask.map_or(1.0, |m| f64::from(m.pixel(u, v)[0]));
            let real = |i: usize| f64::from(truth[i].pixel(u, v)[0]);
            if weight.is_nan() || weight <= 0.0 || !(0..truth.len()).all(|i| real(i).is_finite()) {
                continue;
            }
            truths += 1;
            let found = |i: usize| f64::from(estimate[i].pixel(x, y)[0]);
            let squares = (0..truth.len()).map(|i| (found(i) - real(i)).powi(2));
            lengths.push(squares.sum::<f64>().sqrt());
            pairs.push(Pair {
                estimate: found(0),
                truth: real(0),
                weight,
            });
        }
    }
    let end_point = EndPointError::from_lengths(lengths).ok_or_else(|| {
        CommandError::input(format!(
            "{} and {}: no pixel has both an estimate and a truth",
            args.estimate.display(),
            args.truth.display()
        ))
    })?;
    // An affine change of a vector is no single scale and offset: those measures are for one channel.
    let affine = (truth.len() == 1)
        .then(|| AffineInvariantError::from_pairs(&pairs))
        .flatten();
    Ok(Score {
        truths,
        end_point,
        affine,
    })
}

fn mask(path: &Path, truth: &Image) -> Result<Image, CommandError> {
    let mask = raster::read(path).map_err(CommandError::input)?;
    if (mask.width(), mask.height()) != (truth.width(), truth.height()) {
        return Err(CommandError::input(format!(
            "{}: its size is not that of the truth",
            path.display()
        )));
    }
    Ok(mask)
}
