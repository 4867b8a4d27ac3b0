//! `qpgen render`: one image from a recipe or scene file.

use crate::{out, outln};
use std::path::{Path, PathBuf};

use clap::Args;

use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::progress::Progress;
use crate::qpgen::camera_arg::CameraArg;
use crate::qpgen::coarse::Coarse;
use crate::qpgen::effect_args::EffectArgs;
use crate::qpgen::scene_args::SceneArgs;
use quadpixel::effects::{Choice, Effect};
use quadpixel::file;
use quadpixel::hash::json_hash;
use quadpixel::render::RayRecord;
use quadpixel_generators::assemble::Responses;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::recipe::{Recipe, SampleId, parse_recipe, read_recipe};
use quadpixel_generators::sample::stages::timed;
use quadpixel_generators::sample::{Prepared, Rays, SampleError, prepare};
use quadpixel_generators::writer::{Place, write_alone};

/// The built-in recipe, with comments.
pub const DEFAULT_TOML: &str = include_str!("scene.toml");

/// Arguments of `qpgen render`.
#[derive(Args)]
pub struct RenderArgs {
    /// Recipe of lens, sensor, response and cards (TOML, see --print-scene), or the meta.json of a sample; absent: the
    /// built-in one.
    scene: Option<PathBuf>,
    /// New folder to write, with the files of a dataset's sample.
    #[arg(long, short, default_value = "render")]
    out: PathBuf,
    /// Prints the built-in recipe with comments, and stops.
    #[arg(long)]
    print_scene: bool,
    #[command(flatten)]
    camera: CameraArg,
    #[command(flatten)]
    scene_args: SceneArgs,
    #[command(flatten)]
    effects: EffectArgs,
    /// Writes the radiance of every ray to this file (.npz), for --from-rays. Small lamps get no rays of their own
    /// then: a world with lamps in sight has more speckles.
    #[arg(long, value_name = "FILE")]
    keep_rays: Option<PathBuf>,
    /// Traces nothing and takes the rays of a --keep-rays file. The recipe may differ from that of the file in its
    /// response, sub-pixels, microlens shift, readout and exposure.
    #[arg(long, value_name = "FILE", conflicts_with = "keep_rays")]
    from_rays: Option<PathBuf>,
    /// Replaces an OUT-first.jpg that is there; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

/// `OUT-first.jpg`.
fn first_look_path(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_os_string();
    name.push("-first.jpg");
    out.with_file_name(name)
}

/// Everything that will be written can be, and replaces nothing of others.
fn check_outputs(args: &RenderArgs, recipe: &Recipe) -> Result<(), CommandError> {
    let refused =
        |path: &Path, what: &str| Err(CommandError::input(format!("{}: {what}", path.display())));
    let out = &args.out;
    if out.symlink_metadata().is_ok() {
        let place = PathBuf::from(format!("--out {}", out.display()));
        return refused(&place, "is there already; allowed: a new folder");
    }
    let first = first_look_path(out);
    if recipe.world.is_some() && !args.force && first.symlink_metadata().is_ok() {
        return refused(
            &first,
            "is there already; move it away, or give --force, which replaces it",
        );
    }
    let parent = out.parent().filter(|p| !p.as_os_str().is_empty());
    file::probe_folder(parent.unwrap_or(Path::new(".")))?;
    match &args.keep_rays {
        Some(path) => Ok(file::probe_file(path)?),
        None => Ok(()),
    }
}

/// A coarse picture beside the output folder while the fine one is made; finds the exposure where none was given.
fn first_look(
    args: &RenderArgs,
    prepared: &mut Prepared,
    progress: &Progress,
    finds_exposure: bool,
) -> Result<(), CommandError> {
    let coarse = Coarse::new(prepared)?;
    if finds_exposure {
        prepared.expose(coarse.exposure_ev());
    }
    let path = first_look_path(&args.out);
    coarse.write(&path, prepared.recipe().exposure_ev)?;
    progress.info(&format!("first look: {}", path.display()));
    Ok(())
}

/// The rays of a file, if they are those of the recipe, which then has their wavelengths.
fn kept_rays(path: &Path, recipe: &mut Recipe) -> Result<RayRecord, CommandError> {
    let input = |e: String| CommandError::input(e);
    let (record, about) = RayRecord::read_npz(path).map_err(|e| input(e.to_string()))?;
    let kept: Recipe = serde_json::from_value(about)
        .map_err(|e| input(format!("{}: its recipe: {e}", path.display())))?;
    // What the pixel does with the rays may differ.
    let mut expected = recipe.clone();
    expected.response = kept.response.clone();
    expected.sensor.subpixels = kept.sensor.subpixels;
    expected.sensor.microlens_shift = kept.sensor.microlens_shift;
    expected.exposure_ev = kept.exposure_ev;
    expected.readout.clone_from(&kept.readout);
    expected.sensor.microlens_offset_um = kept.sensor.microlens_offset_um;
    // Where the recipe leaves it open, the first pixel's call for bands was heard when the rays were traced.
    expected.spectrum = expected.spectrum.or(kept.spectrum);
    if expected == kept {
        recipe.spectrum = kept.spectrum;
        if recipe.spectrum.is_none() && recipe.effects.is_auto() {
            let bands = [Effect::ResponseSpectrum, Effect::Wavelengths];
            let others = Effect::SELECTABLE.into_iter();
            recipe.effects = Choice::Only(others.filter(|e| !bands.contains(e)).collect());
        }
        return Ok(record);
    }
    Err(input(format!(
        "{}: holds the rays of another recipe; allowed: one that differs in response, subpixels, microlens_shift, microlens_offset_um, readout and exposure_ev only",
        path.display()
    )))
}

/// The recipe, and what it is called.
fn recipe(args: &RenderArgs, log: Log) -> Result<(Recipe, String), CommandError> {
    let built_in = "built-in recipe";
    let (mut recipe, name) = match (&args.scene, &args.scene_args.file) {
        (Some(path), _) => (read_recipe(path)?, path.display().to_string()),
        (None, Some(file)) => (args.scene_args.recipe(file)?, file.clone()),
        (None, None) => (parse_recipe(DEFAULT_TOML, built_in)?, built_in.to_owned()),
    };
    for warning in args.camera.put_into_recipe(&mut recipe)? {
        log.line(Level::Warn, &warning, &[]);
    }
    args.effects
        .apply(&mut recipe.effects, &mut recipe.tolerance);
    Ok((recipe, name))
}

/// Renders a recipe into a new folder, with the files of a sample.
///
/// # Errors
/// A bad recipe or a folder that is there already (2), or a disk that fails (1).
pub fn run(args: &RenderArgs, log: Log) -> Result<(), CommandError> {
    if args.print_scene {
        out!("{DEFAULT_TOML}");
        return Ok(());
    }
    let (mut recipe, name) = recipe(args, log)?;
    check_outputs(args, &recipe)?;
    let out = &args.out;
    let rays = match (&args.keep_rays, &args.from_rays) {
        (_, Some(path)) => Rays::Develop(Box::new(kept_rays(path, &mut recipe)?)),
        (Some(_), None) => Rays::Keep,
        (None, None) => Rays::Trace,
    };
    let mut responses = Responses::new();
    let progress = Progress::new(log.json(args.json));
    progress.event(Event::Start {
        samples: 1,
        rays: recipe.rays(),
    });
    let mut prepared = prepare(&recipe, &mut responses, &progress).map_err(|e| e.within(&name))?;
    // Kept rays need no first look, but for the exposure.
    let finds_exposure = args.scene_args.file.is_some() && args.scene_args.exposure_ev.is_none();
    if recipe.world.is_some() && (args.from_rays.is_none() || finds_exposure) {
        first_look(args, &mut prepared, &progress, finds_exposure)?;
    }
    let about = serde_json::to_value(prepared.recipe())
        .map_err(|e| CommandError::failed(format!("recipe: {e}")))?;
    let id = SampleId {
        index: 0,
        configuration_blake3: json_hash(&about),
    };
    let within = |e: SampleError| CommandError::from(e).within(&name);
    let made = if prepared.is_large() && matches!(rays, Rays::Trace) {
        let rows = prepared.by_rows(id).map_err(within)?;
        rows.write(Place::Alone(out), &progress)?
    } else {
        let rendered = prepared.render(id, rays, &progress);
        let (mut sample, record) = rendered.map_err(within)?;
        if let (Some(record), Some(path)) = (record, &args.keep_rays) {
            let written = record.write_npz(path, &about);
            written.map_err(CommandError::failed)?;
        }
        let mut stages = sample.made.stages;
        timed(&mut stages.writing_s, || write_alone(out, &sample.files()))?;
        sample.made.stages = stages;
        sample.made
    };
    for warning in responses.take_warnings() {
        progress.warn(&warning);
    }
    made.report(&progress, &name);
    progress.event(Event::SampleDone);
    progress.finish();
    let (d, stages) = (&made.description, made.stages);
    let lost = d.lost.missed + d.lost.vignetted + d.lost.total_internal_reflection;
    let preview = out.join(quadpixel_datasets::paths::PREVIEW);
    if args.json {
        let object = serde_json::json!({
            "rays": d.rays, "lost": { "vignetted": d.lost.vignetted, "missed": d.lost.missed,
            "total_internal_reflection": d.lost.total_internal_reflection },
            "rms_error_over_mean": d.errors.map(|e| e.rms_over_mean), "median_relative_error": d.errors.map(|e| e.median_relative), "effects": made.decisions, "stages": stages, "preview": preview.display().to_string()
        });
        outln!("{object}");
        return Ok(());
    }
    let spread = match (d.errors, &args.from_rays) {
        (Some(e), _) => format!("{:.2} % (median)", 100.0 * e.median_relative),
        (None, Some(_)) => "not measured (kept rays)".into(),
        (None, None) => "none (black)".into(),
    };
    let part = 100.0 * lost as f64 / d.rays.max(1) as f64;
    outln!(
        "{:.1} M rays, {part:.1} % lost, error of a value {spread}; {stages}",
        d.rays as f64 * 1e-6
    );
    outln!("preview: {}", preview.display());
    Ok(())
}
