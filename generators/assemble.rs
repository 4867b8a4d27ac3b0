//! From a recipe to the camera and the scene that it describes.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::lens::{FocusBy, Lens, Prescription, trace_backward};
use quadpixel::render::Camera;
use quadpixel::response::{
    AngularResponse, CachedTable, GeometricResponse, Response, ResponseCache, TableSettings,
};
use quadpixel::scene::world::World;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::MM_PER_UM;

use crate::field_of_view::{centre_at, covering};
use crate::recipe::{ExtentRecipe, LensRecipe, PlaneRecipe, Recipe, ResponseRecipe, WindowRecipe};
use crate::scenes::WorldRecipe;
use crate::shifted_table::ShiftedTable;
use quadpixel::command::CommandError;

/// Angular responses that several samples share, loaded or computed once.
pub struct Responses {
    cache: ResponseCache,
    loaded: BTreeMap<String, Arc<Response>>,
    warnings: Vec<String>,
}

/// The lens of a recipe, focused.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn lens(recipe: &LensRecipe) -> Result<Lens, CommandError> {
    let input = |e: quadpixel::lens::LensError| CommandError::input(e.to_string());
    let mut lens = Prescription::named(&recipe.name)
        .and_then(|p| match recipe.deviations.as_slice() {
            [] => Ok(p),
            some => p.with_deviations(some),
        })
        .and_then(|p| Lens::new(&p))
        .map_err(input)?;
    if let Some(f) = recipe.f_number {
        lens = lens.with_f_number(f).map_err(input)?;
    }
    let wavelength = ChannelWavelengths::default().reference_nm();
    let focus_mm = recipe.focus_mm.unwrap_or(f64::INFINITY);
    lens = lens
        .focused_at(focus_mm, FocusBy::Sensor, wavelength)
        .map_err(input)?;
    if recipe.focus_error_um != 0.0 {
        let error_mm = recipe.focus_error_um * MM_PER_UM;
        lens = lens.with_focus_error(error_mm, wavelength).map_err(input)?;
    }
    if recipe.misalignments.is_empty() {
        return Ok(lens);
    }
    lens.perturbed(&recipe.misalignments).map_err(input)
}

impl Responses {
    /// Uses the user's cache folder.
    pub fn new() -> Self {
        Self {
            cache: ResponseCache::open(ResponseCache::default_dir()),
            loaded: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }

    /// The response of a recipe. `progress` hears of finished angles (done, total) where one is computed.
    ///
    /// # Errors
    /// An unknown pixel, or what is wrong with a file.
    pub fn get(
        &mut self,
        recipe: &Recipe,
        subpixels: Subpixels,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Arc<Response>, CommandError> {
        let input = |e: &dyn std::fmt::Display| CommandError::input(e.to_string());
        if let ResponseRecipe::Geometric { focal_length_um } = recipe.response {
            let f_number = match recipe.lens.f_number {
                Some(f) => f,
                None => {
                    lens(&recipe.lens)?
                        .paraxial(ChannelWavelengths::default().reference_nm())
                        .map_err(|e| input(&e))?
                        .f_number
                }
            };
            let focal = focal_length_um.unwrap_or(recipe.sensor.pitch_um * f_number);
            let geometric = GeometricResponse::new(subpixels, recipe.sensor.pitch_um, focal)
                .map_err(|e| input(&e))?;
            return Ok(Arc::new(Response::Geometric(geometric)));
        }
        let wavelengths_nm = recipe.wavelengths()?.all_response_nm();
        let at_wavelengths = |settings: TableSettings| TableSettings {
            wavelengths_nm: wavelengths_nm.clone(),
            ..settings
        };
        let key = key(recipe, subpixels)?;
        if let Some(response) = self.loaded.get(&key) {
            return Ok(response.clone());
        }
        let table = match &recipe.response {
            ResponseRecipe::Wave {
                pixel,
                stack_scale,
                shifts: Some(shifts),
                ..
            } => {
                let stack = scaled_stack(pixel, *stack_scale, subpixels)?;
                let asked = ShiftedTable::wave(pixel, *stack_scale, &stack, *shifts);
                let made = asked.at(&wavelengths_nm).made(&self.cache, progress)?;
                self.taken(made)
            }
            ResponseRecipe::Wave { .. } => {
                let Some((stack, settings)) = wave_table(recipe, subpixels)? else {
                    unreachable!("a wave table's recipe");
                };
                let made = self.cache.get_or_build_each(
                    &stack,
                    &settings,
                    ChannelWavelengths::default().reference_nm(),
                    progress,
                );
                self.taken(made.map_err(|e| input(&e))?)
            }
            ResponseRecipe::Fdtd { pixel } => {
                let stack = pixel_stack(pixel, subpixels)?;
                let shipped = AngularResponse::shipped_fdtd(&stack);
                match shipped.map_err(|e| CommandError::failed(e.to_string()))? {
                    // It is of one wavelength.
                    Some(table) if recipe.spectrum.is_none() => table,
                    _ => {
                        let settings = at_wavelengths(TableSettings::fdtd_standard());
                        self.kept("fdtd", pixel, &stack, &settings)?
                    }
                }
            }
            ResponseRecipe::Rcwa {
                pixel,
                shifts: Some(shifts),
            } => {
                let stack = pixel_stack(pixel, subpixels)?;
                let asked = ShiftedTable::rcwa(pixel, &stack, *shifts);
                let asked = asked.at(&wavelengths_nm);
                asked.kept(&self.cache, &mut self.warnings)?
            }
            ResponseRecipe::Rcwa {
                pixel,
                shifts: None,
            } => {
                let stack = pixel_stack(pixel, subpixels)?;
                let settings = at_wavelengths(TableSettings::rcwa_standard_for(&stack));
                self.kept("rcwa", pixel, &stack, &settings)?
            }
            ResponseRecipe::Table { file } => {
                AngularResponse::read_npz(Path::new(file)).map_err(|e| input(&e))?
            }
            ResponseRecipe::Geometric { .. } => unreachable!("handled above"),
        };
        let response = Arc::new(Response::Table(table));
        self.loaded.insert(key, response.clone());
        Ok(response)
    }
}

/// By which loaded responses are found again.
fn key(recipe: &Recipe, subpixels: Subpixels) -> Result<String, CommandError> {
    let nm = recipe.wavelengths()?.all_response_nm();
    Ok(format!("{:?} {subpixels} {nm:?}", recipe.response))
}

/// The pixel of a wave level's recipe and the settings of its table; `None` for other recipes.
///
/// # Errors
/// An unknown pixel, or one that cannot be.
pub(crate) fn wave_table(
    recipe: &Recipe,
    subpixels: Subpixels,
) -> Result<Option<(PixelStack, TableSettings)>, CommandError> {
    let ResponseRecipe::Wave {
        pixel,
        stack_scale,
        shifts: None,
        grid,
    } = &recipe.response
    else {
        return Ok(None);
    };
    let stack = scaled_stack(pixel, *stack_scale, subpixels)?;
    let settings = TableSettings {
        wavelengths_nm: recipe.wavelengths()?.all_response_nm(),
        ..grid.settings(&stack)
    };
    Ok(Some((stack, settings)))
}

/// A pixel whose flat layers are this much thicker.
fn scaled_stack(
    pixel: &str,
    stack_scale: f64,
    subpixels: Subpixels,
) -> Result<PixelStack, CommandError> {
    let mut stack = pixel_stack(pixel, subpixels)?;
    for layer in &mut stack.layers {
        layer.thickness_um *= stack_scale;
    }
    stack
        .check()
        .map_err(|e| CommandError::input(e.to_string()))?;
    Ok(stack)
}

impl Responses {
    /// The table, its warnings noted.
    fn taken(&mut self, made: CachedTable) -> AngularResponse {
        let warnings = made.warnings.iter().map(ToString::to_string);
        self.warnings.extend(warnings);
        made.table
    }

    /// Takes a response as that of a recipe.
    ///
    /// # Errors
    /// Bands out of their range.
    pub(crate) fn put(
        &mut self,
        recipe: &Recipe,
        subpixels: Subpixels,
        response: Response,
    ) -> Result<(), CommandError> {
        self.loaded
            .insert(key(recipe, subpixels)?, Arc::new(response));
        Ok(())
    }

    /// The kept table of a pixel by a model that takes up to hours, which a dataset does not begin unasked.
    fn kept(
        &mut self,
        model: &str,
        name: &str,
        stack: &PixelStack,
        settings: &TableSettings,
    ) -> Result<AngularResponse, CommandError> {
        let kept = self.cache.get(&settings.key(stack));
        let kept = kept.unwrap_or_else(|warning| {
            self.warnings.push(warning.to_string());
            None
        });
        kept.ok_or_else(|| {
            let nm: Vec<String> = (settings.wavelengths_nm.iter().map(f64::to_string)).collect();
            CommandError::input(format!(
                "response: no {model} table of pixel {name} ({}) at {} nm is shipped or kept; make one first, in up to hours: \
                 qpgen response --model {model} --pixel {name} --subpixels {} --wavelength-nm {}",
                stack.subpixels,
                nm.join(", "),
                stack.subpixels,
                nm.join(",")
            ))
        })
    }

    /// Adds to what [`Self::take_warnings`] tells.
    pub fn warn(&mut self, warning: String) {
        self.warnings.push(warning);
    }

    /// What went wrong with the cache, without harm, since this was last asked.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }
}

impl Default for Responses {
    fn default() -> Self {
        Self::new()
    }
}

/// The camera of a recipe.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn camera(
    recipe: &Recipe,
    response: &Response,
    subpixels: Subpixels,
) -> Result<Camera, CommandError> {
    let lens = lens(&recipe.lens)?;
    focused_camera(recipe, &lens, response, subpixels)
}

/// The camera of a recipe with its lens focused as given.
fn focused_camera(
    recipe: &Recipe,
    lens: &Lens,
    response: &Response,
    subpixels: Subpixels,
) -> Result<Camera, CommandError> {
    let wavelengths = recipe.wavelengths()?;
    let centre = match recipe.sensor.window {
        WindowRecipe::Centre => DVec2::ZERO,
        WindowRecipe::Position { x_mm, y_mm } => DVec2::new(x_mm, y_mm),
        WindowRecipe::ChiefRayAngle { theta_deg, phi_deg } => {
            let system = lens
                .at(wavelengths.reference_nm())
                .map_err(|e| CommandError::input(e.to_string()))?;
            centre_at(&system, theta_deg, phi_deg)?
        }
    };
    let size = (recipe.sensor.width, recipe.sensor.height);
    let sensor = Sensor::new(recipe.sensor.pitch_um, subpixels, size, centre)
        .map_err(|e| CommandError::input(e.to_string()))?;
    let offset_um = DVec2::from(recipe.sensor.microlens_offset_um);
    if !offset_um.is_finite() {
        return Err(CommandError::input(format!(
            "sensor.microlens_offset_um is {offset_um}; allowed: finite lengths"
        )));
    }
    let camera = Camera::new(
        lens,
        sensor,
        recipe.sensor.microlens_shift,
        response,
        wavelengths,
    );
    camera
        .map(|c| c.with_microlens_offset_um(offset_um))
        .map_err(|e| CommandError::input(e.to_string()))
}

/// The camera in front of which the recipe's cards are laid out, where that is not its own.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn framing_camera(
    recipe: &Recipe,
    response: &Response,
    subpixels: Subpixels,
) -> Result<Option<Camera>, CommandError> {
    let framing = |focus_mm| {
        let aligned = LensRecipe {
            focus_mm: Some(focus_mm),
            ..recipe.lens.clone()
        };
        focused_camera(recipe, &lens(&aligned)?, response, subpixels)
    };
    recipe.framing_focus_mm.map(framing).transpose()
}

/// The scene of a recipe, laid out in front of a camera: its own, or that of its framing.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn scene(recipe: &Recipe, camera: &Camera) -> Result<Scene, CommandError> {
    Ok(scene_and_warnings(recipe, camera)?.0)
}

/// The scene of a recipe, and what was left out of it.
///
/// # Errors
/// As [`scene`].
pub(crate) fn scene_and_warnings(
    recipe: &Recipe,
    camera: &Camera,
) -> Result<(Scene, Vec<String>), CommandError> {
    if let Some(world) = &recipe.world {
        return world_scene(recipe, world, camera);
    }
    if recipe.planes.is_empty() {
        return Err(CommandError::input(
            "planes is empty; allowed: at least one card",
        ));
    }
    let planes = recipe.planes.iter().enumerate();
    let planes =
        planes.map(|(i, p)| plane(p, camera).map_err(|e| e.within(&format!("planes[{i}]"))));
    let planes = planes.collect::<Result<_, _>>()?;
    Ok((Scene::new(planes, recipe.environment), Vec::new()))
}

fn world_scene(
    recipe: &Recipe,
    world: &WorldRecipe,
    camera: &Camera,
) -> Result<(Scene, Vec<String>), CommandError> {
    if !recipe.planes.is_empty() {
        return Err(CommandError::input(
            "planes: there is a world too; allowed: cards or a world",
        ));
    }
    let (description, mut warnings) = world.build(camera)?;
    let checked = World::new(description).map_err(|e| CommandError::input(e.to_string()))?;
    warnings.extend(checked.warnings().lines());
    let scene = Scene::of_world(Arc::new(checked), world.paths);
    Ok((scene, warnings))
}

fn plane(recipe: &PlaneRecipe, camera: &Camera) -> Result<TexturedPlane, CommandError> {
    let distance = recipe.distance_mm;
    if !(distance.is_finite() && distance > 0.0) {
        return Err(CommandError::input(format!(
            "distance_mm is {distance}; allowed: a positive length"
        )));
    }
    let input = |e: &dyn std::fmt::Display| CommandError::input(e.to_string());
    let texture = recipe
        .chart
        .generate(recipe.chart_seed, recipe.texture_px)
        .map_err(|e| input(&e))?;
    let coverage = recipe
        .cutout
        .as_ref()
        .map(|c| c.shape.generate(c.seed, recipe.texture_px))
        .transpose()
        .map_err(|e| input(&e))?;
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
    TexturedPlane::new(
        centre,
        size,
        tilts,
        Arc::new(texture),
        coverage.map(Arc::new),
    )
    .map_err(|e| input(&e))
}

/// Where the middle ray of stored-image place (column, row) meets depth `distance_mm`.
fn seen_at(
    camera: &Camera,
    column: f64,
    row: f64,
    distance_mm: f64,
) -> Result<DVec3, CommandError> {
    let place = camera.sensor().position_mm(column, row);
    crate::field_of_view::middle_ray(camera, place)
        .and_then(|ray| trace_backward(camera.system(1), ray).ok())
        .map(|ray| {
            ray.origin_mm + (-distance_mm - ray.origin_mm.z) / ray.direction.z * ray.direction
        })
        .ok_or_else(|| {
            CommandError::input(format!(
                "no light reaches the sensor at ({:.3}, {:.3}) mm",
                place.x, place.y
            ))
        })
}

/// A pixel by its built-in name or TOML file.
///
/// # Errors
/// An unknown name, or what is wrong with the file.
pub fn pixel(name: &str) -> Result<PixelStack, CommandError> {
    let stack = if name.ends_with(".toml") {
        let text = std::fs::read_to_string(name)
            .map_err(|e| CommandError::input(format!("{name}: {e}")))?;
        PixelStack::from_toml(&text, name)
    } else {
        PixelStack::builtin(name)
    };
    stack.map_err(|e| CommandError::input(e.to_string()))
}

/// A pixel by its built-in name or TOML file, with m×n photodiodes.
///
/// # Errors
/// An unknown name, or what is wrong with the file.
pub fn pixel_stack(name: &str, subpixels: Subpixels) -> Result<PixelStack, CommandError> {
    Ok(PixelStack {
        subpixels,
        ..pixel(name)?
    })
}

/// Sub-pixels from their name, such as `2x2`.
///
/// # Errors
/// Another text.
pub fn subpixels(name: &str) -> Result<Subpixels, CommandError> {
    let parts = name
        .split_once('x')
        .and_then(|(m, n)| Some((m.parse().ok()?, n.parse().ok()?)));
    let allowed = || {
        CommandError::input(format!(
            "subpixels is `{name}`; allowed: 1x1, 2x1, 1x2, 2x2, 3x3, 4x4 (columns x rows)"
        ))
    };
    let (m, n) = parts.ok_or_else(allowed)?;
    Subpixels::new(m, n).map_err(|_| allowed())
}
