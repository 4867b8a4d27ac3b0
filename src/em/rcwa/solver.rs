//! The Fourier modal level behind the seam of all solvers.

use super::{RcwaModel, RcwaSettings};
use crate::em::PixelStack;
use crate::em::light::{
    Incidence, Light, PixelSolver, SolverError, SolverProgress, SolverTask, by_direction,
};

/// See the module.
pub(in crate::em) struct RcwaSolver {
    stack: PixelStack,
    settings: RcwaSettings,
    wavelength_nm: [f64; 1],
    model: RcwaModel,
}

impl RcwaSolver {
    /// # Errors
    /// As of [`RcwaModel::new`].
    pub fn new(
        task: &SolverTask,
        wavelength_nm: f64,
        settings: &RcwaSettings,
    ) -> Result<Self, SolverError> {
        Ok(Self {
            stack: task.stack.clone(),
            settings: *settings,
            wavelength_nm: [wavelength_nm],
            model: RcwaModel::new(task.stack, wavelength_nm, settings)?,
        })
    }

    fn under(&self, [u, v]: [f64; 2], shift_um: [f64; 2]) -> Result<Light, SolverError> {
        if shift_um == self.stack.lens.shift_um {
            return self.model.solve(u, v);
        }
        let stack = self.stack.with_lens_shift(shift_um);
        let model = RcwaModel::new(&stack, self.wavelength_nm[0], &self.settings)?;
        model.solve(u, v)
    }
}

impl PixelSolver for RcwaSolver {
    fn stack(&self) -> &PixelStack {
        &self.stack
    }

    fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    fn light(
        &self,
        waves: &[Incidence],
        _: usize,
        _: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        by_direction(waves, |[u, v], shifts_um| {
            // One shift alone may have mirrors to halve it by; the classes of a mosaic know no shift that they share.
            if shifts_um.len() > 1 && self.stack.mosaic.is_none() {
                return self.model.solve_shifts(u, v, shifts_um);
            }
            let one = |shift: &[f64; 2]| self.under([u, v], *shift);
            shifts_um.iter().map(one).collect()
        })
    }
}
