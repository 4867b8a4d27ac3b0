//! `qpalgo`: parse, validate, call the library, return an exit code (0 done, 1 failed, 2 bad arguments or input).

use std::process::ExitCode;

use algorithms::error::CommandError;
use algorithms::{
    correct_command, depth_command, disparity_command, refocus_command, sai_command,
    sharpness_command, table_command,
};
use clap::{Parser, Subcommand};

/// Works on pictures of pixels that see the pupil in parts (dual-pixel, quad-pixel, m×n).
#[derive(Parser)]
#[command(version, propagate_version = true)]
struct Cli {
    /// Threads; 0: all cores. The result does not depend on it.
    #[arg(long, global = true, default_value_t = 0)]
    threads: usize,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Parts a sub-pixel mosaic into its views and sums them by halves.
    ///
    /// Example: qpalgo sai samples/000000/raw.png --subpixels 2x2 --meta samples/000000/meta.json -o views
    #[command(verbatim_doc_comment)]
    Sai(sai_command::SaiArgs),
    /// Sharpness of pictures: De, Wee and gradient, one line a picture and channel.
    ///
    /// Example: qpalgo sharpness raw.png corrected.png --preset table-2 --json
    #[command(verbatim_doc_comment)]
    Sharpness(sharpness_command::SharpnessArgs),
    /// Shifts the views by a disparity and adds them: focus, and bokeh, after the fact.
    ///
    /// Example: qpalgo refocus raw.exr --disparity 1.5 -o near.exr
    #[command(verbatim_doc_comment)]
    Refocus(refocus_command::RefocusArgs),
    /// Matches two pictures block by block to a hundredth of a pixel: shift, standard deviation, validity.
    ///
    /// Example: qpalgo disparity views/sum_L.exr views/sum_R.exr --one-dimensional horizontal -o shift
    #[command(verbatim_doc_comment)]
    Disparity(disparity_command::DisparityArgs),
    /// Measures a lens's aberration on a chart, and takes it out of captures of the same camera.
    ///
    /// Example: qpalgo correct-aberrations --calibration samples/000000 -o camera.json
    ///          qpalgo correct-aberrations --apply camera.json samples/000001 -o corrected
    #[command(verbatim_doc_comment)]
    CorrectAberrations(correct_command::CorrectArgs),
    /// Table 2 of the quad-pixel paper from rendered captures: raw, corrected, gain.
    ///
    /// Example: qpalgo table table2.toml -o table2
    #[command(verbatim_doc_comment)]
    Table(table_command::TableArgs),
    /// Metric depth and its confidence from the shift between opposite views.
    ///
    /// Example: qpalgo depth samples/000000 --score -o depth
    #[command(verbatim_doc_comment)]
    Depth(depth_command::DepthArgs),
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("qpalgo: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(cli: Cli) -> Result<(), CommandError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(cli.threads)
        .build_global()
        .map_err(|e| CommandError::failed(format!("--threads {}: {e}", cli.threads)))?;
    match cli.command {
        Command::Sai(args) => sai_command::run(&args),
        Command::Sharpness(args) => sharpness_command::run(&args),
        Command::Refocus(args) => refocus_command::run(&args),
        Command::CorrectAberrations(args) => correct_command::run(&args),
        Command::Table(args) => table_command::run(&args),
        Command::Depth(args) => depth_command::run(&args),
        Command::Disparity(args) => disparity_command::run(&args),
    }
}
