//! The ledger of effects: what of the light's way a sample's pictures contain, what they do not, why, and what that may
//! cost.

mod effect;
mod reason;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use effect::Effect;
pub use reason::Reason;

/// The size of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatedError {
    /// RMS difference of the sub-pixels' values over their mean, %.
    SignalPercent(f64),
    /// Largest shift of what a sub-pixel sees, px.
    ShiftPx(f64),
}

/// An effect that was not simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeftOut {
    /// Which.
    pub effect: Effect,
    /// Why.
    pub reason: Reason,
    /// Both in words, for people: what a reader decides by is beside it.
    pub text: String,
    /// What that costs; empty where nobody estimated it.
    pub estimated_errors: Vec<EstimatedError>,
}

/// What the pictures contain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// Effects that were simulated.
    pub simulated: Vec<Effect>,
    /// Effects that were not.
    pub left_out: Vec<LeftOut>,
}

impl Effects {
    /// Enters an effect that is simulated.
    pub fn simulate(&mut self, effect: Effect) {
        self.simulated.push(effect);
    }

    /// Enters an effect that is not simulated, and why.
    pub fn leave_out(&mut self, effect: Effect, reason: Reason) {
        self.leave_out_at(effect, reason, Vec::new());
    }

    /// Enters an effect that is not simulated, why, and what that costs.
    pub fn leave_out_at(
        &mut self,
        effect: Effect,
        reason: Reason,
        estimated_errors: Vec<EstimatedError>,
    ) {
        let mut text = format!("{effect}: {reason}");
        if estimated_errors.is_empty() {
            text += &format!(" (not estimated: {})", reason.without_estimate());
        }
        self.left_out.push(LeftOut {
            effect,
            reason,
            text,
            estimated_errors,
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn effects_have_one_name_in_arguments_and_files_and_reasons_carry_their_numbers() {
        for effect in Effect::SELECTABLE {
            let json = serde_json::to_string(&effect).unwrap();
            assert_eq!(json, format!("\"{}\"", effect.name()));
        }
        let mut ledger = Effects::default();
        let limit = Reason::BelowTolerance {
            signal_percent: 0.5,
            shift_px: 0.02,
        };
        ledger.simulate(Effect::Defocus);
        let errors = vec![
            EstimatedError::SignalPercent(0.1),
            EstimatedError::ShiftPx(0.01),
        ];
        ledger.leave_out_at(Effect::Dispersion, limit, errors);
        ledger.leave_out(Effect::LensReflections, Reason::FullTransmission);
        let json = serde_json::to_value(&ledger).unwrap();
        assert_eq!(json["simulated"][0], "defocus");
        assert_eq!(
            json["left_out"][0]["reason"]["below-tolerance"]["shift_px"],
            0.02
        );
        assert_eq!(json["left_out"][0]["estimated_errors"][1]["shift-px"], 0.01);
        assert_eq!(json["left_out"][1]["reason"], "full-transmission");
        assert_eq!(serde_json::from_value::<Effects>(json).unwrap(), ledger);
        let text = &ledger.left_out[0].text;
        assert_eq!(
            text,
            "dispersion: below the tolerance of 0.5 % of the signal and 0.02 px"
        );
        let text = &ledger.left_out[1].text;
        assert!(
            text.ends_with("(not estimated: that is the camera asked for)"),
            "{text}"
        );
    }
}
