//! All pixel models by name: the one list that a new solver joins.
//!
//! A level is a model by its name, a preset a point between speed and accuracy; [`ModelChoice`] turns both into
//! settings. Everything that names a model (command line, configuration, recipe, `meta.json`) uses these words.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::corrected::{self, CorrectedSolver, RunsFile};
use super::fdtd::{self, FdtdSettings, FdtdSolver};
use super::geometric::{self, GeometricSolver};
use super::light::{PixelSolver, SolverError, SolverTask};
use super::rcwa::{self, RcwaSettings, RcwaSolver};
use super::wave::{self, WaveModel, WaveSettings};
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

/// A pixel model by its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The ideal box of eq. 2.
    Geometric,
    /// Scalar waves.
    #[default]
    Wave,
    /// Maxwell's equations in time.
    Fdtd,
    /// The wave model, corrected by an exact one.
    Corrected,
    /// Maxwell's equations by Fourier modes.
    Rcwa,
}

/// How finely a model computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Quick looks.
    Draft,
    /// The default.
    #[default]
    Standard,
    /// To compare others with.
    Reference,
}

/// Directions of a table, in steps from the normal to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectionSteps {
    /// Simulated steps.
    pub steps: usize,
    /// Table steps per simulated step.
    pub refine: usize,
}

impl Level {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Geometric,
        Self::Wave,
        Self::Fdtd,
        Self::Corrected,
        Self::Rcwa,
    ];

    /// The level that rendering computes as rays need it, without a table.
    pub const IDEAL: Self = Self::Geometric;

    /// The word that names it everywhere.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// One line for people.
    pub fn about(self) -> &'static str {
        self.words().1
    }

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Geometric => ("geometric", "The ideal box of the paper's equation 2"),
            Self::Wave => ("wave", "Scalar wave propagation through the pixel stack"),
            Self::Fdtd => (
                "fdtd",
                "Maxwell's equations in time, both polarizations: seconds to minutes per direction",
            ),
            Self::Corrected => (
                "corrected",
                "The wave model, corrected by a smooth fit of its difference to a few runs of an exact model (--exact, --exact-runs)",
            ),
            Self::Rcwa => (
                "rcwa",
                "Maxwell's equations by Fourier modes, both polarizations: a second to a minute per direction",
            ),
        }
    }

    /// Whether it solves Maxwell's equations, so that it can correct others.
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Fdtd | Self::Rcwa)
    }

    /// Whether an exact model corrects it.
    pub fn is_corrected(self) -> bool {
        self == Self::Corrected
    }

    /// Whether a dataset makes its tables unasked.
    pub fn is_quick(self) -> bool {
        matches!(self, Self::Geometric | Self::Wave)
    }

    /// Seconds of one core that a plane wave takes about, of a model whose tables take seconds to minutes, so that a
    /// dataset makes them unasked; `None` for the others.
    pub fn quick_run_s(self, stack: &PixelStack) -> Option<f64> {
        match self {
            Self::Geometric => Some(0.0),
            // Measured: `benches/runs/2026-11-21/cra.md`.
            Self::Wave => Some(1.5e-3 * (stack.pitch_um / 1.6).powi(3)),
            Self::Fdtd | Self::Corrected | Self::Rcwa => None,
        }
    }

    /// What its tables are off by against independent curves (`benches/runs/2026-11-21/response.md`), for people.
    pub fn error_text(self, preset: Preset) -> &'static str {
        match (self, preset) {
            (Self::Geometric, _) => "the ideal box: no diffraction, no crosstalk",
            (Self::Wave, Preset::Draft) => "within 0.05 of the light that falls on the pixel",
            (Self::Wave, Preset::Standard) => {
                "strong half within 8 %, weak half within 0.04; between directions 0.5 % of the peak"
            }
            (Self::Wave, Preset::Reference) => {
                "strong half within 8 %, weak half within 0.04 (the wave level's own); converged to a few parts in a \
                 thousand"
            }
            _ => "that of the tables, told where they were made",
        }
    }

    /// Directions of its tables of a pixel. Resonances in the lossless layers of small pixels are narrow in angle (a
    /// real band of wavelengths evens them out), and their directions cost less: `by_pitch` has more of them.
    fn directions(self, preset: Preset, stack: &PixelStack) -> DirectionSteps {
        let by_pitch = (16.0 * 3.5 / stack.pitch_um).round().clamp(12.0, 36.0) as usize;
        let (steps, refine) = match (self, preset) {
            (Self::Geometric, _) => (64, 1),
            (Self::Wave | Self::Fdtd | Self::Rcwa, Preset::Draft) => (12, 3),
            (Self::Wave | Self::Rcwa, Preset::Standard) => (by_pitch, 4),
            (Self::Fdtd, Preset::Standard) => (16, 4),
            (Self::Wave | Self::Rcwa, Preset::Reference) => (40, 3),
            (Self::Fdtd, Preset::Reference) | (Self::Corrected, _) => (by_pitch, 4),
        };
        DirectionSteps { steps, refine }
    }
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Standard, Self::Reference];

    /// The word that names it everywhere.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::Reference => "reference",
        }
    }

    /// Whether it is the usual one.
    pub fn is_standard(&self) -> bool {
        *self == Self::Standard
    }
}

/// Written and read as the words of `name`.
macro_rules! by_name {
    ($($type:ident as $field:literal),*) => {$(
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())
            }
        }

        impl FromStr for $type {
            type Err = OutOfRange;

            fn from_str(name: &str) -> Result<Self, OutOfRange> {
                let allowed = || Self::ALL.map(Self::name).join(", ");
                let named = Self::ALL.into_iter().find(|x| x.name() == name);
                named.ok_or_else(|| OutOfRange::new("response", $field, name, allowed()))
            }
        }
    )*};
}

by_name!(Level as "model", Preset as "preset");

/// A model by name, and how finely it computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelChoice {
    /// The model.
    pub level: Level,
    /// How finely it computes; of the corrected level, how finely its wave model does.
    pub preset: Preset,
    /// Of the corrected level: the exact model, how finely it computes, and its runs.
    pub exact: (Level, Preset, usize),
    /// Of the geometric level: focal length of the ideal microlens, µm.
    pub focal_length_um: f64,
}

impl ModelChoice {
    /// The usual exact model of the corrected level: which, how finely it computes, and its runs.
    pub const EXACT: (Level, Preset, usize) = (Level::Fdtd, Preset::Draft, 16);

    /// A level at a preset, the rest as usual: corrected by 16 draft runs of FDTD, a microlens of 7 µm.
    pub fn new(level: Level, preset: Preset) -> Self {
        Self {
            level,
            preset,
            exact: Self::EXACT,
            focal_length_um: 7.0,
        }
    }

    /// The model with its settings.
    pub fn model(&self) -> PixelModel {
        match self.level {
            Level::Geometric => PixelModel::Geometric {
                focal_length_um: self.focal_length_um,
            },
            Level::Wave => PixelModel::Wave(self.wave()),
            Level::Fdtd => PixelModel::Fdtd(match self.preset {
                Preset::Draft => FdtdSettings::draft(),
                Preset::Standard => FdtdSettings::standard(),
                Preset::Reference => FdtdSettings::reference(),
            }),
            Level::Rcwa => PixelModel::Rcwa(match self.preset {
                Preset::Draft => RcwaSettings::draft(),
                Preset::Standard => RcwaSettings::standard(),
                Preset::Reference => RcwaSettings::reference(),
            }),
            Level::Corrected => PixelModel::Corrected(self.corrected()),
        }
    }

    /// Settings of the corrected level, whatever the level is.
    pub fn corrected(&self) -> CorrectedSettings {
        let (level, preset, runs) = self.exact;
        let exact = match level {
            // Refused by the model's check, as one that is not exact; a corrected one would be corrected for ever.
            Level::Corrected => Level::Wave,
            exact => exact,
        };
        let exact = Self {
            level: exact,
            preset,
            ..*self
        };
        CorrectedSettings {
            wave: self.wave(),
            ..CorrectedSettings::with(exact.model(), runs)
        }
    }

    fn wave(&self) -> WaveSettings {
        match self.preset {
            Preset::Draft => WaveSettings::draft(),
            Preset::Standard => WaveSettings::standard(),
            Preset::Reference => WaveSettings::reference(),
        }
    }

    /// Directions of its table of a pixel.
    pub fn directions(&self, stack: &PixelStack) -> DirectionSteps {
        self.level.directions(self.preset, stack)
    }

    /// Model and directions of its table of all lens shifts. The wave model leaves out the light that comes back from
    /// the trenches, so that all shifts share one solution of the lens; its solver's residual is then as small as the
    /// interpolation's error.
    pub fn for_all_shifts(&self, stack: &PixelStack) -> (PixelModel, DirectionSteps) {
        let (mut model, mut directions) = (self.model(), self.directions(stack));
        let standard = self.preset == Preset::Standard;
        match (&mut model, self.preset) {
            (PixelModel::Wave(settings), Preset::Draft | Preset::Standard) => {
                *settings = WaveSettings {
                    bounces: 0,
                    tolerance: 5e-3,
                    ..WaveSettings::standard()
                };
            }
            (PixelModel::Rcwa(_), Preset::Standard) => {}
            _ => return (model, directions),
        }
        if standard {
            directions.steps = directions.steps.min(24);
        }
        directions.refine = 3;
        (model, directions)
    }
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
