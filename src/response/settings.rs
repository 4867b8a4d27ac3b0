//! What to tabulate, and how finely.

use serde::{Deserialize, Serialize};

use crate::em::{Level, ModelChoice, PixelModel, PixelStack, Preset, ShiftGrid};
use crate::hash::settings_hash;
use crate::range::{self, OutOfRange, require};
use crate::response::ResponseError;

/// Wavelength of tables that name none, nm.
const WAVELENGTH_NM: f64 = 550.0;
/// End of tables that name none.
const COSINE_MAX: f64 = 0.8;
/// F-number of the cone that the sub-pixels share, of tables that name none.
const CONE_F_NUMBER: f64 = 2.0;

/// The lens shifts of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftSettings {
    /// Shifts simulated per pitch, along x and along y.
    pub per_pitch: usize,
    /// F-number of the cone that the sub-pixels shall share ([`crate::response::ChiefRayShifts`]).
    pub cone_f_number: f64,
}

/// What to tabulate; [`Self::new`] gives that of a level and preset.
///
/// Directions are simulated on a regular grid of u and v from 0 to ±`cosine_max` in `steps` steps, up to sin θ = 0.94;
/// table nodes further out repeat it along their meridian. A model that is pulsed is run on a grid of k∥ instead, that
/// one of the shortest wavelength, and every wavelength reads its own (u, v) from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSettings {
    /// The pixel model.
    pub model: PixelModel,
    /// Wavelengths in nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Largest |u| and |v| of the table.
    pub cosine_max: f64,
    /// Simulated steps from u = 0 to `cosine_max`.
    pub steps: usize,
    /// Table steps per simulated step.
    pub refine: usize,
    /// All lens shifts; absent: only the pixel's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<ShiftSettings>,
}

impl TableSettings {
    /// The table of a level at a preset, at 550 nm and up to direction cosines of 0.8.
    pub fn new(level: Level, preset: Preset, stack: &PixelStack) -> Self {
        Self::for_choice(&ModelChoice::new(level, preset), stack)
    }

    /// [`Self::new`] with the rest of what names a model.
    pub fn for_choice(choice: &ModelChoice, stack: &PixelStack) -> Self {
        let directions = choice.directions(stack);
        Self {
            model: choice.model(),
            wavelengths_nm: vec![WAVELENGTH_NM],
            cosine_max: COSINE_MAX,
            steps: directions.steps,
            refine: directions.refine,
            shifts: None,
        }
    }

    /// The table of all lens shifts, `per_pitch` along x and along y.
    pub fn for_all_shifts(choice: &ModelChoice, stack: &PixelStack, per_pitch: usize) -> Self {
        let (model, directions) = choice.for_all_shifts(stack);
        Self {
            model,
            steps: directions.steps,
            refine: directions.refine,
            shifts: Some(ShiftSettings {
                per_pitch,
                cone_f_number: CONE_F_NUMBER,
            }),
            ..Self::for_choice(choice, stack)
        }
    }

    /// Ranges in which tables are made.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), ResponseError> {
        let error = |field: &'static str, value: String, allowed: &'static str| {
            move || OutOfRange::new("response", field, value, allowed)
        };
        self.model.check()?;
        let (end, steps, refine) = (self.cosine_max, self.steps, self.refine);
        let allowed = "0.01 to 0.99";
        require(
            (0.01..=0.99).contains(&end),
            error("cosine_max", end.to_string(), allowed),
        )?;
        require(
            (2..=200).contains(&steps),
            error("steps", steps.to_string(), "2 to 200"),
        )?;
        require(
            (1..=16).contains(&refine),
            error("refine", refine.to_string(), "1 to 16"),
        )?;
        let w = &self.wavelengths_nm;
        let increasing = !w.is_empty() && w.windows(2).all(|w| w[1] > w[0]);
        let positive = w.iter().all(|w| w.is_finite() && *w > 0.0);
        let allowed = "at least one, positive, increasing";
        require(
            increasing && positive,
            error("wavelengths_nm", format!("{w:?}"), allowed),
        )?;
        if let Some(shifts) = &self.shifts {
            ShiftGrid::new(1.0, shifts.per_pitch)?;
            range::within(
                "response",
                "cone_f_number",
                shifts.cone_f_number,
                0.8..=32.0,
            )?;
        }
        Ok(())
    }

    /// Hash of model, pixel and settings: the same key means the same table.
    ///
    /// # Errors
    /// Settings that JSON has no form for.
    pub fn key(&self, stack: &PixelStack) -> Result<String, ResponseError> {
        let all = (self.model.version(), stack, self);
        settings_hash(&all).map_err(|e| ResponseError::value("settings", e, "finite numbers"))
    }
}
