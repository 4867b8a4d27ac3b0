//! `[sweep]`: focus stacks, several samples of one scene.

use serde::{Deserialize, Serialize};

use super::{ConfigError, Draw, Range, number};
use crate::field_error::FieldError;

/// A focus stack a scene: samples `k·steps … k·steps + steps − 1` are scene k at even steps of focus.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepConfig {
    /// Samples a scene, at least 2.
    pub steps: usize,
    /// Focused depth over the one that was drawn for the scene, from the first step to the last, even in its scale.
    pub focus_over_drawn: Range,
}

impl SweepConfig {
    pub(super) fn check(&self, focus_mm: &Draw) -> Result<(), ConfigError> {
        let (steps, most) = (self.steps, 1000);
        if !(2..=most).contains(&steps) {
            return Err(FieldError::new("sweep.steps", steps, format!("2 to {most}")).into());
        }
        if !focus_mm.bounds().1.is_finite() {
            return Err(ConfigError::Together(
                "lens.focus_mm reaches infinity; allowed with [sweep]: finite depths".into(),
            ));
        }
        let range = Draw::Range(self.focus_over_drawn);
        let row = ("sweep.focus_over_drawn", Some(range), [0.05, 100.0]);
        Ok(number::check(&[row])?)
    }

    /// Focused depth over the drawn one at a step.
    pub(crate) fn factor(&self, step: u64) -> f64 {
        self.focus_over_drawn
            .at(step as f64 / (self.steps - 1) as f64)
    }
}
