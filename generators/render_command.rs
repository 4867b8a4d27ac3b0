//! `qpgen render`: one image from a recipe file.

use std::path::{Path, PathBuf};

use crate::assemble::Responses;
use crate::command_error::CommandError;
use crate::dataset::write_error;
use crate::progress::Progress;
use crate::recipe::Recipe;
use crate::sample::{SampleId, render_sample};
use crate::writer::{configuration_hash, write_alone};

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
    toml::from_str(&text).map_err(|e| CommandError::input(format!("{name}: {e}")))
}

/// Renders the recipe in `scene` into the folder `out`, with the files of a sample.
///
/// # Errors
/// A bad recipe, a folder that is there already, or a disk that fails.
pub fn run(scene: &Path, out: &Path, progress: &Progress) -> Result<PathBuf, CommandError> {
    let recipe = read_recipe(scene)?;
    let json =
        serde_json::to_value(&recipe).map_err(|e| CommandError::failed(format!("recipe: {e}")))?;
    let id = SampleId {
        index: 0,
        configuration_blake3: configuration_hash(&json),
    };
    let mut responses = Responses::new();
    let pixels = recipe.sensor.width as u64 * recipe.sensor.height as u64;
    progress.start(1, 3 * pixels * recipe.render.rays_per_pixel as u64);
    let angles = |done: usize, total: usize| progress.angles(done, total);
    let sample = render_sample(&recipe, id, &mut responses, &angles, &|n| progress.rays(n))
        .map_err(|e| e.within(&scene.display().to_string()))?;
    responses
        .take_warnings()
        .iter()
        .for_each(|w| progress.warn(w));
    write_alone(out, &sample.files()).map_err(write_error)?;
    progress.sample_done();
    progress.finish();
    Ok(out.join("preview.jpg"))
}
