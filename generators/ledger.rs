//! What the samples of a dataset contain of the light's way, what they do not, why, and what that costs: the ledgers of
//! all samples in one table.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use quadpixel_datasets::{Effect, Effects, EstimatedError, Reason};
use serde::Serialize;

use crate::preview::number;

/// The ledgers of several samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Ledger(BTreeMap<Effect, LedgerRow>);

/// An effect over several samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LedgerRow {
    /// Samples in which it is simulated.
    pub simulated: u64,
    /// Samples in which it is not.
    pub left_out: u64,
    /// Why not.
    pub reasons: BTreeSet<String>,
    /// Largest estimate of what leaving it out costs, RMS of the signal, %; `None` where nobody estimated it.
    pub signal_percent: Option<f64>,
    /// Largest estimate of the shift of what a sub-pixel sees, px; `None` where nobody estimated it.
    pub shift_px: Option<f64>,
}

impl Ledger {
    /// Counts a sample.
    pub fn count(&mut self, effects: &Effects) {
        for effect in &effects.simulated {
            self.0.entry(*effect).or_default().simulated += 1;
        }
        for left_out in &effects.left_out {
            let row = self.0.entry(left_out.effect).or_default();
            row.left_out += 1;
            let (words, reason) = (left_out.effect.to_string(), &left_out.reason);
            // A tolerance is that of the whole dataset, the estimates stand beside it.
            row.reasons.insert(match reason {
                Reason::BelowTolerance { .. } => "below the tolerance".to_string(),
                _ => without_head(&left_out.text, &words),
            });
            for error in &left_out.estimated_errors {
                let (most, value) = match *error {
                    EstimatedError::SignalPercent(value) => (&mut row.signal_percent, value),
                    EstimatedError::ShiftPx(value) => (&mut row.shift_px, value),
                };
                *most = Some(most.map_or(value, |most| most.max(value)));
            }
        }
    }

    /// Each effect and its row.
    pub fn rows(&self) -> impl Iterator<Item = (Effect, &LedgerRow)> {
        self.0.iter().map(|(effect, row)| (*effect, row))
    }
}

/// A row's text without the effect's name before it, which stands in a column of its own.
fn without_head(text: &str, words: &str) -> String {
    let rest = text.strip_prefix(words).and_then(|t| t.strip_prefix(": "));
    rest.unwrap_or(text).to_string()
}

impl LedgerRow {
    /// The largest estimates with their units; empty where there is none.
    pub fn estimate(&self) -> String {
        let signal = self
            .signal_percent
            .map(|e| format!("{} % of the signal", number(e)));
        let shift = self.shift_px.map(|e| format!("{} px", number(e)));
        signal
            .into_iter()
            .chain(shift)
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// A line per effect, for a terminal.
impl fmt::Display for Ledger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (effect, row) in self.rows() {
            let samples = row.simulated + row.left_out;
            writeln!(f, "  {effect}: simulated in {} of {samples}", row.simulated)?;
            for reason in &row.reasons {
                let estimate = match row.estimate() {
                    text if text.is_empty() => text,
                    text => format!(" (at most {text})"),
                };
                writeln!(f, "    left out: {reason}{estimate}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_row_counts_samples_and_keeps_the_largest_estimates() {
        let limit = Reason::BelowTolerance {
            signal_percent: 0.5,
            shift_px: 0.02,
        };
        let sample = |signal: f64, shift: f64| {
            let mut effects = Effects::default();
            effects.simulate(Effect::Defocus);
            let errors = vec![
                EstimatedError::SignalPercent(signal),
                EstimatedError::ShiftPx(shift),
            ];
            effects.leave_out_at(Effect::Dispersion, limit, errors);
            effects.leave_out(Effect::LensReflections, Reason::FullTransmission);
            effects
        };
        let mut ledger = Ledger::default();
        ledger.count(&sample(0.1, 0.015));
        ledger.count(&sample(0.3, 0.005));
        let mut with = Effects::default();
        with.simulate(Effect::Dispersion);
        ledger.count(&with);
        let row = |effect| ledger.rows().find(|(e, _)| *e == effect).unwrap().1;
        let dispersion = row(Effect::Dispersion);
        assert_eq!((dispersion.simulated, dispersion.left_out), (1, 2));
        assert_eq!(dispersion.signal_percent, Some(0.3));
        assert_eq!(dispersion.shift_px, Some(0.015));
        assert_eq!(dispersion.reasons.len(), 1);
        assert_eq!(row(Effect::Defocus).simulated, 2);
        let reflections = row(Effect::LensReflections);
        assert_eq!(reflections.estimate(), "");
        let reason = reflections.reasons.first().unwrap();
        assert!(
            reason.starts_with("transmission of the lens is 1 (not"),
            "{reason}"
        );
    }
}
