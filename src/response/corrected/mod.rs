//! The `corrected` level: the wave model everywhere, plus a smooth fit of its difference to a few runs of an exact model.
//!
//! ```text
//! P_i(u, v; s) ≈ (1 + β) W_i(u, v; s) + δ_i(u', v'; s)
//! ```
//! under a lens shift s, where (u', v') is (u, v) in the moving frame. W is the wave model's P; β, one number, the part by which it is dim or bright; δ the Gaussian-process mean ([`fit`]) of what is left. The
//! exact runs are spread over the directions (and shifts) that symmetry leaves, each as far as can be from those before ([`design`]), so
//! a fit with more runs uses all of one with fewer. The error is measured on runs left out, one at a time; of
//! few runs (six) this is too hopeful by a third or more, for ℓ and ν of the fit are chosen by it.

mod design;
mod fit;

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::fit::Process;
use super::build::lit_answer;
use super::journal::{Answer, Journal};
use super::{PixelModel, PlaneWaveAnswer, ResponseError, ShiftedPixel};
use crate::em::PixelStack;
use crate::em::wave::{WaveModel, WaveSettings};

pub use self::design::{Incidence, spread};
use self::design::{Space, centred, shifted};

/// Name and version of the model: part of every table's key.
pub(super) const MODEL: &str = "corrected-1";

/// Settings of the corrected level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CorrectedSettings {
    /// The wave model.
    pub wave: WaveSettings,
    /// The exact one: not geometric, wave or corrected.
    pub exact: Box<PixelModel>,
    /// Runs of the exact model, 3 to 200.
    pub runs: usize,
    /// Largest √(u'² + v'²) of an exact run, 0.1 to 0.94 (sin θ, for a centred lens); beyond, the correction fades to that by β.
    pub reach: f64,
}

/// What both models say of one plane wave.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactRun {
    /// Its direction, and the shift of the lens.
    pub incidence: Incidence,
    /// P of each sub-pixel by the exact model.
    pub exact: Vec<f64>,
    /// P of each sub-pixel by the wave model.
    pub wave: Vec<f64>,
}

/// How far the wave model was from the exact runs, and what is left of it where a run is left out of the fit: of P, not in parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CorrectionError {
    /// Exact runs.
    pub runs: usize,
    /// RMS of exact less wave.
    pub before_rms: f64,
    /// Largest of exact less wave.
    pub before_max: f64,
    /// RMS of exact less corrected, each run left out in turn.
    pub left_rms: f64,
    /// Largest of exact less corrected, each run left out in turn.
    pub left_max: f64,
}

/// A fit.
#[derive(Clone, Debug)]
pub struct Correction {
    brighter: f64,
    process: Process,
    error: CorrectionError,
}

impl CorrectedSettings {
    /// The wave model of tables, corrected by `runs` runs of an exact one up to 44° (sin θ = 0.7).
    pub fn with(exact: PixelModel, runs: usize) -> Self {
        Self {
            wave: WaveSettings::standard(),
            exact: Box::new(exact),
            runs,
            reach: 0.7,
        }
    }

    /// Ranges in which the model works.
    pub fn check(&self) -> Result<(), ResponseError> {
        self.wave.check()?;
        let inexact = matches!(
            *self.exact,
            PixelModel::Geometric { .. } | PixelModel::Wave(_) | PixelModel::Corrected(_)
        );
        if inexact {
            return Err(ResponseError::value(
                "exact",
                self.exact.version(),
                "a model of Maxwell's equations",
            ));
        }
        self.exact.check()?;
        if !(3..=200).contains(&self.runs) {
            return Err(ResponseError::value("runs", self.runs, "3 to 200"));
        }
        if !(0.1..=0.94).contains(&self.reach) {
            return Err(ResponseError::value("reach", self.reach, "0.1 to 0.94"));
        }
        Ok(())
    }

    /// The exact runs for a pixel under its own lens shift, or under all shifts, in the order in which they are made.
    pub fn plan(
        &self,
        stack: &PixelStack,
        all_shifts: bool,
    ) -> Result<Vec<Incidence>, ResponseError> {
        let space = Space::of(stack)?;
        let all = if all_shifts {
            shifted(stack, &space, self.reach)?
        } else {
            centred(stack, self.reach)
        };
        let order = spread(&all, stack, self.runs)?;
        Ok(order.into_iter().map(|i| all[i]).collect())
    }

    /// Makes the exact runs (those that `journal` holds are not made again; it is left for a later fit with more) and fits them.
    pub fn simulate(
        &self,
        stack: &PixelStack,
        wavelength_nm: f64,
        all_shifts: bool,
        journal: Option<&Path>,
    ) -> Result<Correction, ResponseError> {
        self.check()?;
        let exact = ShiftedPixel::new(stack, &self.exact, wavelength_nm)?;
        let wave = WaveModel::new(stack, wavelength_nm, &self.wave)?;
        // A journal that cannot be kept only costs a later build its start.
        let key = self.exact_key(stack, wavelength_nm, all_shifts);
        let journal = journal.and_then(|path| Journal::open(path, &key).ok());
        let one = |(k, incidence): (usize, &Incidence)| {
            let [u, v] = incidence.direction;
            let id = (0, (k as i64, 0), 0);
            let known = journal.as_ref().and_then(|j| j.answer(id)).cloned();
            let answer: Answer = match known {
                Some(answer) => answer,
                None => {
                    let mut light = exact.light(u, v, &[incidence.shift_um])?;
                    let answer = lit_answer(light.swap_remove(0));
                    if let Some(journal) = &journal {
                        journal.keep(id, &answer);
                    }
                    answer
                }
            };
            let absorbed = answer.absorbed.into_iter().next();
            let mut wave = wave.solve_shifts(u, v, &[incidence.shift_um])?;
            Ok(ExactRun {
                incidence: *incidence,
                exact: absorbed.unwrap_or_default(),
                wave: wave.swap_remove(0).absorbed,
            })
        };
        let plan = self.plan(stack, all_shifts)?;
        let runs: Result<Vec<ExactRun>, ResponseError> =
            plan.par_iter().enumerate().map(one).collect();
        Correction::fit(stack, &runs?)
    }

    /// Hash of what the exact runs depend on, but for their number.
    pub(super) fn exact_key(
        &self,
        stack: &PixelStack,
        wavelength_nm: f64,
        all_shifts: bool,
    ) -> String {
        let mut hash = blake3::Hasher::new();
        hash.update(self.exact.version().as_bytes());
        let what = format!(
            "{stack:?}{:?} {wavelength_nm} {} {all_shifts}",
            self.exact, self.reach
        );
        hash.update(what.as_bytes());
        hash.finalize().to_hex().to_string()
    }
}

impl Correction {
    /// Fits the runs, at least three; every symmetry of the pixel and its lens shift is used.
    pub fn fit(stack: &PixelStack, runs: &[ExactRun]) -> Result<Self, ResponseError> {
        let count = stack.subpixels.count();
        let fits = |p: &Vec<f64>| p.len() == count && p.iter().all(|p| p.is_finite());
        if runs.len() < 3 || !runs.iter().all(|r| fits(&r.exact) && fits(&r.wave)) {
            return Err(ResponseError::value(
                "exact runs",
                runs.len(),
                "at least three, with a finite P a sub-pixel",
            ));
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
        let (process, out) = Process::fit(&left, Space::of(stack)?);
        let off = runs.iter().flat_map(|r| r.exact.iter().zip(&r.wave));
        let (before_rms, before_max) = size(off.map(|(e, w)| e - w));
        let (left_rms, left_max) = size(out.into_iter().flatten());
        Ok(Self {
            brighter,
            process,
            error: CorrectionError {
                runs: runs.len(),
                before_rms,
                before_max,
                left_rms,
                left_max,
            },
        })
    }

    /// What is known of the fit's error.
    pub fn error(&self) -> CorrectionError {
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

    /// Corrects an answer of the wave model; what the sub-pixels take more or less is transmitted less or more.
    pub(super) fn apply_to(
        &self,
        incidence: Incidence,
        mut answer: PlaneWaveAnswer,
    ) -> PlaneWaveAnswer {
        let before: f64 = answer.mean.absorbed.iter().sum();
        self.apply(incidence, &mut answer.mean.absorbed);
        answer.mean.transmitted += before - answer.mean.absorbed.iter().sum::<f64>();
        answer
    }
}

/// RMS and largest size.
fn size(of: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut sum, mut count, mut most) = (0.0, 0usize, 0f64);
    for x in of {
        sum += x * x;
        count += 1;
        most = most.max(x.abs());
    }
    ((sum / count.max(1) as f64).sqrt(), most)
}

#[cfg(test)]
mod tests;
