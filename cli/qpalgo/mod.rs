//! `qpalgo`: parse, validate, call the library, return an exit code (0 done, 1 failed, 2 bad arguments or input).

mod autofocus;
mod calibrate_depth;
mod correct;
mod dense;
mod depth;
mod disparity;
mod inputs;
mod network;
mod refocus;
mod sai;
mod score;
mod sharpness;
mod table;

use std::ffi::OsString;

use clap::{Parser, Subcommand};

use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::memory::{limit, parse_bytes};
use crate::print::say;
use crate::process::{exit_on_closed_pipe, fail_on_file_size_limit, parse, use_threads};
use crate::progress::Progress;

/// Works on pictures of pixels that see the pupil in parts (dual-pixel, quad-pixel, m×n).
#[derive(Parser)]
#[command(name = "qpalgo", version, propagate_version = true)]
struct Cli {
    /// Number of threads; 0: one per core. The result does not depend on it.
    #[arg(long, global = true, default_value_t = 0, display_order = 900)]
    threads: usize,
    /// Most memory that the process may hold, such as 512M or 4G: what an input asks for beyond is refused; absent:
    /// 4/5 of what is free, and what a container or `ulimit -v` leaves.
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_bytes, display_order = 902)]
    max_memory: Option<u64>,
    /// Warnings and errors only on stderr: no progress.
    #[arg(long, short, global = true, display_order = 901)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Splits a sub-pixel mosaic into its views, and sums them by halves.
    ///
    /// Example: qpalgo sai out/samples/000001 -o views
    ///          qpalgo sai raw.png --subpixels 2x2 --format png -o views
    #[command(verbatim_doc_comment)]
    Sai(sai::SaiArgs),
    /// Sharpness of pictures: De, Wee and gradient, one line per picture and channel.
    ///
    /// They have no unit and depend on the size: compare equal crops only.
    ///   De        share of the frequencies whose amplitude is above 1/1000 of the largest
    ///   Wee       sum of the k largest eigenvalues of the normalised picture's covariance
    ///   gradient  mean length of the gradient, by the kernel, of the values read (0 to 1 for integers)
    ///
    /// Example: qpalgo sharpness views/sum_all.exr views/sum_L.exr --preset table-2 --json
    #[command(verbatim_doc_comment)]
    Sharpness(sharpness::SharpnessArgs),
    /// Shifts the views by a disparity and adds them: focus, and bokeh, after the fact.
    ///
    /// Example: qpalgo refocus out/samples/000001 --disparity 1.5 -o near.exr
    #[command(verbatim_doc_comment)]
    Refocus(refocus::RefocusArgs),
    /// Matches two pictures block by block to a hundredth of a pixel: shift, standard deviation, validity.
    ///
    /// The disparity is where a point appears in VIEW minus where it appears in REFERENCE: px, dx to the right,
    /// dy down. Of the left and the right half of the pupil it is x_L - x_R, positive for points nearer than the focus.
    ///
    /// Each node has dx, dy, their standard deviation sigma (along the worse direction) and a verdict: 0 valid,
    /// 1 textureless, 2 low correlation, 3 ambiguous, 4 at the edge of the search, 5 outside, 6 uncertain,
    /// 7 inconsistent, 8 not converged.
    ///
    /// With --dense every pixel has a disparity and its sigma: dx and sigma of the left view (VIEW) against the right
    /// one. Of a pair without a description the blur is that of shares which fall linearly over the pupil; px are px,
    /// but scale and zero of the disparity are free then, and sigma leaves them out.
    ///
    /// Example: qpalgo disparity views/sum_L.exr views/sum_R.exr --one-dimensional horizontal -o shift
    ///          qpalgo disparity out/samples/000001 -o shifts     (each view against the sum of all)
    ///          qpalgo disparity --dense left.png right.png --black-level 1024 --crop 1344x1008 -o dense
    #[command(verbatim_doc_comment)]
    Disparity(disparity::DisparityArgs),
    /// Errors of a disparity map against the truth, as the field quotes them.
    ///
    /// e = estimate - truth (a vector where two channels are compared), over the pixels that have both:
    ///   EPE = mean |e|, RMS = root of the mean |e|^2, px;   bad-t = part with |e| > t px, t = 0.1, 0.5, 1
    /// Of one channel also those that do not see an affine change of the estimate:
    ///   AIWE(p) = min over a, b of (sum w |truth - (a estimate + b)|^p / sum w)^(1/p), px; p = 1, 2; w: --mask, or 1
    ///   1-|rho|, rho: Spearman's rank correlation; ties share their mean rank
    ///
    /// Example: qpalgo score shift/disparity.exr out/samples/000001/disparity.exr --estimate-channels G.dx \
    ///              --truth-channels left-right --grid 14,4
    #[command(verbatim_doc_comment)]
    Score(score::ScoreArgs),
    /// Measures a lens's aberration on a chart, and takes it out of captures of the same camera.
    ///
    /// Example: qpalgo correct-aberrations --calibration out/samples/000000 -o calibration.json
    ///          qpalgo correct-aberrations --apply calibration.json out/samples/000001 -o corrected
    #[command(verbatim_doc_comment)]
    CorrectAberrations(correct::CorrectArgs),
    /// Table 2 of the quad-pixel paper from rendered captures: raw, corrected, gain.
    ///
    /// The list is TOML, its paths relative to its own folder:
    ///     [[row]]
    ///     setup = "ML-1 classic"
    ///     position = "centre"
    ///     calibration = "chart/samples/000000"
    ///     capture = "text/samples/000000"
    ///
    /// Example: qpalgo table table2.toml -o table2
    #[command(verbatim_doc_comment)]
    Table(table::TableArgs),
    /// Metric depth and its confidence from the shift between opposite views.
    ///
    /// Z in m from the first lens vertex, by the camera's relation of disparity and depth; its standard deviation in m;
    /// the disparity x_L - x_R in px with the standard deviation s; and the confidence 1 - s/(0.1 px), at least 0, and
    /// 0 where the disparity is none of this camera's: beyond infinity, or nearer than the lens, by more than three
    /// standard deviations.
    ///
    /// Example: qpalgo depth out/samples/000001 --score -o depth
    ///          qpalgo depth --sparse capture/raw.png --calibration calibration.json --format pfm -o depth
    ///          qpalgo depth --left l.png --right r.png --srgb --curve camera-curve.json -o depth
    #[command(verbatim_doc_comment)]
    Depth(depth::DepthArgs),
    /// Brings a camera's curve of disparity against distance to a real one: focus and gain from planes at known
    /// distances.
    ///
    /// D = g C(1/Z + d): the gain g, a polynomial over the picture (degree 4 along x, 2 along y), and the change of
    /// focus d, 1/m, one number, each with its standard deviation, by the medians of the shifts x_L - x_R in 16 x 10
    /// blocks of each picture; told for 3 x 3 parts. Dense shifts are matched again by the kernels that g tells.
    ///
    /// Example: qpalgo calibrate-depth 0.6=l1.png,r1.png 1.5=l2.png,r2.png --srgb --curve simulated.json -o mine.json
    ///          qpalgo depth --left l.png --right r.png --srgb --curve mine.json -o depth
    #[command(verbatim_doc_comment)]
    CalibrateDepth(calibrate_depth::CalibrateDepthArgs),
    /// Sharpness and phase difference over the focus stacks of a dataset: where would the camera focus?
    ///
    /// Focus is in dioptres, 1/m from the entrance pupil. For each stack: the zero of the phase difference x_L - x_R
    /// (px), the peaks of gradient, De and Wee, and the truth of the sample's own maps. A stack comes from `[sweep]` in
    /// the configuration of qpgen dataset.
    ///
    /// Example: qpalgo autofocus out -o autofocus
    #[command(verbatim_doc_comment)]
    Autofocus(autofocus::AutofocusArgs),
}

/// Runs the program with its arguments, its own name first, and returns its exit code. Sets threads and handlers of
/// signals of the whole process, so at most once in each.
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let cli: Cli = match parse(args) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    match run(cli) {
        Ok(()) => 0,
        Err(error) => {
            say(&format!("qpalgo: {error}"));
            error.exit_code()
        }
    }
}

fn run(cli: Cli) -> Result<(), CommandError> {
    exit_on_closed_pipe()?;
    fail_on_file_size_limit()?;
    limit(cli.max_memory)?;
    use_threads(cli.threads)?;
    let level = if cli.quiet { Level::Warn } else { Level::Info };
    let progress = Progress::stages(Log { level, json: false });
    match cli.command {
        Command::Sai(args) => sai::run(&args, progress),
        Command::Sharpness(args) => sharpness::run(&args, progress),
        Command::Refocus(args) => refocus::run(&args, progress),
        Command::CorrectAberrations(args) => correct::run(&args, progress),
        Command::Table(args) => table::run(&args, progress),
        Command::Depth(args) => depth::run(&args, progress),
        Command::CalibrateDepth(args) => calibrate_depth::run(&args, progress),
        Command::Autofocus(args) => autofocus::run(&args, progress),
        Command::Score(args) => score::run(&args),
        Command::Disparity(args) => disparity::run(&args, progress),
    }
}
