//! `qpgen convert`: pictures with depth into a dataset.

mod found;

use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use crate::log::{self, Log};
use crate::number::number;
use crate::outln;
use crate::progress::Progress;
use crate::stop::Stop;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::shard::Shard;
use quadpixel_generators::config::{
    DEFAULT_TOML, DatasetConfig, Draw, Range, RgbdConfig, Scale, WindowConfig,
};
use quadpixel_generators::production::dataset;
use quadpixel_generators::rgbd::{Level, Preset};

use found::Found;

use crate::qpgen::camera_arg::CameraArg;
use crate::qpgen::dataset::foreign;
use crate::qpgen::effect_args::EffectArgs;
use crate::qpgen::meaning_args::MeaningArgs;

/// Arguments of `qpgen convert`.
#[derive(Args)]
pub struct ConvertArgs {
    /// Picture, or folder of pictures: PNG (8, 16 bit), JPEG, TIFF, EXR, PFM, NPY. Each pixel is one microlens: the
    /// sensor window has the picture's size.
    #[arg(long)]
    image: PathBuf,
    /// Its depth, or a folder of depths: files of the same stems and sizes (PNG, TIFF, EXR, PFM, NPY).
    ///
    /// Holes are: NaN, 0 and below of z and ray; NaN, infinity and below 0 of inverse depth; NaN, infinity, 0 and
    /// below of disparity; the number of --hole; what is nearer than --nearest-m. Sky (no parallax) is: infinity of z
    /// and ray, 0 of inverse depth. A hole takes the farthest depth beside it. Behind depth edges the background goes
    /// on, its picture mirrored; so it is beyond the picture's sides. Where more than a twentieth of a pixel's light,
    /// or its depth, is made up like this, `valid` says no. Transparency and the orientation of a JPEG are left aside;
    /// light below 0 is 0, NaN is refused.
    #[arg(long, required_unless_present = "preset")]
    depth: Option<PathBuf>,
    /// Published folder layout below --image, in the place of --depth: `pairs` (rgb/STEM, depth/STEM), `nyuv2`
    /// (N_colors.png, N_depth.png; or rgb_N, sync_depth_N; mm), `flyingthings3d` (frames_cleanpass/…/left/N.png,
    /// disparity/…/left/N.pfm; its unit is a metre), `hypersim` (scene_cam_C_final_hdf5/frame.N.color.exr,
    /// scene_cam_C_geometry_hdf5/frame.N.depth_meters.exr, or .npy: exported from .hdf5; m along the ray), `middlebury`
    /// (SCENE/im0.png, disp0.pfm, calib.txt). What the numbers mean comes with it; a flag stands before that.
    #[arg(long, value_enum, conflicts_with = "depth")]
    preset: Option<PresetName>,
    /// Folder of the dataset. If an earlier run with the same input stopped there, it goes on.
    #[arg(long, short)]
    out: PathBuf,
    /// Configuration of lens, sensor, response, noise and the rest (TOML, see `qpgen dataset --print-config`); absent:
    /// the built-in one, its window around the axis.
    #[arg(long)]
    config: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArg,
    #[command(flatten)]
    meaning: MeaningArgs,
    /// Lens: a name of `qpgen lens list`, or a .json, .zmx or .seq file; absent: as the configuration says.
    #[arg(long)]
    lens: Option<String>,
    /// F-number to stop down to; absent: as the configuration says.
    #[arg(value_parser = number, long)]
    f_number: Option<f64>,
    /// Depth in focus, m; absent: drawn for each sample among the depths of its picture, from the 10 % nearest to the
    /// 90 % nearest, or as the configuration says.
    #[arg(value_parser = number, long)]
    focus_m: Option<f64>,
    /// How: `psf`, kernels of every sub-pixel scattered from layers of depth; or `rays`, the picture as surfaces
    /// through the renderer, with the configuration's `rays_per_pixel`: exact lens, response and occlusion, and far
    /// slower. Absent: as the configuration says, or psf. Both see the same surfaces, made-up ones included.
    #[arg(long, value_enum)]
    level: Option<LevelName>,
    /// Samples; absent: one per picture. The pictures are taken in turn.
    #[arg(long)]
    count: Option<usize>,
    /// Seed of all random numbers; absent: as the configuration says.
    #[arg(long)]
    seed: Option<u64>,
    #[command(flatten)]
    effects: EffectArgs,
    /// Replaces and removes files of others where the gallery, the data card and the lists go.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end, and progress as one JSON object per line on stderr.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetName {
    /// Two folders of the same stems.
    Pairs,
    /// NYU Depth V2.
    Nyuv2,
    /// FlyingThings3D.
    Flyingthings3d,
    /// Hypersim.
    Hypersim,
    /// Middlebury stereo.
    Middlebury,
}

impl PresetName {
    fn preset(self) -> Preset {
        match self {
            Self::Pairs => Preset::Pairs,
            Self::Nyuv2 => Preset::Nyuv2,
            Self::Flyingthings3d => Preset::Flyingthings3d,
            Self::Hypersim => Preset::Hypersim,
            Self::Middlebury => Preset::Middlebury,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum LevelName {
    /// By kernels.
    Psf,
    /// By rays.
    Rays,
}

/// Converts, and prints what was done.
///
/// # Errors
/// No pair that can be converted, bad arguments, a folder of another dataset (2); a disk that fails, or a signal (1).
pub fn run(args: &ConvertArgs, log: Log) -> Result<(), CommandError> {
    let log = log.json(args.json);
    let mut config = configuration(args, log)?;
    let preset = args.preset.map(|name| name.preset().meaning());
    let meaning = args.meaning.meaning().or(preset.unwrap_or_default());
    meaning.check().map_err(CommandError::input)?;
    let progress = Progress::stopped_by(log, Stop::on_signals()?);
    let mut found = Found::read(args, &meaning, &progress)?;
    let text = |path: &Path| path.display().to_string();
    let rgbd = RgbdConfig {
        preset: None,
        image: None,
        depth: None,
        pairs: Vec::new(),
        meaning,
        level: level(args, &config),
        focus_share: focus_share(args, &config),
    };
    config = found.configured(args, &config, &rgbd, &progress)?;
    let began = std::time::Instant::now();
    let done = dataset::make_part(
        &config,
        &args.out,
        Shard::WHOLE,
        foreign(args.force),
        &progress,
    )?;
    let seconds = began.elapsed().as_secs_f64();
    let gallery = done.gallery.as_ref().map(|path| text(path));
    if args.json {
        let object = serde_json::json!({
            "samples": done.samples, "reused": done.reused, "skipped": found.skipped, "seconds": seconds,
            "gallery": gallery, "stages": done.stages
        });
        outln!("{object}");
        return Ok(());
    }
    outln!(
        "{} samples in {seconds:.1} s: {}",
        done.samples,
        done.stages
    );
    if !found.skipped.is_empty() {
        outln!("{} skipped, listed above", found.skipped.len());
    }
    outln!("gallery: {}", gallery.unwrap_or_default());
    Ok(())
}

fn level(args: &ConvertArgs, config: &DatasetConfig) -> Level {
    match args.level {
        Some(LevelName::Psf) => Level::Psf,
        Some(LevelName::Rays) => Level::Rays,
        None => config
            .scene
            .rgbd
            .as_ref()
            .map(|rgbd| rgbd.level)
            .unwrap_or_default(),
    }
}

/// Where the focus is drawn among a picture's depths: nowhere where an argument or the configuration says it.
fn focus_share(args: &ConvertArgs, config: &DatasetConfig) -> Option<Draw> {
    if let Some(rgbd) = &config.scene.rgbd {
        return rgbd.focus_share.filter(|_| args.focus_m.is_none());
    }
    let whole = Range {
        min: 0.1,
        max: 0.9,
        scale: Scale::Linear,
    };
    (args.focus_m.is_none() && args.config.is_none()).then_some(Draw::Range(whole))
}

fn configuration(args: &ConvertArgs, log: Log) -> Result<DatasetConfig, CommandError> {
    let mut config = match &args.config {
        Some(path) => {
            let text = file::read_text(path).map_err(CommandError::input)?;
            DatasetConfig::from_toml(&text, &path.display().to_string())?
        }
        None => {
            let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "built-in configuration")?;
            config.sensor.window = WindowConfig::Centre;
            config.exposure_ev = Draw::Fixed(0.0);
            config
        }
    };
    config.scene.world = None;
    config.seed = args.seed.unwrap_or(config.seed);
    let warnings = args.camera.put_into(&mut config)?;
    if args.lens.is_none() {
        let warnings = warnings.iter();
        warnings.for_each(|warning| log.line(log::Level::Warn, warning, &[]));
    } else if args.camera.camera.is_some() {
        // What the file says of its lens is not for another one.
        (config.lens.focal_length_mm, config.lens.f_number) = (None, None);
    }
    if let Some(lens) = &args.lens {
        config.lens.names = vec![lens.clone()];
        (config.lens.from, config.lens.filter) = (None, None);
    }
    if let Some(f_number) = args.f_number {
        config.lens.f_number = Some(Draw::Fixed(f_number));
    }
    if let Some(focus_m) = args.focus_m {
        config.lens.focus_mm = Draw::Fixed(1e3 * focus_m);
    }
    args.effects
        .apply(&mut config.effects, &mut config.tolerance);
    Ok(config)
}
