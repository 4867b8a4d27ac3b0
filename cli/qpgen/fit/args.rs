//! What `qpgen fit` is asked.

use std::path::PathBuf;

use clap::Args;

use crate::number::number;

/// Arguments of `qpgen fit`.
#[derive(Args)]
pub struct FitArgs {
    /// What was captured (TOML, see --print-capture): measured kernels of both views over the field and white sheets,
    /// textured planes at known distances, or all of these; the files that it names stand beside it.
    #[arg(required_unless_present_any = ["print_capture", "print_target", "trials"])]
    pub(super) capture: Option<PathBuf>,
    /// Prints the grid of dots that is photographed out of focus (SVG in mm, white on black), and ends.
    #[arg(
        long,
        conflicts_with_all = [
            "capture", "print_capture", "out", "all", "prior", "pixel", "draft", "confirm", "trials", "seed", "json",
        ]
    )]
    pub(super) print_target: bool,
    /// Sheet of --print-target, mm, such as 297x210.
    #[arg(
        long,
        default_value = "420x297",
        value_name = "WxH",
        requires = "print_target"
    )]
    pub(super) target_mm: String,
    /// Distance of its dots, mm: on the sensor at least 1.4 widths of a dot out of focus.
    #[arg(value_parser = number, long, default_value_t = 20.0, requires = "print_target")]
    pub(super) dot_pitch_mm: f64,
    /// Diameter of its dots, mm: in focus a pixel or less on the sensor.
    #[arg(value_parser = number, long, default_value_t = 1.0, requires = "print_target")]
    pub(super) dot_mm: f64,
    /// Prints an example of the description, with every field, and ends.
    #[arg(
        long,
        conflicts_with_all = [
            "capture", "out", "all", "prior", "pixel", "draft", "confirm", "trials", "seed", "json",
        ]
    )]
    pub(super) print_capture: bool,
    /// Folder of what is found: camera.toml (which --camera of other commands takes, and --pixel for its pixel),
    /// fit.json (parameters, covariance, goals, predictions) and residuals.png.
    #[arg(long, short, default_value = "camera")]
    pub(super) out: PathBuf,
    /// Fits everything but planes of another wavelength. Absent: every other field, as the squares of a chessboard, the
    /// right half of the sheet, and planes with held_out are kept out and predicted.
    #[arg(long)]
    pub(super) all: bool,
    /// Prior of a parameter instead of its usual one, such as silicon_um=3,0.5; a deviation of 0 holds it.
    #[arg(long, value_name = "NAME=VALUE,SIGMA")]
    pub(super) prior: Vec<String>,
    /// Pixel (built-in name or TOML) whose layers are the start, and stay with planes alone: of 2x1 sub-pixels, with a
    /// layer named oxide or wiring, alone or under a mosaic of colour filters; absent: a thin one without.
    #[arg(long)]
    pub(super) pixel: Option<PathBuf>,
    /// Coarser waves and pupil: a quick look.
    #[arg(long)]
    pub(super) draft: bool,
    /// Predicts what was kept out by Fourier modes (rcwa), too, with the values that were found by waves: minutes more.
    #[arg(long, conflicts_with = "trials")]
    pub(super) confirm: bool,
    /// Checks the fit itself: draws so many cameras from the priors, captures them with noise, fits them blind, and
    /// says how far the fits are from what was drawn.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(super) trials: Option<u64>,
    /// Seed of the first drawn camera.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}
