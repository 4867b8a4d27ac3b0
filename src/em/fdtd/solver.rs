//! FDTD behind the seam of all solvers: one pulse answers at every wavelength.

use std::f64::consts::PI;

use super::{FdtdSettings, solve};
use crate::em::PixelStack;
use crate::em::light::{Incidence, Light, PixelSolver, SolverError, SolverProgress, SolverTask};
use crate::units::um_from_nm;

/// See the module.
pub(in crate::em) struct FdtdSolver {
    stack: PixelStack,
    wavelengths_nm: Vec<f64>,
    settings: FdtdSettings,
}

impl FdtdSolver {
    /// # Errors
    /// A pixel, settings or wavelengths out of range.
    pub fn new(task: &SolverTask, settings: &FdtdSettings) -> Result<Self, SolverError> {
        for wavelength_nm in task.wavelengths_nm {
            settings.memory_bytes(task.stack, &[*wavelength_nm], [0.0, 0.0])?;
        }
        Ok(Self {
            stack: task.stack.clone(),
            wavelengths_nm: task.wavelengths_nm.to_vec(),
            settings: *settings,
        })
    }
}

impl PixelSolver for FdtdSolver {
    fn stack(&self) -> &PixelStack {
        &self.stack
    }

    fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelengths_nm
    }

    fn light(
        &self,
        waves: &[Incidence],
        wavelengths: usize,
        watch: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        let nm = &self.wavelengths_nm[..wavelengths.min(self.wavelengths_nm.len())];
        let k0 = 2.0 * PI / nm.first().map_or(f64::NAN, |nm| um_from_nm(*nm));
        let run = |wave: &Incidence| {
            let stack = self.stack.with_lens_shift(wave.shift_um);
            let bloch = wave.direction.map(|cosine| cosine * k0);
            Ok(solve(&stack, nm, bloch, &self.settings, watch)?.answers)
        };
        waves.iter().map(run).collect()
    }
}
