//! A table from a pixel model, the same way for all models.
//!
//! ```text
//! settings, symmetries ─▶ runs ─ model (or journal) ─▶ P at the simulated nodes ─ unfold ─ fill, cubic ─▶ AngularResponse
//! ```
//! A run is one transverse wavevector k∥ at one wavelength or, of a pulsed model, at all of them: `(u, v) = k∥ λ / 2π`. So a pulsed model is run on the k∥ grid of the shortest wavelength, on which a longer one has
//! coarser nodes that reach further out; each wavelength is resampled from its own nodes to the table's (u, v).

mod plan;
mod report;

use std::path::Path;

use serde::Serialize;

pub(super) use self::plan::{Plan, Run, Simulated};
pub use self::report::{BuildReport, BuiltTable};
use super::journal::{Answer, Journal};
use super::plane_wave;
use super::symmetry::unfold;
use super::{
    AngularResponse, CorrectionError, LitPixel, MovingFrame, PixelModel, PlaneWaveAnswer,
    ResponseAxes, ResponseError, ResponseMeta, TableSettings,
};
use crate::em::PixelStack;
use crate::em::fdtd::FdtdRun;
use crate::shard::Shard;

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

impl Plan {
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
