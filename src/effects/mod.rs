//! Only the effects that a scene calls for: what each does to this image, and which may be left out.
//!
//! ```text
//! camera, scene ─ without one effect ─▶ both ─▶ Estimate: largest shift (px), difference (RMS of the signal)
//!                                                  └─ plan ─▶ what is rendered, and a Decision per effect
//! ```
//!
//! An effect is left out if what that changes is below both tolerances, and only where the renderer then has less to
//! do: each effect's own cheaper path is a function of [`Camera`](crate::render::Camera) or of the scene. The estimates
//! follow the rays of the image to come, with and without the effect, on a few of its pixels; they are functions of
//! camera, scene and seed alone, so that a plan is the same everywhere.

use quadpixel_datasets::EstimatedError;

mod choice;
mod estimates;
mod plan;
mod reflections;
mod shift;
mod shot;
mod signal;
mod vignetting;

pub use choice::{Choice, ChoiceError, Tolerance};
pub use plan::{Decision, Planned, Verdict, plan};
pub use quadpixel_datasets::Effect;
pub use shot::Shot;

/// What leaving an effect out would do to the image.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// RMS difference of the sub-pixels' values over their mean, %, an upper bound (two standard errors of the probes
    /// above the mean); `None` where the shift alone decided.
    pub signal_percent: Option<f64>,
    /// Largest shift of what a sub-pixel sees, over window, channels and depths, px; `None` for effects that move
    /// nothing.
    pub shift_px: Option<f64>,
}

impl Estimate {
    /// As descriptions of samples have it. Where a place is dark in one picture only, the shift is +∞, which no JSON
    /// has: then the signal alone tells.
    pub fn errors(&self) -> Vec<EstimatedError> {
        let signal = self.signal_percent.map(EstimatedError::SignalPercent);
        let shift = self.shift_px.filter(|px| px.is_finite());
        (signal.into_iter())
            .chain(shift.map(EstimatedError::ShiftPx))
            .collect()
    }
}

impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.signal_percent, self.shift_px) {
            (Some(signal), Some(shift)) => write!(f, "{signal:.2} % of the signal, {shift:.4} px"),
            (Some(signal), None) => write!(f, "{signal:.2} % of the signal"),
            (None, Some(shift)) => write!(f, "{shift:.4} px"),
            (None, None) => write!(f, "not estimated"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dark_without_the_effect_is_told_by_the_signal_alone() {
        let dark = Estimate {
            signal_percent: Some(98.0),
            shift_px: Some(f64::INFINITY),
        };
        assert_eq!(dark.errors(), [EstimatedError::SignalPercent(98.0)]);
        let shifted = Estimate {
            shift_px: Some(0.5),
            ..dark
        };
        assert_eq!(shifted.errors().len(), 2);
    }
}
