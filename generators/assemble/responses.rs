//! Angular responses of recipes: computed, shipped, made before, or read from files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use quadpixel::command::CommandError;
use quadpixel::em::{Level, PixelStack, Preset};
use quadpixel::response::{
    AngularResponse, CachedTable, GeometricResponse, Response, ResponseCache, TablePlan,
    TableSettings,
};
use quadpixel::sensor::Subpixels;
use quadpixel::spectrum::ChannelWavelengths;

use super::{lens, pixel_stack};
use crate::recipe::{Recipe, ResponseRecipe};
use crate::shifted_table::ShiftedTable;

/// Angular responses that several samples share, loaded or computed once.
pub struct Responses {
    cache: ResponseCache,
    loaded: BTreeMap<String, Arc<Response>>,
    warnings: Vec<String>,
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
        if let ResponseRecipe::Geometric { focal_length_um } = recipe.response {
            let f_number = match recipe.lens.f_number {
                Some(f) => f,
                None => {
                    lens(&recipe.lens)?
                        .paraxial(ChannelWavelengths::default().reference_nm())
                        .map_err(CommandError::input)?
                        .f_number
                }
            };
            let focal = focal_length_um.unwrap_or(recipe.sensor.pitch_um * f_number);
            let geometric = GeometricResponse::new(subpixels, recipe.sensor.pitch_um, focal)
                .map_err(CommandError::input)?;
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
                let plan = TablePlan::new(&stack, &settings).map_err(CommandError::input)?;
                let reference_nm = ChannelWavelengths::default().reference_nm();
                let made = self
                    .cache
                    .table(&plan.each_wavelength(reference_nm), progress);
                self.taken(made.map_err(CommandError::input)?)
            }
            ResponseRecipe::Fdtd { pixel } => {
                let stack = pixel_stack(pixel, subpixels)?;
                let shipped = AngularResponse::shipped_fdtd(&stack);
                match shipped.map_err(CommandError::failed)? {
                    // It is of one wavelength.
                    Some(table) if recipe.spectrum.is_none() => table,
                    _ => {
                        let settings = at_wavelengths(TableSettings::new(
                            Level::Fdtd,
                            Preset::Standard,
                            &stack,
                        ));
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
                let settings =
                    at_wavelengths(TableSettings::new(Level::Rcwa, Preset::Standard, &stack));
                self.kept("rcwa", pixel, &stack, &settings)?
            }
            ResponseRecipe::Table { file } => {
                AngularResponse::read_npz(Path::new(file)).map_err(CommandError::input)?
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

/// The plan of the table of all lens shifts that a wave level's recipe takes and that is not kept; `None` for
/// other recipes.
///
/// # Errors
/// An unknown pixel, or a table that takes long.
pub(crate) fn shifted_to_make(
    recipe: &Recipe,
    subpixels: Subpixels,
    cache: &ResponseCache,
) -> Result<Option<TablePlan>, CommandError> {
    let ResponseRecipe::Wave {
        pixel,
        stack_scale,
        shifts: Some(shifts),
        ..
    } = &recipe.response
    else {
        return Ok(None);
    };
    let stack = scaled_stack(pixel, *stack_scale, subpixels)?;
    let asked = ShiftedTable::wave(pixel, *stack_scale, &stack, *shifts);
    let asked = asked.at(&recipe.wavelengths()?.all_response_nm());
    asked.to_make(cache)
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
    stack.check().map_err(CommandError::input)?;
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
        let plan = TablePlan::new(stack, settings).map_err(CommandError::input)?;
        let kept = self.cache.find(&plan).unwrap_or_else(|warning| {
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
