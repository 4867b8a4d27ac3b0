//! `qpgen`: parse, validate, call the library, return an exit code (0 done, 1 failed, 2 bad arguments or input).

mod accuracy;
mod camera_arg;
mod check;
mod coarse;
mod convert;
mod curve;
mod dataset;
mod effect_args;
mod export;
mod fit;
mod lens;
mod meaning_args;
mod merge;
mod pixel_model;
mod preview;
mod psf;
mod render;
mod response;
mod scene_args;
mod study;
mod validate;

use std::ffi::OsString;

use clap::{Parser, Subcommand};

use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::memory::{limit, parse_bytes};
use crate::process::{exit_on_closed_pipe, fail_on_file_size_limit, parse, use_threads};

/// Simulates cameras whose pixels see the pupil in parts (dual-pixel, quad-pixel, m×n) and makes training data with
/// them.
#[derive(Parser)]
#[command(name = "qpgen", version, propagate_version = true)]
struct Cli {
    /// Number of threads; 0: one per core. The result does not depend on it.
    #[arg(long, global = true, default_value_t = 0)]
    threads: usize,
    /// Most memory that the process may hold, such as 512M or 4G: what an input asks for beyond is refused; absent:
    /// 4/5 of what is free, and what a container or `ulimit -v` leaves.
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_bytes)]
    max_memory: Option<u64>,
    /// What is printed on stderr.
    #[arg(long, global = true, value_enum, default_value_t = Level::Info)]
    log: Level,
    /// Warnings and errors only: --log warn.
    #[arg(long, short, global = true, conflicts_with = "log")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
#[allow(clippy::large_enum_variant)] // because a run has one of it
enum Command {
    /// Makes a dataset: randomised scenes through a real lens, with true depth and disparity.
    ///
    /// Example: qpgen dataset --count 100 --seed 7 --out data
    #[command(verbatim_doc_comment)]
    Dataset(dataset::DatasetArgs),
    /// Makes a dataset of pictures with depth: what a real lens and a pixel with several sub-pixels make of them.
    ///
    /// Example: qpgen convert --image rgb --depth depth --depth-unit mm -o data
    #[command(verbatim_doc_comment)]
    Convert(convert::ConvertArgs),
    /// Joins the shards of a dataset, and checks it.
    ///
    /// Example: qpgen dataset --shard 1/2; qpgen dataset --shard 2/2; qpgen merge out
    #[command(verbatim_doc_comment)]
    Merge(merge::MergeArgs),
    /// Rebuilds a dataset's gallery and data card, also while it is being made.
    ///
    /// Example: qpgen preview out
    #[command(verbatim_doc_comment)]
    Preview(preview::PreviewArgs),
    /// Renders one image from a recipe (TOML, or the meta.json of a sample), or from a glTF, GLB or OBJ scene.
    /// A first, coarse picture of a world of meshes is written as OUT-first.jpg within a second or two.
    ///
    /// Example: qpgen render out/samples/000003/meta.json --out again
    ///
    /// Example: qpgen render --scene shop.glb --focus-mm 1200 --size 400x300 --out shop
    #[command(verbatim_doc_comment)]
    Render(render::RenderArgs),
    /// Kernels (point-spread functions) of every sub-pixel as numbers: over field, depth and colour, with energy and
    /// centroid.
    ///
    /// Example: qpgen psf --depths-m 0.4,0.75,inf --fields 5x5 -o bank.npz
    #[command(verbatim_doc_comment)]
    Psf(psf::PsfArgs),
    /// A camera's disparity x_L - x_R against distance over the field, as a matcher finds it: what
    /// `qpalgo depth --curve` needs of a camera without camera.json, and `qpalgo calibrate-depth` brings to a real one.
    ///
    /// Example: qpgen curve my-camera.toml --nearest-m 0.3 --counted-from sensor -o curve.json
    #[command(verbatim_doc_comment)]
    Curve(curve::CurveArgs),
    /// A pixel's angular response: the table that the renderer uses, or P at a few angles.
    ///
    /// Example: qpgen response --pixel 1.6um --theta-deg 0,5,10 --phi-deg 0
    ///
    /// Example: qpgen response --pixel 1.6um --model rcwa --preset draft --shifts 8 -o all-shifts.npz
    #[command(verbatim_doc_comment)]
    Response(response::ResponseArgs),
    /// The paper's studies of the pixel and the sensor: rejection ratio, microlenses, pitch, wavelength, filter,
    /// tungsten, mosaic, chief rays, flat field, size.
    ///
    /// Example: qpgen study rejection --pixel 3.5um,2.8um --out study
    ///
    /// Example: qpgen study size --pixel 3.5um,1.6um --out study
    ///
    /// Example: qpgen study mosaic --model rcwa --preset draft --theta-step-deg 5 --out study
    #[command(verbatim_doc_comment)]
    Study(study::StudyArgs),
    /// Experiments 1 and 2 of the paper's section 2.2.2: does the renderer give back the response put in?
    ///
    /// Example: qpgen validate --pixel 2.8um --out validation
    #[command(verbatim_doc_comment)]
    Validate(validate::ValidateArgs),
    /// What accuracy costs: error (against converged references) over time, for each knob.
    ///
    /// Example: qpgen accuracy rays levels --out accuracy
    #[command(verbatim_doc_comment)]
    Accuracy(accuracy::AccuracyArgs),
    /// Fits pixel, lens and shift law of a camera to what was measured of it: kernels of both views over the field and
    /// white sheets, textured planes at known distances, or all of these. Each parameter comes with its uncertainty;
    /// what was kept out is predicted. The layers of the pixel are not told one by one, see --trials.
    ///
    /// Example: qpgen fit --print-capture > capture.toml; qpgen fit capture.toml -o my-camera
    #[command(verbatim_doc_comment)]
    Fit(fit::FitArgs),
    /// Tables and pictures of a main lens.
    ///
    /// Example: qpgen lens info wide_US20120327520A1_emb3
    Lens(lens::LensArgs),
    /// Checks a dataset: schema, hashes, sizes, ranges, NaN rules.
    ///
    /// Example: qpgen check out
    #[command(verbatim_doc_comment)]
    Check(check::CheckArgs),
    /// Writes a dataset in a layout that published training code reads: DPDD, QPDNet, WebDataset shards.
    ///
    /// Example: qpgen export out --layout dpdd -o dpdd
    #[command(verbatim_doc_comment)]
    Export(export::ExportArgs),
}

impl Command {
    /// Whether stderr is for programs too.
    fn json(&self) -> bool {
        match self {
            Self::Convert(args) => args.json,
            Self::Dataset(args) => args.json,
            Self::Merge(args) => args.json,
            Self::Check(args) => args.json,
            Self::Preview(args) => args.json,
            Self::Render(args) => args.json,
            Self::Psf(args) => args.json,
            Self::Curve(args) => args.json,
            Self::Response(args) => args.json,
            Self::Study(args) => args.json,
            Self::Validate(args) => args.json,
            Self::Accuracy(args) => args.json,
            Self::Fit(args) => args.json,
            Self::Lens(_) => false,
            Self::Export(args) => args.json,
        }
    }
}

/// Runs the program with its arguments, its own name first, and returns its exit code. Sets threads and handlers of
/// signals of the whole process, so at most once in each.
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let cli: Cli = match parse(args) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let level = if cli.quiet { Level::Warn } else { cli.log };
    let log = Log { level, json: false };
    let json = cli.command.json();
    match run(cli, log) {
        Ok(()) => 0,
        Err(error) => {
            let fields = [("exit_code", error.exit_code().into())];
            log.json(json)
                .line(Level::Error, &error.to_string(), &fields);
            error.exit_code()
        }
    }
}

fn run(cli: Cli, log: Log) -> Result<(), CommandError> {
    exit_on_closed_pipe()?;
    fail_on_file_size_limit()?;
    limit(cli.max_memory)?;
    use_threads(cli.threads)?;
    match cli.command {
        Command::Convert(args) => convert::run(&args, log),
        Command::Dataset(args) => dataset::run(&args, log),
        Command::Merge(args) => merge::run(&args, log),
        Command::Preview(args) => preview::run(&args),
        Command::Render(args) => render::run(&args, log),
        Command::Psf(args) => psf::run(&args, log),
        Command::Curve(args) => curve::run(&args, log),
        Command::Response(args) => response::run(&args, log),
        Command::Study(args) => study::run(&args, log),
        Command::Validate(args) => validate::run(&args, log),
        Command::Accuracy(args) => accuracy::run(&args, log),
        Command::Fit(args) => fit::run(&args, log),
        Command::Lens(args) => lens::run(args, log),
        Command::Check(args) => check::run(&args, log),
        Command::Export(args) => export::run(&args),
    }
}
