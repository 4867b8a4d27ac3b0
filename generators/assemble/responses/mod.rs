//! Angular responses of recipes: computed, shipped, made before, or read from files.

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use quadpixel::em::PixelStack;
use quadpixel::hash::settings_hash;
use quadpixel::progress::Progress;
use quadpixel::response::{AngularResponse, GeometricResponse, Response, ResponseCache, TablePlan};
use quadpixel::sensor::Charge;
use quadpixel::spectrum::ChannelWavelengths;

use super::colour::ColourErrors;
use super::kept::Kept;
use super::{lens, pixel_stack};
use crate::recipe::table_choice::one_colour;
use crate::recipe::{Recipe, RecipeError, ResponseSource, TableRecipe};

/// Seconds of one core that a dataset spends on a table unasked.
const MOST_SECONDS: f64 = 900.0;

/// Angular responses that several samples share, loaded or computed once; and the last sample's camera.
pub struct Responses {
    pub(super) camera: Option<Kept>,
    pub(super) cache: ResponseCache,
    loaded: BTreeMap<String, Arc<Response>>,
    /// What leaving colour out of a pixel's response does, by pixel and F-number.
    pub(super) colours: BTreeMap<String, Option<ColourErrors>>,
    warnings: Vec<String>,
}

impl Responses {
    /// Uses the user's cache folder.
    pub fn new() -> Self {
        Self {
            cache: ResponseCache::open(ResponseCache::default_dir()),
            camera: None,
            loaded: BTreeMap::new(),
            colours: BTreeMap::new(),
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
        progress: &dyn Progress,
    ) -> Result<Arc<Response>, RecipeError> {
        if let ResponseSource::Ideal { focal_length_um } = recipe.response {
            let f_number = match recipe.lens.f_number {
                Some(f) => f,
                None => {
                    lens(&recipe.lens)?
                        .paraxial(ChannelWavelengths::default().reference_nm())?
                        .f_number
                }
            };
            let focal = focal_length_um.unwrap_or(recipe.sensor.pitch_um * f_number);
            let geometric =
                GeometricResponse::new(recipe.sensor.subpixels, recipe.sensor.pitch_um, focal)?;
            return Ok(Arc::new(Response::Geometric(geometric)));
        }
        let key = key(recipe)?;
        if let Some(response) = self.loaded.get(&key) {
            return Ok(response.clone());
        }
        let table = match &recipe.response {
            ResponseSource::File { file } => AngularResponse::read_npz(Path::new(file))?,
            ResponseSource::Simulated(table) => match quick_plan(recipe)? {
                Some(plan) => {
                    check_quick(recipe, table, &plan, &self.cache)?;
                    let reference_nm = ChannelWavelengths::default().reference_nm();
                    let plan = match table.choice.shifts {
                        None => plan.each_wavelength(reference_nm),
                        Some(_) => plan,
                    };
                    let made = self.cache.table(&plan, progress)?;
                    let warnings = made.warnings.iter().map(ToString::to_string);
                    self.warnings.extend(warnings);
                    made.table
                }
                None => self.of_colours(recipe, table, progress)?,
            },
            ResponseSource::Ideal { .. } => unreachable!("handled above"),
        };
        let charge = (recipe.response.table()).map_or(Charge::default(), |table| table.charge);
        let table = match charge.is_none() {
            true => table,
            false => table.with_charge(charge)?,
        };
        let response = Arc::new(Response::Table(table));
        self.loaded.insert(key, response.clone());
        Ok(response)
    }
}

/// By which loaded responses are found again.
fn key(recipe: &Recipe) -> Result<String, RecipeError> {
    let nm = recipe.wavelengths()?.all_response_nm();
    let settings = (&recipe.response, recipe.sensor.subpixels, nm);
    settings_hash(&settings).map_err(RecipeError::unwritten("response"))
}

/// The plan of a table that a dataset makes unasked, as its model is quick; `None` for other responses.
///
/// # Errors
/// An unknown pixel, or one that cannot be.
pub(crate) fn quick_plan(recipe: &Recipe) -> Result<Option<TablePlan>, RecipeError> {
    let Some(table) = recipe.response.table() else {
        return Ok(None);
    };
    let stack = stack(recipe, table)?;
    if table.level.quick_run_s(&stack).is_none() || table.choice.colour.is_some() {
        return Ok(None);
    }
    let settings = table.settings(&stack, &recipe.wavelengths()?.all_response_nm());
    Ok(Some(TablePlan::new(&stack, &settings)?))
}

/// Whether a quick table has still to be made as a whole: one of all lens shifts that is not kept.
///
/// # Errors
/// It takes long: with the command that makes it.
pub(crate) fn check_quick(
    recipe: &Recipe,
    table: &TableRecipe,
    plan: &TablePlan,
    cache: &ResponseCache,
) -> Result<bool, RecipeError> {
    let Some(shifts) = table.choice.shifts else {
        return Ok(false);
    };
    if matches!(cache.find(plan), Ok(Some(_))) {
        return Ok(false);
    }
    let run_s = table.level.quick_run_s(plan.stack()).unwrap_or(0.0);
    let seconds = run_s * plan.count()? as f64;
    if seconds <= MOST_SECONDS {
        return Ok(true);
    }
    let (pixel, subpixels) = (&table.pixel, recipe.sensor.subpixels);
    Err(RecipeError::NoTable {
        table: format!(
            "{} table of all lens shifts of pixel {pixel} ({subpixels}), {shifts} per pitch, is kept",
            table.level
        ),
        time: format!(
            "make it first, in about {:.0} minutes of one core",
            seconds / 60.0
        ),
        command: table.command(plan.stack(), &plan.settings().wavelengths_nm),
    })
}

/// The table's pixel: its flat layers are as much thicker as the recipe says.
pub(super) fn stack(recipe: &Recipe, table: &TableRecipe) -> Result<PixelStack, RecipeError> {
    let mut stack = pixel_stack(&table.pixel, recipe.sensor.subpixels)?;
    for layer in &mut stack.layers {
        layer.thickness_um *= table.stack_scale;
    }
    stack.check()?;
    Ok(stack)
}

impl Responses {
    /// Takes a response as that of a recipe.
    ///
    /// # Errors
    /// Bands out of their range.
    pub(crate) fn put(&mut self, recipe: &Recipe, response: Response) -> Result<(), RecipeError> {
        self.loaded.insert(key(recipe)?, Arc::new(response));
        Ok(())
    }

    /// The table of a model that takes up to hours, which a dataset does not begin unasked: shipped or made before; or
    /// of colours under a mosaic, which a quick model makes.
    fn of_colours(
        &mut self,
        recipe: &Recipe,
        table: &TableRecipe,
        progress: &dyn Progress,
    ) -> Result<AngularResponse, RecipeError> {
        let stack = stack(recipe, table)?;
        // Shipped tables are of one wavelength.
        if table.choice.is_usual() && recipe.spectrum.is_none() {
            let shipped = AngularResponse::shipped(table.level, &stack);
            if let Some(table) = shipped.map_err(RecipeError::Shipped)? {
                return Ok(table);
            }
        }
        let channels = recipe.wavelengths()?;
        let nm = channels.all_response_nm();
        let missing = || {
            let nm_text: Vec<String> = nm.iter().map(f64::to_string).collect();
            RecipeError::NoTable {
                table: format!(
                    "{} table of pixel {} ({}) at {} nm is shipped or kept",
                    table.level,
                    table.pixel,
                    stack.subpixels,
                    nm_text.join(", ")
                ),
                time: "make one first, in up to hours".to_owned(),
                command: table.command(&stack, &nm),
            }
        };
        let plan = TablePlan::new(&stack, &table.settings(&stack, &nm))?;
        let Some(colour) = table.choice.colour else {
            return self.kept(&plan).ok_or_else(missing);
        };
        let plan = plan.of_mosaic()?;
        let count = plan.count()? as f64;
        let tables = match table.level.quick_run_s(&stack) {
            Some(run_s) if run_s * count <= MOST_SECONDS => {
                let made = self.cache.tables(&plan, progress)?;
                let warnings = made.warnings.iter().map(ToString::to_string);
                self.warnings.extend(warnings);
                Some(made.tables.into_iter().map(|(table, _)| table).collect())
            }
            _ => {
                let colours = plan.colours().into_iter();
                let kept = colours.map(|colour| self.kept(&plan.with_colour(colour)));
                kept.collect::<Option<Vec<AngularResponse>>>()
            }
        };
        let tables: Vec<AngularResponse> = tables.ok_or_else(missing)?;
        let Some(colour) = one_colour(colour) else {
            return match tables.as_slice() {
                [red, green, blue] => Ok(AngularResponse::from_channels(
                    [red, green, blue],
                    &channels,
                )?),
                _ => Err(missing()),
            };
        };
        let mut by_colour = plan.colours().into_iter().zip(tables);
        let wanted = by_colour.find(|(of, _)| *of == colour);
        wanted.map(|(_, table)| table).ok_or_else(missing)
    }

    /// The kept table of a plan; a file that is something else is a warning.
    fn kept(&mut self, plan: &TablePlan) -> Option<AngularResponse> {
        self.cache.find(plan).unwrap_or_else(|warning| {
            self.warnings.push(warning.to_string());
            None
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
