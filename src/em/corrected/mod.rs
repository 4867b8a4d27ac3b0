//! The `corrected` level: a fast solver everywhere, plus a smooth fit of its difference to a few runs of an exact one.
//!
//! ```text
//! P_i(u, v; s) ≈ (1 + β) W_i(u, v; s) + δ_i(u', v'; s)
//! ```
//! under a lens shift s, where (u', v') is (u, v) in the moving frame. W is the fast solver's P (the wave model's); β,
//! one number, the part by which it is dim or bright; δ the Gaussian-process mean (`fit`) of what is left. The exact
//! runs are spread over the directions (and shifts) that symmetry leaves, each as far as can be from those before
//! (`design`), so a fit with more runs uses all of one with fewer. The error is measured on runs left out, one at a
//! time; of few runs (six) this is too hopeful by a third or more, for ℓ and ν of the fit are chosen by it.

mod design;
mod fit;

use std::path::PathBuf;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::design::{Space, centred, shifted};
use self::fit::Process;
use super::PixelStack;
use super::light::{CorrectionFit, Incidence, Light, PixelSolver, SolverError, SolverProgress};
use super::wave::WaveSettings;
use crate::journal::Journal;
use crate::range::{self, OutOfRange, require};

pub use self::design::spread;

/// Name and version of the model: part of every table's key.
pub(super) const MODEL: &str = "corrected-1";

/// Settings of the corrected level; `Exact` is the enum of all models ([`super::PixelModel`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CorrectedSettings<Exact> {
    /// The wave model.
    pub wave: WaveSettings,
    /// The exact one: a model of Maxwell's equations.
    pub exact: Box<Exact>,
    /// Runs of the exact model, 3 to 200.
    pub runs: usize,
    /// Largest √(u'² + v'²) of an exact run, 0.1 to 0.94 (sin θ, for a centred lens); beyond, the correction fades to
    /// that by β.
    pub reach: f64,
}

/// What both solvers say of one plane wave.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactRun {
    /// Its direction, and the shift of the lens.
    pub incidence: Incidence,
    /// P of each sub-pixel by the exact solver.
    pub exact: Vec<f64>,
    /// P of each sub-pixel by the fast one.
    pub wave: Vec<f64>,
}

/// A fit.
#[derive(Clone, Debug)]
pub struct Correction {
    brighter: f64,
    process: Process,
    error: CorrectionFit,
}

impl<Exact> CorrectedSettings<Exact> {
    /// The wave model of tables, corrected by `runs` runs of an exact one up to 44° (sin θ = 0.7).
    pub fn with(exact: Exact, runs: usize) -> Self {
        Self {
            wave: WaveSettings::standard(),
            exact: Box::new(exact),
            runs,
            reach: 0.7,
        }
    }

    /// Ranges in which the fit works; the exact model's own are checked where it is named.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub(super) fn check_fit(&self) -> Result<(), SolverError> {
        self.wave.check()?;
        let runs = (3..=200).contains(&self.runs);
        require(runs, || {
            OutOfRange::new("response", "runs", self.runs, "3 to 200")
        })?;
        Ok(range::within("response", "reach", self.reach, 0.1..=0.94)?)
    }

    /// The exact runs for a pixel under its own lens shift, or under all shifts, in the order in which they are made.
    ///
    /// # Errors
    /// A material that does not know 550 nm.
    pub fn plan(
        &self,
        stack: &PixelStack,
        all_shifts: bool,
    ) -> Result<Vec<Incidence>, SolverError> {
        let space = Space::new(stack)?;
        let all = if all_shifts {
            shifted(stack, &space, self.reach)?
        } else {
            centred(stack, self.reach)
        };
        let order = spread(&all, stack, self.runs)?;
        Ok(order.into_iter().map(|i| all[i]).collect())
    }
}

/// Where exact runs are kept for a later fit with more.
pub(super) struct RunsFile {
    pub path: PathBuf,
    /// What they depend on, but for their number.
    pub key: String,
}

/// A solver made of two others.
pub(super) struct CorrectedSolver {
    fast: Box<dyn PixelSolver>,
    correction: Correction,
}

impl CorrectedSolver {
    /// Makes the exact runs of `plan` (those that were kept are not made again) and fits them.
    ///
    /// # Errors
    /// A run without an answer.
    pub fn new(
        fast: Box<dyn PixelSolver>,
        exact: &dyn PixelSolver,
        plan: &[Incidence],
        file: Option<RunsFile>,
    ) -> Result<Self, SolverError> {
        // A journal that cannot be kept only costs a later build its start.
        let journal =
            file.and_then(|f| Journal::<usize, Vec<f64>>::open(&f.path, &f.key, &()).ok());
        let absorbed = |solver: &dyn PixelSolver, wave: &Incidence| {
            let [u, v] = wave.direction;
            let light = solver.under_shifts(u, v, &[wave.shift_um])?;
            let first = light.into_iter().next();
            first
                .map(|l| l.mean.absorbed)
                .ok_or_else(|| SolverError::value("answers", 0, "one per plane wave"))
        };
        let one = |(k, incidence): (usize, &Incidence)| {
            let known = journal.as_ref().and_then(|j| j.outcome(&k)).cloned();
            let exact = match known {
                Some(known) => known,
                None => {
                    let shares = absorbed(exact, incidence)?;
                    if let Some(journal) = &journal {
                        journal.keep(k, &shares);
                    }
                    shares
                }
            };
            Ok(ExactRun {
                incidence: *incidence,
                exact,
                wave: absorbed(fast.as_ref(), incidence)?,
            })
        };
        let runs: Result<Vec<ExactRun>, SolverError> =
            plan.par_iter().enumerate().map(one).collect();
        let correction = Correction::fit(fast.stack(), &runs?)?;
        Ok(Self { fast, correction })
    }
}

impl PixelSolver for CorrectedSolver {
    fn stack(&self) -> &PixelStack {
        self.fast.stack()
    }

    fn wavelengths_nm(&self) -> &[f64] {
        self.fast.wavelengths_nm()
    }

    fn light(
        &self,
        waves: &[Incidence],
        wavelengths: usize,
        watch: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        let mut answers = self.fast.light(waves, wavelengths, watch)?;
        for (wave, lights) in waves.iter().zip(&mut answers) {
            for light in lights {
                self.correction.apply_to(*wave, light);
            }
        }
        Ok(answers)
    }

    fn correction_fit(&self) -> Option<CorrectionFit> {
        Some(self.correction.error)
    }
}

impl Correction {
    /// Fits the runs, at least three; every symmetry of the pixel and its lens shift is used.
    ///
    /// # Errors
    /// Fewer runs, or one that is not of the pixel.
    pub fn fit(stack: &PixelStack, runs: &[ExactRun]) -> Result<Self, SolverError> {
        let count = stack.subpixels.count();
        let fits = |p: &Vec<f64>| p.len() == count && p.iter().all(|p| p.is_finite());
        if runs.len() < 3 || !runs.iter().all(|r| fits(&r.exact) && fits(&r.wave)) {
            let allowed = "at least three, with a finite P per sub-pixel";
            return Err(SolverError::value("exact runs", runs.len(), allowed));
        }
        let products = |f: fn(f64, f64) -> f64| -> f64 {
            let pairs = runs.iter().flat_map(|r| r.exact.iter().zip(&r.wave));
            pairs.map(|(&e, &w)| f(e, w)).sum()
        };
        let brighter = products(|e, w| (e - w) * w) / products(|_, w| w * w).max(1e-300);
        let left = runs.iter().map(|r| {
            let pairs = r.exact.iter().zip(&r.wave);
            let left = pairs.map(|(e, w)| e - (1.0 + brighter) * w).collect();
            (r.incidence, left)
        });
        let left: Vec<(Incidence, Vec<f64>)> = left.collect();
        let (process, out) = Process::fit(&left, Space::new(stack)?);
        let off = runs.iter().flat_map(|r| r.exact.iter().zip(&r.wave));
        let (before_rms, before_max) = size(off.map(|(e, w)| e - w));
        let (left_rms, left_max) = size(out.into_iter().flatten());
        Ok(Self {
            brighter,
            process,
            error: CorrectionFit {
                runs: runs.len(),
                before_rms,
                before_max,
                left_rms,
                left_max,
            },
        })
    }

    /// What is known of the fit's error.
    pub fn error(&self) -> CorrectionFit {
        self.error
    }

    /// Corrects P of a plane wave, kept at 0 or more and at a sum of 1 or less.
    pub fn apply(&self, incidence: Incidence, p: &mut [f64]) {
        let difference = self.process.at(incidence);
        for (p, d) in p.iter_mut().zip(difference) {
            *p = ((1.0 + self.brighter) * *p + d).max(0.0);
        }
        let sum: f64 = p.iter().sum();
        if sum > 1.0 {
            p.iter_mut().for_each(|p| *p /= sum);
        }
    }

    /// Corrects an answer of the fast solver; what the sub-pixels take more or less is transmitted less or more.
    fn apply_to(&self, incidence: Incidence, light: &mut Light) {
        let before: f64 = light.mean.absorbed.iter().sum();
        self.apply(incidence, &mut light.mean.absorbed);
        light.mean.transmitted += before - light.mean.absorbed.iter().sum::<f64>();
    }
}

/// RMS and largest size.
fn size(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut sum, mut count, mut most) = (0.0, 0usize, 0f64);
    for x in values {
        sum += x * x;
        count += 1;
        most = most.max(x.abs());
    }
    ((sum / count.max(1) as f64).sqrt(), most)
}

#[cfg(test)]
mod tests;
