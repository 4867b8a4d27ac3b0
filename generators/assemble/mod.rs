//! From a recipe to the camera and the scene that it describes.

mod camera;
mod colour;
mod kept;
mod responses;

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::file;
use quadpixel::lens::{FocusBy, Lens, LensError, Prescription, trace_backward};
use quadpixel::render::Camera;
use quadpixel::scene::world::World;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::Subpixels;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::MM_PER_UM;

use crate::camera_file::CameraFile;
use crate::field_error::FieldError;
use crate::recipe::{ExtentRecipe, LensRecipe, PlaneRecipe, Recipe, RecipeError};
use crate::scenes::WorldRecipe;
use crate::scenes::field_of_view::covering;

pub use camera::{camera, framing_camera};
pub(crate) use colour::{ColourCall, ColourErrors, all_ship, with_colour};
pub(crate) use kept::OfCamera;
pub use responses::Responses;
pub(crate) use responses::{check_quick, quick_plan};

/// The lens of a recipe, focused.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn lens(recipe: &LensRecipe) -> Result<Lens, RecipeError> {
    if let Some(f) = recipe
        .focal_length_mm
        .filter(|f| !(*f > 0.0 && f.is_finite()))
    {
        let allowed = "finite and > 0";
        return Err(FieldError::new("lens.focal_length_mm", f, allowed).into());
    }
    let mut lens = Prescription::named(&recipe.name)
        .and_then(|p| match recipe.focal_length_mm {
            None => Ok(p),
            Some(focal_length_mm) => scaled(&p, focal_length_mm),
        })
        .and_then(|p| match recipe.deviations.as_slice() {
            [] => Ok(p),
            some => p.with_deviations(some),
        })
        .and_then(|p| Lens::new(&p))?;
    if let Some(f) = recipe.f_number {
        lens = lens.with_f_number(f)?;
    }
    let wavelength = ChannelWavelengths::default().reference_nm();
    let focus_mm = recipe.focus_mm.unwrap_or(f64::INFINITY);
    lens = lens.focused_at(focus_mm, FocusBy::Sensor, wavelength)?;
    if recipe.focus_error_um != 0.0 {
        let error_mm = recipe.focus_error_um * MM_PER_UM;
        lens = lens.with_focus_error(error_mm, wavelength)?;
    }
    if recipe.misalignments.is_empty() {
        return Ok(lens);
    }
    Ok(lens.perturbed(&recipe.misalignments)?)
}

/// A lens scaled to a focal length.
fn scaled(lens: &Prescription, focal_length_mm: f64) -> Result<Prescription, LensError> {
    let wavelength = ChannelWavelengths::default().reference_nm();
    let own_mm = Lens::new(lens)?.paraxial(wavelength)?.efl_mm;
    lens.scaled(focal_length_mm / own_mm)
}

/// The scene of a recipe, laid out in front of a camera: its own, or that of its framing.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn scene(recipe: &Recipe, camera: &Camera) -> Result<Scene, RecipeError> {
    Ok(scene_and_warnings(recipe, camera)?.0)
}

/// The scene of a recipe, and what was left out of it.
///
/// # Errors
/// As [`scene`].
pub(crate) fn scene_and_warnings(
    recipe: &Recipe,
    camera: &Camera,
) -> Result<(Scene, Vec<String>), RecipeError> {
    if recipe.rgbd.is_some() {
        if !recipe.planes.is_empty() || recipe.world.is_some() {
            return Err(RecipeError::Incomplete(
                "rgbd: there are planes or a world too; allowed: cards, a world or a picture with depth",
            ));
        }
        // What it shows is not traced. An even wall stands for it where effects are estimated.
        return Ok((Scene::new(Vec::new(), [1.0; 3]), Vec::new()));
    }
    if let Some(world) = &recipe.world {
        return world_scene(recipe, world, camera);
    }
    if recipe.planes.is_empty() {
        return Err(RecipeError::Incomplete(
            "planes is empty; allowed: at least one card",
        ));
    }
    let planes = recipe.planes.iter().enumerate();
    let planes =
        planes.map(|(i, p)| plane(p, camera).map_err(|e| e.within(format!("planes[{i}]"))));
    let planes = planes.collect::<Result<_, _>>()?;
    Ok((Scene::new(planes, recipe.environment), Vec::new()))
}

fn world_scene(
    recipe: &Recipe,
    world: &WorldRecipe,
    camera: &Camera,
) -> Result<(Scene, Vec<String>), RecipeError> {
    if !recipe.planes.is_empty() {
        return Err(RecipeError::Incomplete(
            "planes: there is a world too; allowed: cards or a world",
        ));
    }
    let (description, mut warnings) = world.build(camera)?;
    let checked = World::new(description)?;
    warnings.extend(checked.warnings().lines());
    let scene = Scene::from_world(Arc::new(checked), world.paths);
    Ok((scene, warnings))
}

fn plane(recipe: &PlaneRecipe, camera: &Camera) -> Result<TexturedPlane, RecipeError> {
    let distance = recipe.distance_mm;
    if !(distance.is_finite() && distance > 0.0) {
        return Err(FieldError::new("distance_mm", distance, "a positive length").into());
    }
    let texture = recipe
        .chart
        .generate(recipe.chart_seed, recipe.texture_px)?;
    let coverage = recipe
        .cutout
        .as_ref()
        .map(|c| c.shape.generate(c.seed, recipe.texture_px))
        .transpose()?;
    let tilts = (recipe.tilt_x_deg, recipe.tilt_y_deg, recipe.roll_deg);
    let turn: DMat3 = TexturedPlane::orientation(tilts);
    let (centre, size) = match recipe.extent {
        ExtentRecipe::Fill => {
            let (centre, side) = covering(camera, distance, turn)?;
            (centre, (side, side))
        }
        ExtentRecipe::Window { x, y, size } => {
            let (width, height) = (
                camera.sensor().width() as f64,
                camera.sensor().height() as f64,
            );
            let (column, row) = (x * width - 0.5, y * height - 0.5);
            let centre = seen_at(camera, column, row, distance)?;
            let side = seen_at(camera, column + 0.5, row, distance)?
                - seen_at(camera, column - 0.5, row, distance)?;
            let side = side.length() * size * width;
            (centre, (side, side))
        }
        ExtentRecipe::Mm {
            x_mm,
            y_mm,
            width_mm,
            height_mm,
        } => (DVec3::new(x_mm, y_mm, -distance), (width_mm, height_mm)),
    };
    let coverage = coverage.map(Arc::new);
    Ok(TexturedPlane::new(
        centre,
        size,
        tilts,
        Arc::new(texture),
        coverage,
    )?)
}

/// Where the middle ray of stored-image place (column, row) meets depth `distance_mm`.
fn seen_at(camera: &Camera, column: f64, row: f64, distance_mm: f64) -> Result<DVec3, RecipeError> {
    let place = camera.sensor().position_mm(column, row);
    crate::scenes::field_of_view::middle_ray(camera, place)
        .and_then(|ray| trace_backward(camera.system(1), ray).ok())
        .map(|ray| {
            ray.origin_mm + (-distance_mm - ray.origin_mm.z) / ray.direction.z * ray.direction
        })
        .ok_or(RecipeError::Dark {
            x_mm: place.x,
            y_mm: place.y,
        })
}

/// A pixel by its built-in name or TOML file: its own, or that of a camera.
///
/// # Errors
/// An unknown name, or what is wrong with the file.
pub fn pixel(name: &str) -> Result<PixelStack, RecipeError> {
    let stack = if name.ends_with(".toml") {
        let text = file::read_text(Path::new(name)).map_err(|e| RecipeError::File {
            path: e.path,
            cause: e.cause,
        })?;
        match toml::from_str::<CameraFile>(&text) {
            Ok(camera) => camera.pixel,
            Err(_) => PixelStack::from_toml(&text, name)?,
        }
    } else {
        PixelStack::builtin(name)?
    };
    Ok(stack)
}

/// A pixel by its built-in name or TOML file, with m×n photodiodes.
///
/// # Errors
/// An unknown name, or what is wrong with the file.
pub fn pixel_stack(name: &str, subpixels: Subpixels) -> Result<PixelStack, RecipeError> {
    Ok(PixelStack {
        subpixels,
        ..pixel(name)?
    })
}
