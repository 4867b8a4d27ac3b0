//! A table from a pixel model, the same way for all models.
//!
//! ```text
//! settings, symmetries ─▶ runs ─ model (or journal) ─▶ P at the simulated nodes ─ unfold ─ fill, cubic ─▶ AngularResponse
//! ```
//! A run is one transverse wavevector k∥ at one wavelength or, of a pulsed model, at all of them: `(u, v) = k∥ λ / 2π`. So a pulsed model is run on the k∥ grid of the shortest wavelength, on which a longer one has
//! coarser nodes that reach further out; each wavelength is resampled from its own nodes to the table's (u, v).

mod report;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

pub use self::report::{BuildReport, BuiltTable};
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
    keeping_runs(journal, &settings.key(stack), |journal| {
        build_with(stack, settings, journal, progress)
    })
}

/// A build whose runs are kept in a file while it lasts; that they cannot be is no harm to it.
pub(super) fn keeping_runs(
    journal: Option<&Path>,
    key: &str,
    build: impl FnOnce(Option<&Journal>) -> Result<BuiltTable, ResponseError>,
) -> Result<BuiltTable, ResponseError> {
    let journal = journal.map(|path| Journal::open(path, key)).transpose();
    let (journal, no_journal) = match journal {
        Ok(journal) => (journal, None),
        Err(e) => (None, Some(e.to_string())),
    };
    let mut built = build(journal.as_ref())?;
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
    let plan = Plan::new(stack, settings, settings.model.is_pulsed());
    let own = |absorbed: &[f64]| stack.own_share(absorbed);
    let (simulated, corrections) = simulated(&plan, stack, settings, &own, journal, progress)?;
    let mut built = plan.table(stack, settings, simulated)?;
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
    plan.keep_part(shard);
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

/// What a table says of itself; `all`: the settings as they are recorded.
pub(super) fn meta(
    stack: &PixelStack,
    settings: &TableSettings,
    all: &impl Serialize,
    key: String,
) -> Result<ResponseMeta, ResponseError> {
    let json =
        |e: serde_json::Error| ResponseError::value("pixel", e.to_string(), "finite numbers");
    Ok(ResponseMeta {
        model: settings.model.version().to_owned(),
        settings: serde_json::to_value(all).map_err(json)?,
        pixel: serde_json::to_value(stack).map_err(json)?,
        pitch_um: stack.pitch_um,
        subpixels: stack.subpixels,
        frame: moving_frame(stack, settings)?,
        key,
        shift_grid: None,
        chief_ray_shifts: None,
        corrections: Vec::new(),
    })
}

/// How a lens shift moves the response; the geometric model has its own frame.
fn moving_frame(
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

    /// Leaves only the runs of a part of the work.
    pub fn keep_part(&mut self, shard: Shard) {
        let mut place = 0..;
        self.runs
            .retain(|_| place.next().is_some_and(|unit| shard.owns(unit)));
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

    /// The table of what was simulated.
    pub fn table(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
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
        let meta = meta(stack, settings, settings, settings.key(stack))?;
        let table = AngularResponse::new(axes, meta, values)?;
        Ok(BuiltTable { table, report })
    }
}

#[cfg(test)]
mod tests;
