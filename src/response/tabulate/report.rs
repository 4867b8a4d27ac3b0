//! How a table came about.

use serde::Serialize;

use crate::em::light::Light;
use crate::response::AngularResponse;

/// What a simulated P may be below 0, or a sum of P above 1, and still be called rounding.
const SHARE_TOLERANCE: f64 = 1e-3;

/// How a table came about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuildReport {
    /// Plane waves that the table needs.
    pub runs: usize,
    /// Of these, those that an earlier, interrupted build had done.
    pub reused: usize,
    /// The smallest P simulated, before anything is cut.
    pub least: f64,
    /// The largest sum of P over the sub-pixels simulated, before anything is scaled.
    pub largest_sum: f64,
    /// The most that cutting at 0 and scaling sums above 1 changed after interpolation.
    pub most_cut: f64,
    /// The worst residual of a run.
    pub residual: f64,
    /// The imbalance of power of largest size of a run.
    pub imbalance: f64,
    /// Runs with something wrong, as the model tells.
    pub warned: usize,
    /// The first of these, in words.
    pub warning: Option<String>,
    /// Why runs could not be kept for a later build, if so; no harm to this one.
    pub journal_trouble: Option<String>,
}

impl BuildReport {
    pub(super) fn new(runs: usize, reused: usize) -> Self {
        Self {
            runs,
            reused,
            least: f64::INFINITY,
            largest_sum: 0.0,
            most_cut: 0.0,
            residual: 0.0,
            imbalance: 0.0,
            warned: 0,
            warning: None,
            journal_trouble: None,
        }
    }

    /// Takes the answers to light from (u, v), one per wavelength, into account.
    pub(super) fn note(&mut self, lights: &[Light], [u, v]: [f64; 2]) {
        for light in lights {
            self.residual = self.residual.max(light.residual);
            if light.imbalance.abs() > self.imbalance.abs() {
                self.imbalance = light.imbalance;
            }
        }
        if let Some(first) = lights.iter().flat_map(|l| &l.warnings).next() {
            self.warned += 1;
            self.warning
                .get_or_insert_with(|| format!("(u, v) = ({u:.3}, {v:.3}): {first}"));
        }
    }

    /// Takes P of the sub-pixels into account.
    pub(super) fn note_shares(&mut self, p: &[f64]) {
        self.least = p.iter().copied().fold(self.least, f64::min);
        self.largest_sum = self.largest_sum.max(p.iter().sum());
    }

    /// What the model said that cannot be, beyond rounding; `None` if all is well.
    pub fn violation(&self) -> Option<String> {
        if self.least < -SHARE_TOLERANCE {
            Some(format!("a sub-pixel absorbed {:.4} (below 0)", self.least))
        } else if self.largest_sum > 1.0 + SHARE_TOLERANCE {
            let sum = self.largest_sum;
            Some(format!("sub-pixels absorbed {sum:.4} in all (above 1)"))
        } else {
            None
        }
    }
}

/// A table, and how it came about.
#[derive(Clone, Debug)]
pub struct BuiltTable {
    /// The table.
    pub table: AngularResponse,
    /// How it came about.
    pub report: BuildReport,
}
