//! Whether a pixel calls for colour: a response per wavelength, and the width of the channels' bands.
//!
//! ```text
//! pixel, F-number ─ a few plane waves of the cone at 9 wavelengths ─▶ ColourErrors ─ choice, tolerance, time of the
//!                                                         tables ─▶ bands in the recipe, or why not (ColourCall)
//! ```
//! Under `auto` a pixel whose tables come with the program has them without being asked.
//! P_i(λ, k) is what sub-pixel i absorbs from direction k. That all channels have the response at 550 nm leaves out
//! P(λ_c) − P(550 nm); that each has one wavelength leaves out ½ [P(λ_c − σ) + P(λ_c + σ)] − P(λ_c), the mean over the
//! band by two points, σ its standard deviation. Both are taken as RMS over channels, directions of the cone and
//! sub-pixels, over the mean: as if each direction showed a scene of its own, which bounds what defocus can part.

use quadpixel::effects::{Choice, Effect};
use quadpixel::em::wave::{MODEL, WaveSettings};
use quadpixel::em::{PixelModel, PixelStack};
use quadpixel::hash::settings_hash;
use quadpixel::journal::Journal;
use quadpixel::response::TablePlan;
use quadpixel::sensor::Subpixels;
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use quadpixel_datasets::{EstimatedError, Reason};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::pixel_stack;
use super::responses::{Responses, stack};
use crate::config::TableConfig;
use crate::recipe::{Recipe, RecipeError, TableRecipe};

/// Seconds of one core that the tables of the bands of one pixel may take unasked.
const MOST_SECONDS: f64 = 300.0;
/// Directions of the cone, by rings of equal area and azimuths of an octant: each stands for a sixth of the light.
const RINGS: usize = 3;
const AZIMUTHS_DEG: [f64; 2] = [11.25, 33.75];

/// What leaving colour out of a pixel's response does, RMS of the signal, %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ColourErrors {
    /// One response for all channels in the place of one per channel.
    pub response_percent: f64,
    /// One wavelength per channel in the place of its band.
    pub width_percent: f64,
}

/// Why a recipe's channels share one response, where they do, and what that does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColourCall {
    /// `None`: not estimated.
    pub errors: Option<ColourErrors>,
    pub reason: Reason,
}

impl ColourCall {
    /// As descriptions of samples have it.
    pub fn response_errors(&self) -> Vec<EstimatedError> {
        let percent = self.errors.map(|e| e.response_percent);
        percent
            .map(EstimatedError::SignalPercent)
            .into_iter()
            .collect()
    }
}

/// The recipe, with bands where its pixel calls for them.
///
/// # Errors
/// An unknown pixel or lens.
pub(crate) fn with_colour(
    recipe: &Recipe,
    responses: &mut Responses,
) -> Result<(Recipe, ColourCall), RecipeError> {
    let plain = |errors, reason| Ok((recipe.clone(), ColourCall { errors, reason }));
    let (Some(table), None) = (recipe.response.table(), recipe.spectrum) else {
        return plain(None, Reason::OneResponseWavelength);
    };
    let stack = stack(recipe, table)?;
    let wanted = [Effect::ResponseSpectrum, Effect::Wavelengths]
        .map(|effect| recipe.effects.asks_for(effect) == Some(true));
    let asked = wanted.contains(&true);
    let bands = Bands::default();
    let nm = ChannelWavelengths::from_bands(bands)?.all_response_nm();
    let reason = Reason::OneTabulatedWavelength;
    let resolved = Recipe {
        spectrum: Some(bands),
        ..recipe.clone()
    };
    if recipe.effects.is_auto() && costs_nothing(recipe, table, &stack, &nm)? {
        let errors = None;
        return Ok((resolved, ColourCall { errors, reason }));
    }
    let errors = match recipe.effects {
        Choice::All => None,
        _ => responses.colour_errors(recipe, &stack)?,
    };
    if !(asked || recipe.effects.is_auto()) {
        return plain(errors, Reason::NotChosen);
    }
    let tolerance = recipe.tolerance.signal_percent;
    let below = |e: ColourErrors| e.response_percent.max(e.width_percent) < tolerance;
    if !asked && errors.is_some_and(below) {
        let reason = Reason::BelowTolerance {
            signal_percent: tolerance,
            shift_px: recipe.tolerance.shift_px,
        };
        return plain(errors, reason);
    }
    let run_s = table.level.quick_run_s(&stack);
    let (Some(run_s), None, None) = (run_s, table.choice.colour, &recipe.rgbd) else {
        return plain(errors, Reason::OneResponseWavelength);
    };
    let plan = TablePlan::new(&stack, &table.settings(&stack, &nm[..1]))?;
    let seconds = (run_s * (plan.count()? * nm.len()) as f64).ceil();
    // What is asked for by its name is made, or told how to be.
    if seconds > MOST_SECONDS && !matches!(recipe.effects, Choice::Only(_)) {
        let most_seconds = MOST_SECONDS;
        return plain(
            errors,
            Reason::TableTime {
                seconds,
                most_seconds,
            },
        );
    }
    Ok((resolved, ColourCall { errors, reason }))
}

/// Whether the answers to the plane waves of the bands' tables come with the program: whether they are called for need
/// not be asked then.
fn costs_nothing(
    recipe: &Recipe,
    table: &TableRecipe,
    stack: &PixelStack,
    nm: &[f64],
) -> Result<bool, RecipeError> {
    match table.choice.colour.is_some() || recipe.rgbd.is_some() {
        true => Ok(false),
        false => ships(table, stack, nm),
    }
}

/// Whether the answers to the plane waves of these tables come with the program.
fn ships(table: &TableRecipe, stack: &PixelStack, nm: &[f64]) -> Result<bool, RecipeError> {
    for nm in nm {
        let settings = table.settings(stack, std::slice::from_ref(nm));
        if !TablePlan::new(stack, &settings)?.is_shipped()? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether the answers to all plane waves of a configuration's tables come with the program, at its bands or at the
/// usual ones.
///
/// # Errors
/// An unknown pixel.
pub(crate) fn all_ship(
    config: &TableConfig,
    subpixels: Subpixels,
    bands: Option<Bands>,
) -> Result<bool, RecipeError> {
    if config.stack.is_some() || config.choice.colour.is_some() {
        return Ok(false);
    }
    let nm = ChannelWavelengths::from_bands(bands.unwrap_or_default())?.all_response_nm();
    for pixel in &config.pixels {
        let table = TableRecipe {
            level: config.level,
            pixel: pixel.clone(),
            stack_scale: 1.0,
            choice: config.choice,
            charge: config.charge,
        };
        if !ships(&table, &pixel_stack(pixel, subpixels)?, &nm)? {
            return Ok(false);
        }
    }
    Ok(true)
}

impl Responses {
    /// What leaving colour out does to a pixel behind the recipe's lens; `None` of a pixel that the wave model has no
    /// answer for. Found once per pixel and F-number, and kept in the user's cache.
    ///
    /// # Errors
    /// A lens that cannot be built.
    fn colour_errors(
        &mut self,
        recipe: &Recipe,
        stack: &PixelStack,
    ) -> Result<Option<ColourErrors>, RecipeError> {
        let middle_nm = ChannelWavelengths::default().reference_nm();
        let f_number = super::lens(&recipe.lens)?.paraxial(middle_nm)?.f_number;
        // A tenth of a stop says enough of the cone.
        let f_number = (10.0 * f_number.max(0.5).log2()).round();
        let key = settings_hash(&(stack, f_number)).map_err(RecipeError::unwritten("response"))?;
        if let Some(known) = self.colours.get(&key) {
            return Ok(*known);
        }
        let cone = (RINGS, AZIMUTHS_DEG);
        let settings = (MODEL, WaveSettings::standard(), Bands::default(), cone);
        let made_by = settings_hash(&settings).map_err(RecipeError::unwritten("response"))?;
        let path = self.cache.path("colour-errors").with_extension("jsonl");
        // Open only for a moment: another process may find the same meanwhile, but none waits for it. A cache that
        // cannot be written costs the time of finding them again.
        let journal = || Journal::<String, Option<ColourErrors>>::open(&path, &made_by, &()).ok();
        let kept = journal().and_then(|journal| journal.outcome(&key).copied());
        let found = kept.unwrap_or_else(|| {
            let found = errors(stack, (f_number / 10.0).exp2());
            if let Some(journal) = journal() {
                journal.keep(key.clone(), &found);
            }
            found
        });
        self.colours.insert(key, found);
        Ok(found)
    }
}

/// See [`ColourErrors`]; `None` where the wave model has no answer.
fn errors(stack: &PixelStack, f_number: f64) -> Option<ColourErrors> {
    let bands = Bands::default();
    let reference_nm = ChannelWavelengths::default().reference_nm();
    let nm: Vec<f64> = (0..3)
        .flat_map(|c| {
            let (middle, off) = (bands.middle_nm[c], Bands::DEVIATION * bands.width_nm[c]);
            [middle, middle - off, middle + off]
        })
        .chain([reference_nm])
        .collect();
    let shares = nm.par_iter().map(|&nm| shares(stack, f_number, nm));
    let shares: Option<Vec<Vec<f64>>> = shares.collect();
    let shares = shares?;
    let reference = &shares[9];
    let (mut response, mut width, mut light) = (0.0, 0.0, 0.0);
    for [middle, low, high] in shares[..9].as_chunks::<3>().0 {
        for k in 0..reference.len() {
            response += (middle[k] - reference[k]).powi(2);
            width += (0.5 * (low[k] + high[k]) - middle[k]).powi(2);
            light += reference[k];
        }
    }
    let count = (3 * reference.len()) as f64;
    let percent = |squares: f64| 100.0 * (squares / count).sqrt() / (light / count);
    Some(ColourErrors {
        response_percent: percent(response),
        width_percent: percent(width),
    })
}

/// What each sub-pixel absorbs from each direction of the cone.
fn shares(stack: &PixelStack, f_number: f64, nm: f64) -> Option<Vec<f64>> {
    let centred = stack.with_lens_shift([0.0; 2]);
    let model = PixelModel::Wave(WaveSettings::standard());
    let solver = model.solver(&centred, nm).ok()?;
    let mut all = Vec::new();
    for ring in 0..RINGS {
        let sine = ((ring as f64 + 0.5) / RINGS as f64).sqrt() * 0.5 / f_number;
        for azimuth in AZIMUTHS_DEG {
            let (y, x) = azimuth.to_radians().sin_cos();
            all.extend(solver.on_microlens(sine * x, sine * y).ok()?.mean.absorbed);
        }
    }
    Some(all)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// A pixel that is all silicon under air absorbs from both ends of a narrow band as from its middle but for the
    /// second order in its width, and the bands' middles differ as its tables do.
    #[test]
    fn errors_are_those_of_tables_at_the_same_wavelengths() {
        let stack = PixelStack::builtin("1.6um").unwrap();
        let found = errors(&stack, 2.8).unwrap();
        let total = |nm: f64| -> f64 {
            let model = PixelModel::Wave(WaveSettings::standard());
            let solver = model.solver(&stack, nm).unwrap();
            solver
                .on_microlens(0.0, 0.0)
                .unwrap()
                .mean
                .absorbed
                .iter()
                .sum()
        };
        let [red, green, blue] = [610.0, 550.0, 465.0].map(total);
        let normal =
            100.0 * (((red / green - 1.0).powi(2) + (blue / green - 1.0).powi(2)) / 3.0).sqrt();
        // The cone's directions differ from the normal, and part the sub-pixels.
        assert!(found.response_percent > 0.5 * normal, "{found:?} {normal}");
        assert!(found.response_percent < 100.0 && found.width_percent < found.response_percent);
    }

    #[test]
    fn a_pixel_that_the_wave_model_refuses_is_not_estimated() {
        let stack = PixelStack::builtin("2.8um-tungsten").unwrap();
        assert_eq!(errors(&stack, 2.0), None);
    }
}
