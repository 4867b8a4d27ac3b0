//! All pixel models with their settings: the one list that a new solver joins.

use serde::{Deserialize, Serialize};

use super::corrected::{self, CorrectedSolver, RunsFile};
use super::fdtd::{self, FdtdSettings, FdtdSolver};
use super::geometric::{self, GeometricSolver};
use super::level::Level;
use super::light::{PixelSolver, SolverError, SolverTask};
use super::rcwa::{self, RcwaSettings, RcwaSolver};
use super::wave::{self, WaveModel, WaveMosaic, WaveSettings};
use super::{PixelStack, StackError};
use crate::hash::settings_hash;
use crate::range::{OutOfRange, require};

/// Settings of the corrected level.
pub type CorrectedSettings = corrected::CorrectedSettings<PixelModel>;

/// A pixel model with its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelModel {
    /// The ideal box of eq. 2 ([`super::geometric::GeometricResponse`]), which a table blurs by one step: for programs
    /// that read tables.
    Geometric {
        /// Focal length of the microlens in air, µm.
        focal_length_um: f64,
    },
    /// Scalar waves ([`super::wave`]).
    Wave(WaveSettings),
    /// Maxwell's equations in time ([`super::fdtd`]).
    Fdtd(FdtdSettings),
    /// The wave model with a fit of its difference to a few runs of an exact one ([`super::corrected`]).
    Corrected(CorrectedSettings),
    /// Maxwell's equations by Fourier modes ([`super::rcwa`]).
    Rcwa(RcwaSettings),
}

impl CorrectedSettings {
    /// Ranges in which the level works.
    ///
    /// # Errors
    /// The first setting out of its range, or an exact model that is not.
    pub fn check(&self) -> Result<(), SolverError> {
        let (exact, allowed) = (self.exact.version(), "a model of Maxwell's equations");
        require(self.exact.level().is_exact(), || {
            OutOfRange::new("response", "exact", exact, allowed)
        })?;
        self.exact.check()?;
        self.check_fit()
    }
}

impl PixelModel {
    /// Its name.
    pub fn level(&self) -> Level {
        match self {
            Self::Geometric { .. } => Level::Geometric,
            Self::Wave(_) => Level::Wave,
            Self::Fdtd(_) => Level::Fdtd,
            Self::Corrected(_) => Level::Corrected,
            Self::Rcwa(_) => Level::Rcwa,
        }
    }

    /// Name and version, part of every table's key.
    pub fn version(&self) -> &'static str {
        match self {
            Self::Geometric { .. } => geometric::MODEL,
            Self::Wave(_) => wave::MODEL,
            Self::Fdtd(_) => fdtd::MODEL,
            Self::Corrected(_) => corrected::MODEL,
            Self::Rcwa(_) => rcwa::MODEL,
        }
    }

    /// Ranges in which the model works.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), SolverError> {
        match self {
            Self::Geometric { focal_length_um } => {
                require(
                    *focal_length_um > 0.0 && focal_length_um.is_finite(),
                    || {
                        let allowed = "finite and > 0";
                        OutOfRange::new("response", "focal_length_um", focal_length_um, allowed)
                    },
                )?;
                Ok(())
            }
            Self::Wave(settings) => Ok(settings.check()?),
            Self::Fdtd(settings) => settings.check(),
            Self::Corrected(settings) => settings.check(),
            Self::Rcwa(settings) => settings.check(),
        }
    }

    /// Whether one run answers for many wavelengths at one transverse wavevector k∥.
    pub fn is_pulsed(&self) -> bool {
        matches!(self, Self::Fdtd(_))
    }

    /// The pixel at one wavelength under its own lens shift, ready to be lit.
    ///
    /// # Errors
    /// As of [`Self::solvers`].
    pub fn solver(
        &self,
        stack: &PixelStack,
        wavelength_nm: f64,
    ) -> Result<Box<dyn PixelSolver>, SolverError> {
        self.one_solver(stack, wavelength_nm, false)
    }

    /// [`Self::solver`] for any lens shift.
    ///
    /// # Errors
    /// As of [`Self::solvers`].
    pub fn solver_of_shifts(
        &self,
        stack: &PixelStack,
        wavelength_nm: f64,
    ) -> Result<Box<dyn PixelSolver>, SolverError> {
        self.one_solver(stack, wavelength_nm, true)
    }

    fn one_solver(
        &self,
        stack: &PixelStack,
        wavelength_nm: f64,
        any_shift: bool,
    ) -> Result<Box<dyn PixelSolver>, SolverError> {
        let solvers = self.solvers(&SolverTask {
            stack,
            wavelengths_nm: &[wavelength_nm],
            any_shift,
            folder: None,
        })?;
        let none = || SolverError::value("wavelengths_nm", "empty", "at least one");
        solvers.into_iter().next().ok_or_else(none)
    }

    /// The pixel, ready to be lit: one solver per wavelength, or a single one that answers for all. The corrected level
    /// makes its exact runs here.
    ///
    /// # Errors
    /// A pixel, settings or a wavelength out of range, or a pixel that the model has no answer for, with the reason.
    pub fn solvers(&self, task: &SolverTask) -> Result<Vec<Box<dyn PixelSolver>>, SolverError> {
        self.check()?;
        task.stack.check()?;
        if let Self::Fdtd(settings) = self {
            return Ok(vec![Box::new(FdtdSolver::new(task, settings)?)]);
        }
        let wavelengths_nm = task.wavelengths_nm.iter();
        wavelengths_nm
            .map(|&nm| self.at_wavelength(task, nm))
            .collect()
    }

    fn at_wavelength(
        &self,
        task: &SolverTask,
        nm: f64,
    ) -> Result<Box<dyn PixelSolver>, SolverError> {
        Ok(match self {
            Self::Geometric { focal_length_um } => {
                Box::new(GeometricSolver::new(task, nm, *focal_length_um)?)
            }
            Self::Wave(settings) if task.stack.mosaic.is_some() => {
                Box::new(WaveMosaic::new(task.stack, nm, settings)?)
            }
            Self::Wave(settings) => Box::new(WaveModel::new(task.stack, nm, settings)?),
            Self::Rcwa(settings) => Box::new(RcwaSolver::new(task, nm, settings)?),
            Self::Fdtd(settings) => {
                let wavelengths_nm = &[nm];
                let task = SolverTask {
                    wavelengths_nm,
                    ..*task
                };
                Box::new(FdtdSolver::new(&task, settings)?)
            }
            Self::Corrected(settings) => {
                let fast = WaveModel::new(task.stack, nm, &settings.wave)?;
                let exact = settings.exact.solver_of_shifts(task.stack, nm)?;
                let plan = settings.plan(task.stack, task.any_shift)?;
                let file = match task.folder {
                    Some(folder) => {
                        let key = exact_runs_key(settings, task, nm)?;
                        let path = folder.join(format!("{key}.exact"));
                        Some(RunsFile { path, key })
                    }
                    None => None,
                };
                let fast = Box::new(fast);
                Box::new(CorrectedSolver::new(fast, exact.as_ref(), &plan, file)?)
            }
        })
    }
}

/// Hash of what the exact runs of a correction depend on, but for their number.
fn exact_runs_key(
    settings: &CorrectedSettings,
    task: &SolverTask,
    wavelength_nm: f64,
) -> Result<String, SolverError> {
    let inputs = (
        settings.exact.version(),
        &settings.exact,
        task.stack,
        wavelength_nm,
        settings.reach,
        task.any_shift,
    );
    settings_hash(&inputs).map_err(|e| {
        let allowed = "finite numbers";
        StackError::value("settings", e, allowed).into()
    })
}
