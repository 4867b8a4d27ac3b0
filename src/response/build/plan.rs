//! What a table needs of its pixel model, and the runs that get it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::BuildReport;
use crate::em::PixelStack;
use crate::response::journal::{Answer, Journal, RunId};
use crate::response::resample::{Grid, Place, shares};
use crate::response::symmetry::{Node, Symmetry, canonical_nodes, symmetries};
use crate::response::{ResponseError, TableSettings};
use crate::sensor::Subpixels;
use crate::shard::Shard;

/// Directions are simulated up to this sin θ (70°); near grazing no model is to be trusted.
const LARGEST_SINE: f64 = 0.94;

/// One call of a pixel model.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::response) struct Run {
    pub node: Node,
    /// Which of the table's wavelengths it answers for.
    pub wavelengths: Range<usize>,
}

impl Run {
    pub(super) fn id(&self) -> RunId {
        (self.wavelengths.start, self.node, 0)
    }

    /// (u, v) at a wavelength, given the simulated step of each wavelength.
    pub fn cosines(&self, wavelength: usize, step: &[f64]) -> [f64; 2] {
        let s = step[wavelength];
        [self.node.0 as f64 * s, self.node.1 as f64 * s]
    }
}

/// What has to be simulated for a table.
pub(in crate::response) struct Plan {
    pub runs: Vec<Run>,
    /// Simulated step of u and v per wavelength.
    pub step: Vec<f64>,
    pub(super) steps: i64,
    pub symmetries: Vec<Symmetry>,
    pub subpixels: Subpixels,
    /// Sub-pixels.
    pub count: usize,
}

/// What was simulated.
pub(in crate::response) struct Simulated {
    /// Per wavelength.
    pub nodes: Vec<BTreeMap<Node, Vec<f64>>>,
    pub report: BuildReport,
}

impl Plan {
    pub fn new(stack: &PixelStack, settings: &TableSettings, pulsed: bool) -> Self {
        let symmetries = symmetries(stack);
        let steps = settings.steps as i64;
        let finest = settings.cosine_max / settings.steps as f64;
        let w = &settings.wavelengths_nm;
        let step: Vec<f64> = w
            .iter()
            .map(|nm| if pulsed { finest * (nm / w[0]) } else { finest })
            .collect();
        let sine = |(a, b): Node, step: f64| (a as f64).hypot(b as f64) * step;
        let mut runs = Vec::new();
        for (i, step) in step
            .iter()
            .enumerate()
            .take(if pulsed { 1 } else { w.len() })
        {
            for node in canonical_nodes(steps, &symmetries) {
                if sine(node, *step) <= LARGEST_SINE {
                    runs.push(Run {
                        node,
                        wavelengths: i..i + 1,
                    });
                }
            }
        }
        if pulsed {
            // The longer the wavelength, the larger its angle: a run answers for the first few.
            for run in &mut runs {
                let travels = |s: &&f64| sine(run.node, **s) <= LARGEST_SINE;
                run.wavelengths = 0..step.iter().take_while(travels).count();
            }
        }
        Self {
            runs,
            step,
            steps,
            symmetries,
            subpixels: stack.subpixels,
            count: stack.subpixels.count(),
        }
    }

    /// Leaves only the runs of a part of the work.
    pub fn keep_part(&mut self, shard: Shard) {
        let mut place = 0..;
        self.runs
            .retain(|_| place.next().is_some_and(|unit| shard.owns(unit)));
    }

    /// Asks the model, or the journal, for every run.
    pub(super) fn simulate(
        &self,
        journal: Option<&Journal>,
        progress: &(dyn Fn(usize, usize) + Sync),
        model: &(dyn Fn(&Run) -> Result<Answer, ResponseError> + Sync),
    ) -> Result<Simulated, ResponseError> {
        let total = self.runs.len();
        let earlier = |run: &Run| {
            let answer = journal?.answer(run.id())?;
            self.fits(run, answer).then(|| answer.clone())
        };
        let known: Vec<Option<Answer>> = self.runs.iter().map(earlier).collect();
        let reused = known.iter().flatten().count();
        progress(reused, total);
        let done = AtomicUsize::new(reused);
        let one = |(run, known): (&Run, Option<Answer>)| -> Result<Answer, ResponseError> {
            if let Some(answer) = known {
                return Ok(answer);
            }
            let answer = self.checked(run, model(run)?)?;
            if let Some(journal) = journal {
                journal.keep(run.id(), &answer);
            }
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            Ok(answer)
        };
        let answers: Vec<Answer> = self
            .runs
            .par_iter()
            .zip(known)
            .map(one)
            .collect::<Result<_, _>>()?;
        Ok(self.collected(answers, reused))
    }

    /// Whether an answer is one to the run: its numbers, and as many of them.
    pub fn fits(&self, run: &Run, answer: &Answer) -> bool {
        let whole = |p: &Vec<f64>| p.len() == self.count && p.iter().all(|p| p.is_finite());
        answer.absorbed.len() == run.wavelengths.len()
            && answer.absorbed.iter().all(whole)
            && answer.residual.is_finite()
            && answer.imbalance.is_finite()
    }

    /// An answer of the pixel model, if it is one to the run.
    pub fn checked(&self, run: &Run, answer: Answer) -> Result<Answer, ResponseError> {
        if self.fits(run, &answer) {
            return Ok(answer);
        }
        let cosines = run.cosines(run.wavelengths.start, &self.step);
        Err(ResponseError::value(
            "P (from the pixel model)",
            format!("{answer:?} at (u, v) = {cosines:?}"),
            "a finite number a wavelength and sub-pixel",
        ))
    }

    fn collected(&self, answers: Vec<Answer>, reused: usize) -> Simulated {
        let mut report = BuildReport::of(answers.len(), reused);
        let mut nodes = vec![BTreeMap::new(); self.step.len()];
        for (run, answer) in self.runs.iter().zip(answers) {
            report.note(&answer, run.cosines(run.wavelengths.start, &self.step));
            for (w, p) in run.wavelengths.clone().zip(answer.absorbed) {
                nodes[w].insert(run.node, p);
            }
        }
        Simulated { nodes, report }
    }

    /// The table's direction cosines along u and along v.
    pub fn axis(&self, settings: &TableSettings) -> Vec<f64> {
        let half = self.steps * settings.refine as i64;
        (-half..=half)
            .map(|i| settings.cosine_max * i as f64 / half as f64)
            .collect()
    }

    /// The table's values `[v][u][sub-pixel]` of all simulated nodes, `step` apart, and the most that they were cut.
    pub fn sampled(
        &self,
        all: &BTreeMap<Node, Vec<f64>>,
        step: f64,
        refine: i64,
    ) -> (Vec<f32>, f64) {
        let grid = Grid::filled(all, self.steps, LARGEST_SINE / step, self.count);
        let places = Place::axis(self.steps * refine, refine, self.step[0] / step, self.steps);
        shares(grid.at(&places), self.count)
    }

    /// Nodes of the square grid of directions.
    pub fn square(&self) -> impl Iterator<Item = Node> + use<> {
        let steps = self.steps;
        (-steps..=steps).flat_map(move |a| (-steps..=steps).map(move |b| (a, b)))
    }
}
