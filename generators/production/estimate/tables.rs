//! The time that response tables which are not kept yet will take, by coarse ones.

use std::time::Instant;

use quadpixel::em::PixelStack;
use quadpixel::response::{
    AngularResponse, Response, ResponseCache, ResponseError, TablePlan, TableSettings, build_table,
};
use quadpixel::sensor::Subpixels;

use crate::assemble::{self, Responses};
use crate::config::DatasetConfig;
use crate::production::error::GenerateError;
use crate::production::recipes::Recipes;
use crate::recipe::{RecipeError, ResponseSource};

/// Directions of a response table from the axis that are timed.
const STEPS: usize = 4;

/// Seconds that the response tables which are not kept yet will take. Until they are made, coarse ones of the same
/// pixels stand in for them in `responses`.
pub(super) fn seconds_of_missing(
    config: &DatasetConfig,
    recipes: &Recipes,
    responses: &mut Responses,
) -> Result<f64, GenerateError> {
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let mut looked_at: Vec<ResponseSource> = Vec::new();
    let mut seconds = 0.0;
    for &index in &recipes.indices {
        let recipe = assemble::with_colour(&recipes.draw(config, index)?, responses)?.0;
        if looked_at.contains(&recipe.response) {
            continue;
        }
        let mut timed = None;
        if let (Some(plan), Some(table)) = (assemble::quick_plan(&recipe)?, recipe.response.table())
        {
            let absent = missing(&cache, plan.stack(), plan.settings())?;
            if plan.is_shipped().map_err(RecipeError::from)? {
                // Nothing is left to simulate.
            } else if assemble::check_quick(&recipe, table, &plan, &cache)? {
                timed = Some(shifted_table(&plan)?);
            } else if plan.settings().shifts.is_none() && absent > 0 {
                timed = Some(one_table(plan.stack(), plan.settings(), absent)?);
            }
        }
        if let Some((more, coarse)) = timed {
            seconds += more;
            responses.put(&recipe, Response::Table(coarse))?;
        }
        looked_at.push(recipe.response);
    }
    Ok(seconds)
}

/// Wavelengths of a table that are neither kept, each in a file of its own, nor come with the program.
fn missing(
    cache: &ResponseCache,
    stack: &PixelStack,
    settings: &TableSettings,
) -> Result<usize, RecipeError> {
    let mut count = 0;
    for nm in &settings.wavelengths_nm {
        let one = TableSettings {
            wavelengths_nm: vec![*nm],
            ..settings.clone()
        };
        let is_kept = matches!(cache.get(&one.key(stack)?), Ok(Some(_)));
        count += usize::from(!is_kept && !TablePlan::new(stack, &one)?.is_shipped()?);
    }
    Ok(count)
}

/// The settings with few directions and one wavelength.
fn coarse(settings: &TableSettings) -> TableSettings {
    TableSettings {
        steps: STEPS.min(settings.steps),
        wavelengths_nm: settings.wavelengths_nm[..1].to_vec(),
        ..settings.clone()
    }
}

/// Seconds that a table of so many wavelengths will take, by a coarse one of one wavelength, which comes with them.
fn one_table(
    stack: &PixelStack,
    settings: &TableSettings,
    wavelengths: usize,
) -> Result<(f64, AngularResponse), GenerateError> {
    let coarse = coarse(settings);
    let began = Instant::now();
    let built = build_table(stack, &coarse, None, &|_, _| ()).map_err(RecipeError::from)?;
    let more =
        directions(settings.steps, stack.subpixels) / directions(coarse.steps, stack.subpixels);
    let seconds = began.elapsed().as_secs_f64() * more * wavelengths as f64;
    Ok((seconds, built.table))
}

/// As [`one_table`], of a table of all lens shifts: it is one file with all its wavelengths.
fn shifted_table(plan: &TablePlan) -> Result<(f64, AngularResponse), GenerateError> {
    let input = |e: ResponseError| RecipeError::from(e);
    let coarse = TablePlan::new(plan.stack(), &coarse(plan.settings())).map_err(input)?;
    let began = Instant::now();
    let built = coarse.build(None, &|_, _| ()).map_err(input)?;
    let more = plan.count().map_err(input)? as f64 / coarse.count().map_err(input)? as f64;
    Ok((began.elapsed().as_secs_f64() * more, built.table))
}

/// Directions that are simulated: of an octant for a pixel that is the same from both sides, else of a quadrant.
fn directions(steps: usize, subpixels: Subpixels) -> f64 {
    let steps = steps as f64;
    if subpixels.m() == subpixels.n() {
        (steps + 1.0) * (steps + 2.0) / 2.0
    } else {
        (steps + 1.0).powi(2)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::em::{Level, ModelChoice, Preset};

    #[test]
    fn tables_that_come_with_the_program_are_not_missing() {
        let folder = tempfile::tempdir().unwrap();
        let cache = ResponseCache::open(folder.path().to_owned());
        let mut stack = assemble::pixel_stack("2.8um", "2x2".parse().unwrap()).unwrap();
        let choice = ModelChoice::new(Level::Wave, Preset::Standard);
        let settings = |stack: &PixelStack| TableSettings {
            wavelengths_nm: vec![550.0],
            ..TableSettings::for_choice(&choice, stack)
        };
        assert_eq!(missing(&cache, &stack, &settings(&stack)).unwrap(), 0);
        stack.layers[0].thickness_um *= 1.1;
        assert_eq!(missing(&cache, &stack, &settings(&stack)).unwrap(), 1);
    }
}
