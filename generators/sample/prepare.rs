//! A recipe put together.

use quadpixel::rgbd::DepthPicture;

use super::picture;
use super::prepared::Prepared;
use super::stages::{Stages, timed};
use crate::assemble::{self, Responses};
use crate::lens_tracing;
use crate::observer::Observer;
use crate::recipe::{Recipe, RecipeError};
use crate::rgbd::RgbdRecipe;

/// Lens, response, camera and scene of a recipe.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn prepare(
    recipe: &Recipe,
    responses: &mut Responses,
    observer: &dyn Observer,
) -> Result<Prepared, RecipeError> {
    check(recipe)?;
    let picture = recipe.rgbd.as_ref().map(RgbdRecipe::read).transpose()?;
    put_together(recipe, picture, responses, observer)
}

/// As [`prepare`], of a picture with depth in memory, which the recipe's `rgbd` names.
///
/// # Errors
/// As there; a picture that is not of the sensor window's size.
pub fn prepare_picture(
    recipe: &Recipe,
    picture: DepthPicture,
    responses: &mut Responses,
    observer: &dyn Observer,
) -> Result<Prepared, RecipeError> {
    check(recipe)?;
    put_together(recipe, Some(picture), responses, observer)
}

fn check(recipe: &Recipe) -> Result<(), RecipeError> {
    (recipe.tolerance.check()).map_err(RecipeError::Tolerance)?;
    recipe.check()
}

fn put_together(
    recipe: &Recipe,
    picture: Option<DepthPicture>,
    responses: &mut Responses,
    observer: &dyn Observer,
) -> Result<Prepared, RecipeError> {
    let resolved = match &picture {
        Some(picture) => picture::resolved(recipe, picture)?,
        None => recipe.clone(),
    };
    lens_tracing::check(&resolved.lens_tracing)?;
    let mut stages = Stages::default();
    let called = timed(&mut stages.effects_s, || {
        assemble::with_colour(&resolved, responses)
    })?;
    let (recipe, colours) = (&called.0, called.1);
    let response = timed(&mut stages.response_s, || responses.get(recipe, &observer))?;
    let (camera, known, scene, warnings) = timed(&mut stages.scene_s, || {
        let (camera, known) = responses.camera(recipe, &response)?;
        let framing = assemble::framing_camera(recipe, &response)?;
        let framing = framing.as_ref().unwrap_or(&camera);
        let (scene, warnings) = assemble::scene_and_warnings(recipe, framing)?;
        Ok::<_, RecipeError>((camera, known, scene, warnings))
    })?;
    for warning in &assemble::lens(&recipe.lens)?.prescription().warnings {
        responses.warn(warning.clone());
    }
    let beyond = camera.chief_rays_beyond();
    if beyond > 0.0 {
        responses.warn(format!(
            "chief rays of {:.1} % of the window lie beyond the last one that the response holds a microlens shift for; its shift is taken there",
            100.0 * beyond
        ));
    }
    Ok(Prepared {
        recipe: recipe.clone(),
        colours,
        response,
        camera,
        known,
        scene,
        picture,
        warnings,
        stages,
        maps_for: recipe.render.rays_per_pixel,
    })
}
