//! The runs of a pixel solver that a table needs.
//!
//! A run is one transverse wavevector k∥ under its lens shifts, at one wavelength or, of a pulsed model, at all of
//! them: `(u, v) = k∥ λ / 2π`. So a pulsed model is run on the k∥ grid of the shortest wavelength, on which a longer
//! one has coarser nodes that reach further out.
//!
//! A symmetry g of the pixel gives `P_i(g d, g s) = P_g⁻¹i(d, s)` for a direction d under a lens shift s. So only one
//! direction of every eight is simulated, under all shifts, because a solver may share its work among those; on the
//! pixel's axes of symmetry only half of the shifts.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::shift_axis::ShiftAxis;
use crate::em::PixelStack;
use crate::em::light::{Incidence, Light};
use crate::em::symmetry::{Node, Symmetry, canonical_nodes, symmetries};
use crate::journal::Journal;
use crate::progress::Progress;
use crate::response::{ResponseError, TableSettings};
use crate::shard::Shard;

/// Directions are simulated up to this sin θ (70°); near grazing no model is to be trusted.
pub(super) const LARGEST_SINE: f64 = 0.94;

/// A run by its first wavelength (its place in the table's list), its node, and its lens shift (its place on the axis
/// of shifts).
pub(in crate::response) type RunId = (usize, Node, usize);
/// Runs that are done: what was answered at each wavelength, of all photodiodes of the period.
pub(in crate::response) type RunJournal = Journal<RunId, Vec<Light>>;
/// Answers to a run, `[shift][wavelength]`.
pub(super) type Answers = Vec<Vec<Light>>;
/// What is asked of a pixel: its answers to a run under these plane waves.
pub(super) type Ask<'a> = dyn Fn(&Run, &[Incidence]) -> Result<Answers, ResponseError> + Sync + 'a;

/// One call of a solver.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub node: Node,
    /// Which of the table's wavelengths it answers for.
    pub wavelengths: Range<usize>,
    /// Places of its lens shifts.
    pub shifts: Vec<usize>,
}

impl Run {
    fn id(&self, shift: usize) -> RunId {
        (self.wavelengths.start, self.node, shift)
    }

    /// (u, v) at a wavelength, given the simulated step of each wavelength.
    pub fn cosines(&self, wavelength: usize, step: &[f64]) -> [f64; 2] {
        let s = step[wavelength];
        [self.node.0 as f64 * s, self.node.1 as f64 * s]
    }
}

/// What has to be simulated for a table.
pub(super) struct Runs {
    pub runs: Vec<Run>,
    /// Simulated step of u and v per wavelength.
    pub step: Vec<f64>,
    /// Steps from the normal to the table's end.
    pub steps: i64,
    pub symmetries: Vec<Symmetry>,
    pub shifts: ShiftAxis,
    /// Photodiodes of a period.
    photodiodes: usize,
}

/// What was simulated.
#[derive(Debug, PartialEq)]
pub(super) struct Simulated {
    /// By run.
    pub answers: Vec<Answers>,
    /// Plane waves that the journal held.
    pub reused: usize,
}

impl Runs {
    /// # Errors
    /// A lens that is shifted already, of a table of all shifts.
    pub fn new(
        stack: &PixelStack,
        settings: &TableSettings,
        pulsed: bool,
    ) -> Result<Self, ResponseError> {
        let symmetries = symmetries(stack);
        let shifts = ShiftAxis::new(stack, settings)?;
        let steps = settings.steps as i64;
        let finest = settings.cosine_max / settings.steps as f64;
        let w = &settings.wavelengths_nm;
        let step: Vec<f64> = w
            .iter()
            .map(|nm| if pulsed { finest * (nm / w[0]) } else { finest })
            .collect();
        let travels = |(a, b): Node, step: f64| (a as f64).hypot(b as f64) * step <= LARGEST_SINE;
        let mut runs = Vec::new();
        for (i, finest) in step
            .iter()
            .enumerate()
            .take(if pulsed { 1 } else { w.len() })
        {
            for node in canonical_nodes(steps, &symmetries) {
                if !travels(node, *finest) {
                    continue;
                }
                // The longer the wavelength, the larger its angle: a pulse answers for the first few.
                let last = match pulsed {
                    true => step.iter().take_while(|step| travels(node, **step)).count(),
                    false => i + 1,
                };
                runs.push(Run {
                    node,
                    wavelengths: i..last,
                    shifts: shifts.to_simulate(node, &symmetries),
                });
            }
        }
        Ok(Self {
            runs,
            step,
            steps,
            symmetries,
            shifts,
            photodiodes: stack.photodiodes(),
        })
    }

    /// Leaves only the runs of a part of the work.
    pub fn keep_part(&mut self, shard: Shard) {
        let mut place = 0..;
        self.runs
            .retain(|_| place.next().is_some_and(|unit| shard.owns(unit)));
    }

    /// Plane waves of all runs.
    pub fn count(&self) -> usize {
        self.runs.iter().map(|run| run.shifts.len()).sum()
    }

    /// Asks the solver, or the journal, for every run. `progress` hears of plane waves.
    ///
    /// # Errors
    /// A plane wave that the solver has no answer to.
    pub fn simulate(
        &self,
        journal: Option<&RunJournal>,
        progress: &dyn Progress,
        ask: &Ask<'_>,
    ) -> Result<Simulated, ResponseError> {
        let total = self.count();
        // All shifts or none: what a solver finds of one may hang, in the last bit, on those asked for with it.
        let known = |run: &Run| -> Option<Answers> {
            let outcome = |shift: &usize| {
                let lights = journal?.outcome(&run.id(*shift))?;
                self.fits(run, lights).then(|| lights.clone())
            };
            run.shifts.iter().map(outcome).collect()
        };
        let known: Vec<Option<Answers>> = self.runs.iter().map(known).collect();
        let reused = known.iter().flatten().map(Vec::len).sum();
        progress.incidences(reused, total);
        let done = AtomicUsize::new(reused);
        let one = |(run, known): (&Run, Option<Answers>)| -> Result<Answers, ResponseError> {
            if let Some(answers) = known {
                return Ok(answers);
            }
            let answers = self.checked(run, ask(run, &self.waves(run))?)?;
            if let Some(journal) = journal {
                for (&shift, lights) in run.shifts.iter().zip(&answers) {
                    journal.keep(run.id(shift), lights);
                }
            }
            let count = run.shifts.len();
            progress.incidences(done.fetch_add(count, Ordering::Relaxed) + count, total);
            Ok(answers)
        };
        let answers = self.runs.par_iter().zip(known).map(one);
        Ok(Simulated {
            answers: answers.collect::<Result<_, _>>()?,
            reused,
        })
    }

    /// The same of answers that are known, in the order of the runs: one per run. `None` of others.
    pub fn answered(&self, lights: Vec<Light>) -> Option<Simulated> {
        let fits = |(run, light): (&Run, &Light)| {
            run.shifts.len() == 1 && self.fits(run, std::slice::from_ref(light))
        };
        if lights.len() != self.runs.len() || !self.runs.iter().zip(&lights).all(fits) {
            return None;
        }
        let reused = lights.len();
        let answers = lights.into_iter().map(|light| vec![vec![light]]).collect();
        Some(Simulated { answers, reused })
    }

    fn waves(&self, run: &Run) -> Vec<Incidence> {
        let direction = run.cosines(run.wavelengths.start, &self.step);
        let wave = |&shift: &usize| Incidence {
            direction,
            shift_um: self.shifts.shift_um(shift),
        };
        run.shifts.iter().map(wave).collect()
    }

    /// Whether lights are an answer to the run: its numbers, and as many of them.
    fn fits(&self, run: &Run, lights: &[Light]) -> bool {
        let whole = |light: &Light| {
            let p = &light.mean.absorbed;
            p.len() == self.photodiodes
                && p.iter().all(|p| p.is_finite())
                && light.residual.is_finite()
                && light.imbalance.is_finite()
        };
        lights.len() == run.wavelengths.len() && lights.iter().all(whole)
    }

    /// Answers of the solver, if they are such to the run.
    fn checked(&self, run: &Run, answers: Answers) -> Result<Answers, ResponseError> {
        if answers.len() == run.shifts.len() && answers.iter().all(|a| self.fits(run, a)) {
            let means = |lights: Vec<Light>| lights.into_iter().map(Light::unpolarized).collect();
            return Ok(answers.into_iter().map(means).collect());
        }
        let [u, v] = run.cosines(run.wavelengths.start, &self.step);
        Err(ResponseError::value(
            "P (from the pixel model)",
            format!("not that at (u, v) = ({u}, {v})"),
            "a finite number per wavelength and photodiode",
        ))
    }

    /// The table's direction cosines along u and along v.
    pub fn axis(&self, settings: &TableSettings) -> Vec<f64> {
        let half = self.steps * settings.refine as i64;
        (-half..=half)
            .map(|i| settings.cosine_max * i as f64 / half as f64)
            .collect()
    }
}
