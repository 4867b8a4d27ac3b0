//! `qpgen`: parse, validate, call the library, return an exit code (0 done, 1 failed, 2 bad arguments or input).

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use generators::config::{DEFAULT_TOML, DatasetConfig};
use generators::progress::Progress;
use generators::{
    check_command, dataset, export, lens_command, render_command, response_command, study,
    validate_command,
};
use quadpixel::command::{CommandError, use_threads};

/// Simulates cameras whose pixels see the pupil in parts (dual-pixel, quad-pixel, m×n) and makes training data with them.
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
    /// Makes a dataset: randomised scenes through a real lens, with true depth and disparity.
    ///
    /// Example: qpgen dataset --count 100 --seed 7 --out data
    #[command(verbatim_doc_comment)]
    Dataset(DatasetArgs),
    /// Renders one image from a recipe (TOML, or the meta.json of a sample), or from a glTF, GLB or OBJ scene. A first, coarse look
    /// at a world of meshes is written as OUT-first.jpg within a second or two.
    ///
    /// Example: qpgen render out/samples/000003/meta.json --out again
    ///
    /// Example: qpgen render --scene shop.glb --focus-mm 1200 --size 640x480 --out shop
    #[command(verbatim_doc_comment)]
    Render(render_command::RenderArgs),
    /// A pixel's angular response: the table that the renderer uses, or P at a few angles.
    ///
    /// Example: qpgen response --pixel 1.6um --theta-deg 0,5,10 --phi-deg 0
    #[command(verbatim_doc_comment)]
    Response(response_command::ResponseArgs),
    /// The paper's studies of the pixel: rejection ratio, microlenses, pitch, wavelength, filter, tungsten.
    ///
    /// Example: qpgen study rejection --pixel 3.5um,2.8um --out study
    #[command(verbatim_doc_comment)]
    Study(study::StudyArgs),
    /// Experiments 1 and 2 of the paper's section 2.2.2: does the renderer give back the response put in?
    ///
    /// Example: qpgen validate --pixel 2.8um --out validation
    #[command(verbatim_doc_comment)]
    Validate(validate_command::ValidateArgs),
    /// Tables and pictures of a main lens.
    Lens(lens_command::LensArgs),
    /// Checks a dataset: schema, hashes, sizes, ranges, NaN rules.
    ///
    /// Example: qpgen check out
    #[command(verbatim_doc_comment)]
    Check(check_command::CheckArgs),
    /// Writes a dataset in a layout that published training code reads: DPDD, QPDNet, WebDataset shards.
    ///
    /// Example: qpgen export out --layout dpdd -o dpdd
    #[command(verbatim_doc_comment)]
    Export(export::ExportArgs),
}

#[derive(Args)]
struct DatasetArgs {
    /// Configuration (TOML); absent: the built-in one.
    #[arg(long)]
    config: Option<PathBuf>,
    /// Number of samples.
    #[arg(long)]
    count: Option<usize>,
    /// Seed: same seed, same bytes.
    #[arg(long)]
    seed: Option<u64>,
    /// Folder of the dataset; one of an earlier run with the same configuration goes on where it stopped.
    #[arg(long, default_value = "out")]
    out: PathBuf,
    /// Prints the default configuration with comments, and stops.
    #[arg(long)]
    print_config: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("qpgen: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(cli: Cli) -> Result<(), CommandError> {
    use_threads(cli.threads)?;
    match cli.command {
        Command::Dataset(args) => make_dataset(&args),
        Command::Render(args) => render_command::run(&args),
        Command::Response(args) => response_command::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Validate(args) => validate_command::run(&args),
        Command::Lens(args) => lens_command::run(args),
        Command::Check(args) => check_command::run(&args),
        Command::Export(args) => export::run(&args),
    }
}

fn make_dataset(args: &DatasetArgs) -> Result<(), CommandError> {
    if args.print_config {
        print!("{DEFAULT_TOML}");
        return Ok(());
    }
    let mut config = match &args.config {
        None => DatasetConfig::from_toml(DEFAULT_TOML, "built-in configuration")?,
        Some(path) => {
            let name = path.display().to_string();
            let text = std::fs::read_to_string(path)
                .map_err(|e| CommandError::input(format!("{name}: {e}")))?;
            DatasetConfig::from_toml(&text, &name)?
        }
    };
    config.count = args.count.unwrap_or(config.count);
    config.seed = args.seed.unwrap_or(config.seed);
    let began = std::time::Instant::now();
    let done = dataset::make(&config, &args.out, &Progress::stderr())?;
    let seconds = began.elapsed().as_secs_f64();
    if args.json {
        let gallery = done.gallery.display().to_string();
        let object = serde_json::json!({
            "samples": done.samples, "reused": done.reused, "seconds": seconds, "gallery": gallery,
            "stages": done.stages
        });
        println!("{object}");
    } else {
        let reused = if done.reused > 0 {
            format!(" ({} of an earlier run)", done.reused)
        } else {
            String::new()
        };
        println!(
            "{} samples{reused} in {seconds:.1} s: {}",
            done.samples, done.stages
        );
        println!("gallery: {}", done.gallery.display());
    }
    Ok(())
}
