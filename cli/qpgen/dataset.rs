//! `qpgen dataset`: arguments, and what is printed.

use crate::{out, outln};
use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel::em::Preset;
use quadpixel::file;

use crate::log::{Level, Log};
use crate::progress::Progress;
use crate::qpgen::camera_arg::CameraArg;
use crate::qpgen::effect_args::EffectArgs;
use crate::qpgen::pixel_model::presets;
use crate::shard_env::ShardArgs;
use crate::stop::Stop;
use quadpixel_generators::config::{DEFAULT_TOML, DatasetConfig, preset};
use quadpixel_generators::production::dataset;
use quadpixel_generators::production::estimate;
use quadpixel_generators::writer::Foreign;

/// Arguments of `qpgen dataset`.
#[derive(Args)]
pub struct DatasetArgs {
    /// Configuration file (TOML), such as one made by --print-config; absent: the built-in one.
    #[arg(long)]
    config: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArg,
    /// Number of samples; absent: as the configuration says.
    #[arg(long)]
    count: Option<usize>,
    /// Seed of all random numbers: the same seed gives the same bytes; absent: as the configuration says.
    #[arg(long)]
    seed: Option<u64>,
    /// Folder of the dataset. If an earlier run with the same configuration stopped there, it goes on.
    #[arg(long, default_value = "out")]
    out: PathBuf,
    /// Replaces and removes files of others where the gallery (index.html), the data card (README.md, plots/) and the
    /// lists (splits/) go; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    effects: EffectArgs,
    #[command(flatten)]
    shard: ShardArgs,
    /// Prints the default configuration with comments, and stops.
    #[arg(long)]
    print_config: bool,
    /// Number of rays, and fineness of the response tables; overrides the configuration.
    #[arg(long, value_parser = presets(|p| Some(preset::about(p))))]
    preset: Option<Preset>,
    /// Renders a few trial samples, prints the time (s), memory and disk (MB) and noise to expect, and stops.
    #[arg(long)]
    estimate: bool,
    /// Prints one JSON object on stdout at the end, and progress as one JSON object per line on stderr.
    #[arg(long)]
    pub json: bool,
}

/// What `--force` says.
pub(crate) fn foreign(force: bool) -> Foreign {
    match force {
        true => Foreign::Replace,
        false => Foreign::Refuse,
    }
}

/// Makes a dataset or a part of one, and prints what was done.
///
/// # Errors
/// Bad arguments, a bad configuration, a folder of another one (2); a disk that fails, or a signal that ended the run
/// (1).
pub fn run(args: &DatasetArgs, log: Log) -> Result<(), CommandError> {
    if args.print_config {
        out!("{DEFAULT_TOML}");
        return Ok(());
    }
    let mut config = match &args.config {
        None => DatasetConfig::from_toml(DEFAULT_TOML, "built-in configuration")?,
        Some(path) => {
            let name = path.display().to_string();
            let text = file::read_text(path).map_err(CommandError::input)?;
            DatasetConfig::from_toml(&text, &name)?
        }
    };
    for warning in args.camera.put_into(&mut config)? {
        log.line(Level::Warn, &warning, &[]);
    }
    for unread in config.lens.listed()? {
        log.line(Level::Warn, &format!("skipped: {unread}"), &[]);
    }
    if let Some(rgbd) = &mut config.scene.rgbd {
        for alone in rgbd.listed()? {
            log.line(Level::Warn, &format!("skipped: {alone}"), &[]);
        }
    }
    config.count = args.count.unwrap_or(config.count);
    config.seed = args.seed.unwrap_or(config.seed);
    args.effects
        .apply(&mut config.effects, &mut config.tolerance);
    if let Some(preset) = args.preset {
        preset::apply(preset, &mut config);
    }
    let log = log.json(args.json);
    if args.estimate {
        let progress = Progress::stopped_by(log, Stop::on_signals()?);
        let shard = args.shard.shard(&progress)?;
        let expected = estimate::estimate(&config, &args.out, shard, &progress)?;
        match args.json {
            true => outln!("{}", serde_json::json!(expected)),
            false => outln!("{expected}"),
        }
        return Ok(());
    }
    let progress = Progress::stopped_by(log, Stop::on_signals()?);
    let shard = args.shard.shard(&progress)?;
    let began = std::time::Instant::now();
    let done = dataset::make_part(&config, &args.out, shard, foreign(args.force), &progress)?;
    let seconds = began.elapsed().as_secs_f64();
    let gallery = done.gallery.as_ref().map(|path| path.display().to_string());
    if args.json {
        let object = serde_json::json!({
            "samples": done.samples, "reused": done.reused, "seconds": seconds, "gallery": gallery,
            "shard": shard.to_string(), "stages": done.stages
        });
        outln!("{object}");
        return Ok(());
    }
    let reused = if done.reused > 0 {
        format!(" ({} of an earlier run)", done.reused)
    } else {
        String::new()
    };
    outln!(
        "{} samples{reused} in {seconds:.1} s: {}",
        done.samples,
        done.stages
    );
    match gallery {
        Some(gallery) => outln!("gallery: {gallery}"),
        None => outln!(
            "shard {} is done; when all are: qpgen merge {}",
            shard,
            args.out.display()
        ),
    }
    Ok(())
}
