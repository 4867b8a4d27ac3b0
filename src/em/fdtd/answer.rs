//! What a run answers, and what it took.

use serde::{Deserialize, Serialize};

use crate::em::light::Light;

/// Deviation of the energy balance from 1 that a run may have; [`FdtdRun::warnings`] names larger ones.
pub const BALANCE: f64 = 0.01;

/// What a run found and what it took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FdtdRun {
    /// One per wavelength, with s and p.
    pub answers: Vec<Light>,
    /// Largest change of a photodiode's P in the last [`super::CHECK_UM`], or difference of its volume integral and
    /// flux.
    pub residual: f64,
    /// Whether the residual came below the tolerance in the allowed time.
    pub converged: bool,
    /// Time steps.
    pub steps: u64,
    /// Simulated time in µm/c.
    pub time_um: f64,
    /// Wall clock.
    pub seconds: f64,
    /// Bytes of fields, maps and phasors.
    pub memory_bytes: usize,
    /// Cells in x, y and z of what was stepped (halved by mirrors).
    pub cells: [usize; 3],
    /// Sets of real fields that were stepped.
    pub sets: usize,
}

impl FdtdRun {
    /// What is wrong with the run: not converged, or energy lost or made. Empty if nothing is.
    pub fn warnings(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for warning in self.answers.iter().flat_map(|a| &a.warnings) {
            if !all.contains(warning) {
                all.push(warning.clone());
            }
        }
        all
    }
}
