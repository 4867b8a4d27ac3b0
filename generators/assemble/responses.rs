//! Angular responses of recipes: computed, shipped, made before, or read from files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use quadpixel::em::{Level, PixelStack};
use quadpixel::progress::Progress;
use quadpixel::response::{
    AngularResponse, CachedTable, GeometricResponse, Response, ResponseCache, TablePlan,
    TableSettings,
};
use quadpixel::sensor::Subpixels;
use quadpixel::spectrum::ChannelWavelengths;

use super::{lens, pixel_stack};
use crate::assemble::shifted_table::ShiftedTable;
use crate::recipe::made_table::{MadeTable, one_colour};
use crate::recipe::{Recipe, RecipeError, ResponseRecipe};

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
        progress: &dyn Progress,
    ) -> Result<Arc<Response>, RecipeError> {
        if let ResponseRecipe::Geometric { focal_length_um } = recipe.response {
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
        let wavelengths_nm = recipe.wavelengths()?.all_response_nm();
        let key = key(recipe)?;
        if let Some(response) = self.loaded.get(&key) {
            return Ok(response.clone());
        }
        let table = match &recipe.response {
            ResponseRecipe::Wave {
                pixel,
                stack_scale,
                shifts: Some(shifts),
                preset,
            } => {
                let stack = scaled_stack(pixel, *stack_scale, recipe.sensor.subpixels)?;
                let way = (*shifts, *preset);
                let asked = ShiftedTable::wave(pixel, *stack_scale, &stack, way);
                let made = asked.at(&wavelengths_nm).made(&self.cache, progress)?;
                self.taken(made)
            }
            ResponseRecipe::Wave { .. } => {
                let Some((stack, settings)) = wave_table(recipe)? else {
                    unreachable!("a wave table's recipe");
                };
                let plan = TablePlan::new(&stack, &settings)?;
                let reference_nm = ChannelWavelengths::default().reference_nm();
                let made = self
                    .cache
                    .table(&plan.each_wavelength(reference_nm), progress);
                self.taken(made?)
            }
            ResponseRecipe::Fdtd(made) => self.made_before(recipe, Level::Fdtd, made)?,
            ResponseRecipe::Rcwa(made) => self.made_before(recipe, Level::Rcwa, made)?,
            ResponseRecipe::Corrected(made) => self.made_before(recipe, Level::Corrected, made)?,
            ResponseRecipe::Table { file } => AngularResponse::read_npz(Path::new(file))?,
            ResponseRecipe::Geometric { .. } => unreachable!("handled above"),
        };
        let response = Arc::new(Response::Table(table));
        self.loaded.insert(key, response.clone());
        Ok(response)
    }
}

/// By which loaded responses are found again.
fn key(recipe: &Recipe) -> Result<String, RecipeError> {
    let nm = recipe.wavelengths()?.all_response_nm();
    Ok(format!(
        "{:?} {} {nm:?}",
        recipe.response, recipe.sensor.subpixels
    ))
}

/// The pixel of a wave level's recipe and the settings of its table; `None` for other recipes.
///
/// # Errors
/// An unknown pixel, or one that cannot be.
pub(crate) fn wave_table(
    recipe: &Recipe,
) -> Result<Option<(PixelStack, TableSettings)>, RecipeError> {
    let ResponseRecipe::Wave {
        pixel,
        stack_scale,
        shifts: None,
        preset,
    } = &recipe.response
    else {
        return Ok(None);
    };
    let stack = scaled_stack(pixel, *stack_scale, recipe.sensor.subpixels)?;
    let settings = TableSettings {
        wavelengths_nm: recipe.wavelengths()?.all_response_nm(),
        ..TableSettings::new(Level::Wave, *preset, &stack)
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
    cache: &ResponseCache,
) -> Result<Option<TablePlan>, RecipeError> {
    let ResponseRecipe::Wave {
        pixel,
        stack_scale,
        shifts: Some(shifts),
        preset,
    } = &recipe.response
    else {
        return Ok(None);
    };
    let stack = scaled_stack(pixel, *stack_scale, recipe.sensor.subpixels)?;
    let asked = ShiftedTable::wave(pixel, *stack_scale, &stack, (*shifts, *preset));
    let asked = asked.at(&recipe.wavelengths()?.all_response_nm());
    asked.to_make(cache)
}

/// A pixel whose flat layers are this much thicker.
fn scaled_stack(
    pixel: &str,
    stack_scale: f64,
    subpixels: Subpixels,
) -> Result<PixelStack, RecipeError> {
    let mut stack = pixel_stack(pixel, subpixels)?;
    for layer in &mut stack.layers {
        layer.thickness_um *= stack_scale;
    }
    stack.check()?;
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
    pub(crate) fn put(&mut self, recipe: &Recipe, response: Response) -> Result<(), RecipeError> {
        self.loaded.insert(key(recipe)?, Arc::new(response));
        Ok(())
    }

    /// The table of a model that takes up to hours, which a dataset does not begin unasked: shipped or made before.
    fn made_before(
        &mut self,
        recipe: &Recipe,
        level: Level,
        made: &MadeTable,
    ) -> Result<AngularResponse, RecipeError> {
        let stack = pixel_stack(&made.pixel, recipe.sensor.subpixels)?;
        // It is of one wavelength.
        if level == Level::Fdtd && made.is_usual() && recipe.spectrum.is_none() {
            let shipped = AngularResponse::shipped_fdtd(&stack);
            if let Some(table) = shipped.map_err(RecipeError::Shipped)? {
                return Ok(table);
            }
        }
        let channels = recipe.wavelengths()?;
        let nm = channels.all_response_nm();
        let settings = made.settings(level, &stack, &nm);
        let missing = |stack: &PixelStack| {
            let nm_text: Vec<String> = nm.iter().map(f64::to_string).collect();
            RecipeError::NoTable {
                table: format!(
                    "{level} table of pixel {} ({}) at {} nm is shipped or kept",
                    made.pixel,
                    stack.subpixels,
                    nm_text.join(", ")
                ),
                time: "make one first, in up to hours".to_owned(),
                command: made.command(level, stack, &nm),
            }
        };
        let plan = TablePlan::new(&stack, &settings)?;
        let Some(colour) = made.colour else {
            return self.found(&plan).ok_or_else(|| missing(&stack));
        };
        let plan = plan.of_mosaic()?;
        if let Some(colour) = one_colour(colour) {
            let found = self.found(&plan.with_colour(colour));
            return found.ok_or_else(|| missing(&stack));
        }
        let mut colours = Vec::new();
        for colour in plan.colours() {
            let found = self.found(&plan.with_colour(colour));
            colours.push(found.ok_or_else(|| missing(&stack))?);
        }
        let [red, green, blue] = &colours[..] else {
            return Err(missing(&stack));
        };
        Ok(AngularResponse::from_channels(
            [red, green, blue],
            &channels,
        )?)
    }

    /// The kept table of a plan; a file that is something else is a warning.
    fn found(&mut self, plan: &TablePlan) -> Option<AngularResponse> {
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::config::{DEFAULT_TOML, DatasetConfig};
    use crate::draw;

    fn recipe(response: &str) -> Recipe {
        let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
        config.response = toml::from_str(response).unwrap();
        draw::recipe(&config, 0, &|_| Ok(1.6)).unwrap()
    }

    fn responses(folder: &Path) -> Responses {
        Responses {
            cache: ResponseCache::open(folder),
            ..Responses::new()
        }
    }

    #[test]
    fn a_table_that_takes_long_is_asked_for_by_the_command_that_makes_it() {
        let folder = tempfile::tempdir().unwrap();
        let stack = PixelStack::builtin("3.5um").unwrap();
        let text = "model = \"rcwa\"\npixels = [\"3.5um\"]\nshifts = 8";
        let mut responses = responses(folder.path());
        let asked = recipe(text);
        let why = responses.get(&asked, &|_, _| ());
        let why = why.unwrap_err().to_string();
        assert!(
            why.contains("qpgen response --model rcwa --pixel 3.5um --subpixels 2x2 --shifts 8"),
            "{why}"
        );
        // A file that is no table is told of.
        let Some((level, made)) = asked.response.made_before() else {
            panic!("a table made before")
        };
        let nm = asked.wavelengths().unwrap().all_response_nm();
        let key = made.settings(level, &stack, &nm).key(&stack).unwrap();
        std::fs::write(responses.cache.path(&key), b"no table").unwrap();
        assert!(responses.get(&asked, &|_, _| ()).is_err());
        assert_eq!(responses.take_warnings().len(), 1);
    }

    /// `qpgen response --model rcwa --preset draft --shifts 4` makes the table that `preset = "draft"` and `shifts = 4`
    /// find.
    #[test]
    fn a_dataset_finds_the_table_that_the_same_words_made() {
        let stack = PixelStack::builtin("1.6um").unwrap();
        let words = ["", "preset = \"draft\"", "preset = \"draft\"\nshifts = 4"];
        let models = ["rcwa", "fdtd", "corrected"];
        let mut keys = Vec::new();
        for model in models {
            for words in words {
                let text = format!("model = \"{model}\"\npixels = [\"1.6um\"]\n{words}");
                let recipe = recipe(&text);
                let Some((level, made)) = recipe.response.made_before() else {
                    panic!("a table made before")
                };
                let preset = match words.is_empty() {
                    true => quadpixel::em::Preset::Standard,
                    false => quadpixel::em::Preset::Draft,
                };
                // What the command line makes of the same words.
                let choice = quadpixel::em::ModelChoice::new(level, preset);
                let commanded = match made.shifts {
                    Some(n) => TableSettings::for_all_shifts(&choice, &stack, n),
                    None => TableSettings::for_choice(&choice, &stack),
                };
                let key = made.settings(level, &stack, &[550.0]).key(&stack).unwrap();
                assert_eq!(key, commanded.key(&stack).unwrap());
                keys.push(key);
            }
        }
        keys.sort();
        keys.dedup();
        // The corrected level's directions are those of its preset's wave model.
        assert_eq!(keys.len(), models.len() * words.len());
    }
}
