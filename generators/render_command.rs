//! `qpgen render`: one image from a recipe file.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::assemble::Responses;
use crate::dataset::write_error;
use crate::log::Log;
use crate::progress::Progress;
use crate::recipe::Recipe;
use crate::sample::{SampleId, render_sample};
use crate::stages::timed;
use crate::writer::{configuration_hash, write_alone};
use quadpixel::command::CommandError;

/// The built-in recipe, with comments.
pub const DEFAULT_TOML: &str = include_str!("scene.toml");

/// Arguments of `qpgen render`.
#[derive(Args)]
pub struct RenderArgs {
    /// Recipe: lens, sensor, response, cards (TOML), or the meta.json of a sample; absent: the built-in one.
    scene: Option<PathBuf>,
    /// New folder to write, with the files of a dataset's sample.
    #[arg(long, short, default_value = "render")]
    out: PathBuf,
    /// Prints the built-in recipe with comments, and stops.
    #[arg(long)]
    print_scene: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

/// Reads a recipe: TOML, or the `scene.parameters` of a sample's `meta.json`.
///
/// # Errors
/// A file that cannot be read, or is no recipe: names the file and the place.
pub fn read_recipe(path: &Path) -> Result<Recipe, CommandError> {
    let name = path.display();
    let text =
        std::fs::read_to_string(path).map_err(|e| CommandError::input(format!("{name}: {e}")))?;
    if path.extension().is_some_and(|e| e == "json") {
        let meta: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| CommandError::input(format!("{name}: {e}")))?;
        let parameters = meta.pointer("/scene/parameters").unwrap_or(&meta).clone();
        return serde_json::from_value(parameters)
            .map_err(|e| CommandError::input(format!("{name}: {e}")));
    }
    parse(&text, &name.to_string())
}

fn parse(text: &str, name: &str) -> Result<Recipe, CommandError> {
    toml::from_str(text).map_err(|e| CommandError::input(format!("{name}: {e}")))
}

/// Renders a recipe into a new folder, with the files of a sample.
///
/// # Errors
/// A bad recipe or a folder that is there already (2), or a disk that fails (1).
pub fn run(args: &RenderArgs, log: Log) -> Result<(), CommandError> {
    if args.print_scene {
        print!("{DEFAULT_TOML}");
        return Ok(());
    }
    let (recipe, name) = match &args.scene {
        Some(path) => (read_recipe(path)?, path.display().to_string()),
        None => (
            parse(DEFAULT_TOML, "built-in recipe")?,
            "built-in recipe".to_string(),
        ),
    };
    let out = &args.out;
    if out.exists() {
        return Err(CommandError::input(format!(
            "--out {}: is there already; allowed: a new folder",
            out.display()
        )));
    }
    let json =
        serde_json::to_value(&recipe).map_err(|e| CommandError::failed(format!("recipe: {e}")))?;
    let id = SampleId {
        index: 0,
        configuration_blake3: configuration_hash(&json),
    };
    let mut responses = Responses::new();
    let progress = Progress::new(log.json(args.json));
    progress.start(1, recipe.rays());
    let angles = |done: usize, total: usize| progress.angles(done, total);
    let sample = render_sample(&recipe, id, &mut responses, &angles, &|n| progress.rays(n))
        .map_err(|e| e.within(&name))?;
    responses
        .take_warnings()
        .iter()
        .for_each(|w| progress.warn(w));
    let mut stages = sample.stages();
    timed(&mut stages.writing_s, || write_alone(out, &sample.files())).map_err(write_error)?;
    progress.sample_done();
    progress.finish();
    let d = sample.description();
    let lost = d.lost.missed + d.lost.vignetted + d.lost.total_internal_reflection;
    let preview = out.join(datasets_spec::paths::PREVIEW);
    if args.json {
        let object = serde_json::json!({
            "rays": d.rays, "lost": { "vignetted": d.lost.vignetted, "missed": d.lost.missed,
            "total_internal_reflection": d.lost.total_internal_reflection },
            "relative_spread": d.mean_relative_standard_error, "stages": stages, "preview": preview
        });
        println!("{object}");
        return Ok(());
    }
    let spread = d
        .mean_relative_standard_error
        .map_or("none (black)".into(), |s| format!("{:.2} %", 100.0 * s));
    let part = 100.0 * lost as f64 / d.rays.max(1) as f64;
    println!(
        "{:.1} M rays, {part:.1} % lost, spread of a sub-pixel {spread}; {stages}",
        d.rays as f64 * 1e-6
    );
    println!("preview: {}", preview.display());
    Ok(())
}
