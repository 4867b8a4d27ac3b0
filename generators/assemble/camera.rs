//! From a recipe to its camera.

use glam::DVec2;
use quadpixel::lens::{Lens, Reflections};
use quadpixel::render::Camera;
use quadpixel::response::Response;
use quadpixel::sensor::Sensor;

use super::lens;
use crate::field_error::FieldError;
use crate::recipe::{LensRecipe, Recipe, RecipeError, WindowRecipe};
use crate::scenes::field_of_view::centre_at;

/// The camera of a recipe.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn camera(recipe: &Recipe, response: &Response) -> Result<Camera, RecipeError> {
    camera_behind(&lens(&recipe.lens)?, recipe, response)
}

/// The camera of a recipe behind its lens.
pub(super) fn camera_behind(
    lens: &Lens,
    recipe: &Recipe,
    response: &Response,
) -> Result<Camera, RecipeError> {
    let reflections = Reflections::new(lens, &recipe.lens.reflections)?;
    let camera = focused_camera(recipe, lens, response)?;
    Ok(camera.with_lens_diffraction().with_reflections(reflections))
}

/// The camera of a recipe with its lens focused as given.
fn focused_camera(
    recipe: &Recipe,
    lens: &Lens,
    response: &Response,
) -> Result<Camera, RecipeError> {
    let wavelengths = recipe.wavelengths()?;
    let centre = match recipe.sensor.window {
        WindowRecipe::Centre => DVec2::ZERO,
        WindowRecipe::Position { x_mm, y_mm } => DVec2::new(x_mm, y_mm),
        WindowRecipe::ChiefRayAngle { theta_deg, phi_deg } => {
            let system = lens.at(wavelengths.reference_nm())?;
            centre_at(&system, theta_deg, phi_deg)?
        }
    };
    let size = (recipe.sensor.width, recipe.sensor.height);
    let sensor = Sensor::new(
        recipe.sensor.pitch_um,
        recipe.sensor.subpixels,
        size,
        centre,
    )?;
    let offset_um = DVec2::from(recipe.sensor.microlens_offset_um);
    if !offset_um.is_finite() {
        let field = "sensor.microlens_offset_um";
        return Err(FieldError::new(field, offset_um, "finite lengths").into());
    }
    let camera = Camera::new(
        lens,
        sensor,
        recipe.sensor.microlens_shift,
        response,
        wavelengths,
    )?;
    let law = recipe.sensor.microlens_law;
    if !law.is_finite() {
        let field = "sensor.microlens_law";
        return Err(FieldError::new(field, format!("{law:?}"), "finite numbers").into());
    }
    Ok(camera
        .with_microlens_law(law)
        .with_microlens_offset_um(offset_um))
}

/// The camera in front of which the recipe's cards are laid out, where that is not its own.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn framing_camera(recipe: &Recipe, response: &Response) -> Result<Option<Camera>, RecipeError> {
    let framing = |focus_mm| {
        let aligned = LensRecipe {
            focus_mm: Some(focus_mm),
            ..recipe.lens.clone()
        };
        focused_camera(recipe, &lens(&aligned)?, response)
    };
    recipe.framing_focus_mm.map(framing).transpose()
}
