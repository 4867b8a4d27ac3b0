//! A table from a pixel model, the same way for all models.
//!
//! ```text
//! settings, symmetries ─▶ runs ─ model (or journal) ─▶ P at the simulated nodes ─ unfold ─ fill, cubic ─▶ AngularResponse
//! ```
//! A run is one transverse wavevector k∥ at one wavelength or, of a pulsed model, at all of them: `(u, v) = k∥ λ / 2π`. So a pulsed model is run on the k∥ grid of the shortest wavelength, on which a longer one has
//! coarser nodes that reach further out; each wavelength is resampled from its own nodes to the table's (u, v).

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::journal::{Answer, Journal, RunId};
use super::plane_wave;
use super::resample::{Grid, Place, shares};
use super::symmetry::{Node, Symmetry, canonical_nodes, symmetries, unfold};
use super::{
    AngularResponse, CorrectionError, LitPixel, MovingFrame, PixelModel, PlaneWaveAnswer,
    ResponseAxes, ResponseError, ResponseMeta, TableSettings,
};
use crate::em::PixelStack;
use crate::em::fdtd::FdtdRun;
use crate::sensor::Subpixels;
use crate::shard::Shard;

/// Directions are simulated up to this sin θ (70°); near grazing no model is to be trusted.
const LARGEST_SINE: f64 = 0.94;
/// What a simulated P may be below 0, or a sum of P above 1, and still be called rounding.
const SHARE_TOLERANCE: f64 = 1e-3;

/// How a table came about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuildReport {
    /// Runs of the model that the table needs.
    pub runs: usize,
    /// Of these, runs that an earlier, interrupted build had done.
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
    pub(super) fn of(runs: usize, reused: usize) -> Self {
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

    /// Takes the answer to light from (u, v) into account.
    pub(super) fn note(&mut self, answer: &Answer, [u, v]: [f64; 2]) {
        self.residual = self.residual.max(answer.residual);
        if let Some(first) = answer.warnings.first() {
            self.warned += 1;
            self.warning
                .get_or_insert_with(|| format!("(u, v) = ({u:.3}, {v:.3}): {first}"));
        }
        if answer.imbalance.abs() > self.imbalance.abs() {
            self.imbalance = answer.imbalance;
        }
        for p in &answer.absorbed {
            self.note_shares(p);
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

/// Simulates the table of a pixel, on all threads. `journal` is a file that keeps the runs done: a build that was stopped goes on with
/// them, and the file is removed at the end. `progress(done, total)` counts runs; it may be called from any thread.
pub fn build_table(
    stack: &PixelStack,
    settings: &TableSettings,
    journal: Option<&Path>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BuiltTable, ResponseError> {
    settings.check()?;
    stack.check()?;
    let journal = journal.map(|path| Journal::open(path, &settings.key(stack)));
    let (journal, no_journal) = match journal.transpose() {
        Ok(journal) => (journal, None),
        Err(e) => (None, Some(e.to_string())),
    };
    let mut built = build_with(stack, settings, journal.as_ref(), progress)?;
    built.report.journal_trouble = no_journal.or(journal.and_then(Journal::remove));
    Ok(built)
}

/// As [`build_table`], with a journal that is open and stays.
pub(super) fn build_with(
    stack: &PixelStack,
    settings: &TableSettings,
    journal: Option<&Journal>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BuiltTable, ResponseError> {
    settings.check()?;
    stack.check()?;
    let frame = moving_frame(stack, settings)?;
    let plan = Plan::new(stack, settings, settings.model.is_pulsed());
    let own = |absorbed: &[f64]| stack.own_share(absorbed);
    let (simulated, corrections) = simulated(&plan, stack, settings, &own, journal, progress)?;
    let mut built = plan.table(stack, settings, frame, simulated)?;
    built.table = built.table.with_corrections(corrections);
    Ok(built)
}

/// Simulates the runs of one part of a table into `journal`: how many they are, and how many of them it held.
pub(super) fn build_part(
    stack: &PixelStack,
    settings: &TableSettings,
    journal: &Journal,
    shard: Shard,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(usize, usize), ResponseError> {
    let mut plan = Plan::new(stack, settings, settings.model.is_pulsed());
    let mut place = 0..;
    plan.runs
        .retain(|_| place.next().is_some_and(|unit| shard.owns(unit)));
    let own = |absorbed: &[f64]| stack.own_share(absorbed);
    let report = simulated(&plan, stack, settings, &own, Some(journal), progress)?
        .0
        .report;
    Ok((report.runs, report.reused))
}

/// What of the powers of a period's photodiodes a table keeps.
pub(super) type Kept<'a> = dyn Fn(&[f64]) -> Vec<f64> + Sync + 'a;

/// Asks the pixel model for the runs of a plan; also the errors of the corrected level.
pub(super) fn simulated(
    plan: &Plan,
    stack: &PixelStack,
    settings: &TableSettings,
    own: &Kept,
    journal: Option<&Journal>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Simulated, Vec<CorrectionError>), ResponseError> {
    let folder = journal.and_then(|j| j.path().parent());
    let wavelengths = settings.wavelengths_nm.iter();
    let lit = wavelengths
        .map(|&nm| LitPixel::with_exact_runs_in(folder, stack, &settings.model, nm))
        .collect::<Result<Vec<_>, _>>()?;
    let simulated = plan.simulate(journal, progress, &|run| {
        let cosines = run.cosines(run.wavelengths.start, &plan.step);
        if let PixelModel::Fdtd(fdtd) = &settings.model {
            let nm = &settings.wavelengths_nm[run.wavelengths.clone()];
            let pulse = plane_wave::pulse(stack, nm, cosines, fdtd, &|_| ())?;
            return Ok(pulsed_answer(own, &pulse));
        }
        let mut light = lit[run.wavelengths.start].light_period(cosines[0], cosines[1], &|_| ())?;
        light.mean.absorbed = own(&light.mean.absorbed);
        Ok(lit_answer(light))
    })?;
    let corrections = lit.iter().filter_map(|l| Some(l.correction()?.error()));
    Ok((simulated, corrections.collect()))
}

/// What a table keeps of a pulse at several wavelengths.
pub(super) fn pulsed_answer(own: &Kept, run: &FdtdRun) -> Answer {
    let means = run.answers.iter().map(plane_wave::mean);
    Answer {
        absorbed: means.map(|m| own(&m.absorbed)).collect(),
        residual: run.residual,
        imbalance: plane_wave::imbalance(run),
        warnings: run.warnings(),
    }
}

/// What a table keeps of a plane wave.
pub(super) fn lit_answer(light: PlaneWaveAnswer) -> Answer {
    Answer {
        absorbed: vec![light.mean.absorbed],
        residual: light.residual,
        imbalance: light.imbalance,
        warnings: light.warnings,
    }
}

/// How a lens shift moves the response; the geometric model has its own frame.
pub(super) fn moving_frame(
    stack: &PixelStack,
    settings: &TableSettings,
) -> Result<MovingFrame, ResponseError> {
    match settings.model {
        PixelModel::Geometric { focal_length_um } => MovingFrame::new(1.0, focal_length_um),
        _ => MovingFrame::of(stack, settings.wavelengths_nm[0]),
    }
}

/// One call of a pixel model.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub node: Node,
    /// Which of the table's wavelengths it answers for.
    pub wavelengths: Range<usize>,
}

impl Run {
    fn id(&self) -> RunId {
        (self.wavelengths.start, self.node, 0)
    }

    /// (u, v) at a wavelength, given the simulated step of each wavelength.
    pub fn cosines(&self, wavelength: usize, step: &[f64]) -> [f64; 2] {
        let s = step[wavelength];
        [self.node.0 as f64 * s, self.node.1 as f64 * s]
    }
}

/// What has to be simulated for a table.
pub(super) struct Plan {
    pub runs: Vec<Run>,
    /// Simulated step of u and v per wavelength.
    pub step: Vec<f64>,
    steps: i64,
    pub symmetries: Vec<Symmetry>,
    pub subpixels: Subpixels,
    /// Sub-pixels.
    pub count: usize,
}

/// What was simulated.
pub(super) struct Simulated {
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

    /// Asks the model, or the journal, for every run.
    fn simulate(
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
        let one = |(run, known): (&Run, Option<Answer>)| {
            if let Some(answer) = known {
                return Ok(answer);
            }
            let answer = model(run)?;
            if !self.fits(run, &answer) {
                return Err(ResponseError::value(
                    "P (from the pixel model)",
                    format!(
                        "{answer:?} at (u, v) = {:?}",
                        run.cosines(run.wavelengths.start, &self.step)
                    ),
                    "a finite number a wavelength and sub-pixel",
                ));
            }
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

    /// The table of what was simulated.
    pub fn table(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
        frame: MovingFrame,
        simulated: Simulated,
    ) -> Result<BuiltTable, ResponseError> {
        let Simulated { nodes, mut report } = simulated;
        let refine = settings.refine as i64;
        let mut values = Vec::new();
        for (nodes, &step) in nodes.iter().zip(&self.step) {
            let all = unfold(nodes, self.steps, &self.symmetries, stack.subpixels);
            let (p, cut) = self.sampled(&all, step, refine);
            report.most_cut = report.most_cut.max(cut);
            values.extend(p);
        }
        let axis = self.axis(settings);
        let axes = ResponseAxes {
            wavelengths_nm: settings.wavelengths_nm.clone(),
            shifts_um: vec![[0.0, 0.0]],
            u: axis.clone(),
            v: axis,
        };
        let json =
            |e: serde_json::Error| ResponseError::value("pixel", e.to_string(), "finite numbers");
        let meta = ResponseMeta {
            model: settings.model.version().to_owned(),
            settings: serde_json::to_value(settings).map_err(json)?,
            pixel: serde_json::to_value(stack).map_err(json)?,
            pitch_um: stack.pitch_um,
            subpixels: stack.subpixels,
            frame,
            key: settings.key(stack),
            shift_grid: None,
            chief_ray_shifts: None,
            corrections: Vec::new(),
        };
        let table = AngularResponse::new(axes, meta, values)?;
        Ok(BuiltTable { table, report })
    }
}

#[cfg(test)]
mod tests;
