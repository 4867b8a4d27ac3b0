//! The 5D table (shift x, shift y, u, v, sub-pixel) times wavelength.
//!
//! ```text
//! directions (octant) × shifts (period) ─ model (or journal) ─▶ symmetry ─▶ shifts (octant) × directions (all) ─▶ AngularResponse
//! ```
//! A symmetry g of the pixel with a centred lens gives `P_i(g d, g s) = P_g⁻¹i(d, s)` for a direction d under a lens shift s. So only one
//! direction of every eight is simulated, under all shifts, because a model may share its work among those; on the pixel's axes of
//! symmetry only half of the shifts.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::build::{Plan, Run, keeping_runs, lit_answer, meta, pulsed_answer};
use super::journal::{Answer, Journal};
use super::plane_wave::pulse;
use super::shift_grid::ShiftNode;
use super::shifted_pixel::{ShiftedPixel, shifted};
use super::symmetry::Node;
use super::{
    AngularResponse, BuildReport, BuiltTable, ChiefRayShifts, CorrectionError, PixelModel,
    ResponseAxes, ResponseError, ResponseMeta, ShiftGrid, TableSettings,
};
use crate::em::PixelStack;
use crate::em::rcwa::RcwaSettings;
use crate::shard::Shard;

/// What to tabulate of a pixel with shifted lenses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftedSettings {
    /// Model, wavelengths and directions.
    pub table: TableSettings,
    /// Shifts simulated a pitch, along x and along y.
    pub per_pitch: usize,
    /// F-number of the cone that the sub-pixels shall share ([`ChiefRayShifts`]).
    pub cone_f_number: f64,
}

impl ShiftedSettings {
    /// [`TableSettings::wave_standard_for`] without the light that comes back from the trenches, so that all shifts share one solution
    /// of the lens; its solver's residual is as small as the interpolation's error.
    pub fn wave_for(stack: &PixelStack) -> Self {
        let mut table = TableSettings::wave_standard_for(stack);
        table.steps = table.steps.min(24);
        table.refine = 3;
        if let PixelModel::Wave(settings) = &mut table.model {
            settings.bounces = 0;
            settings.tolerance = 5e-3;
        }
        Self {
            table,
            per_pitch: 16,
            cone_f_number: 2.0,
        }
    }

    /// Fourier modes, the default, in the directions of [`Self::wave_for`]. Half an hour for a small pixel, a day for a large one.
    pub fn rcwa_for(stack: &PixelStack) -> Self {
        let mut all = Self::wave_for(stack);
        all.table.model = PixelModel::Rcwa(RcwaSettings::standard());
        all
    }

    /// Runs of the model that a table needs, a run being one direction under one shift.
    pub fn runs(&self, stack: &PixelStack) -> Result<usize, ResponseError> {
        self.check()?;
        let plan = ShiftedPlan::new(stack, self, Shard::WHOLE)?;
        Ok(plan.shifts.iter().map(Vec::len).sum())
    }

    /// Ranges in which tables are made.
    pub fn check(&self) -> Result<(), ResponseError> {
        self.table.check()?;
        ShiftGrid::new(1.0, self.per_pitch)?;
        if (0.8..=32.0).contains(&self.cone_f_number) {
            return Ok(());
        }
        Err(ResponseError::value(
            "cone_f_number",
            self.cone_f_number,
            "0.8 to 32",
        ))
    }

    /// Hash of model, pixel and settings: the same key means the same table.
    pub fn key(&self, stack: &PixelStack) -> String {
        let mut hash = blake3::Hasher::new();
        hash.update(self.table.key(stack).as_bytes());
        hash.update(format!("shifted-1 {} {:?}", self.per_pitch, self.cone_f_number).as_bytes());
        hash.finalize().to_hex().to_string()
    }
}

/// The directions and the shifts that have to be simulated for each.
struct ShiftedPlan {
    plan: Plan,
    grid: ShiftGrid,
    /// Per run, the shifts that stand for all.
    shifts: Vec<Vec<ShiftNode>>,
}

/// P per wavelength, direction simulated, shift (all of the period) and sub-pixel.
type ByDirection = Vec<BTreeMap<Node, Vec<f64>>>;
/// The answers of a run under each of these lens shifts in µm.
type ShiftsOfRun<'a> = dyn Fn(&Run, &[[f64; 2]]) -> Result<Vec<Answer>, ResponseError> + Sync + 'a;

/// Simulates the table of a pixel under all shifts of its lens, on all threads; journal and progress as of [`super::build_table`], a run
/// being one direction under one shift.
pub fn build_shifted_table(
    stack: &PixelStack,
    settings: &ShiftedSettings,
    journal: Option<&Path>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BuiltTable, ResponseError> {
    settings.check()?;
    stack.check()?;
    keeping_runs(journal, &settings.key(stack), |journal| {
        build_shifted_with(stack, settings, journal, progress)
    })
}

/// As [`build_shifted_table`], with a journal that is open and stays.
pub(super) fn build_shifted_with(
    stack: &PixelStack,
    settings: &ShiftedSettings,
    journal: Option<&Journal>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<BuiltTable, ResponseError> {
    let plan = ShiftedPlan::new(stack, settings, Shard::WHOLE)?;
    let (values, mut report, corrections) = simulated(&plan, stack, settings, journal, progress)?;
    let table = plan
        .table(stack, settings, &values, &mut report)?
        .with_corrections(corrections);
    Ok(BuiltTable { table, report })
}

/// Simulates the runs of one part of a table into `journal`: how many they are, and how many of them it held.
pub(super) fn build_shifted_part(
    stack: &PixelStack,
    settings: &ShiftedSettings,
    journal: &Journal,
    shard: Shard,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(usize, usize), ResponseError> {
    let plan = ShiftedPlan::new(stack, settings, shard)?;
    let report = simulated(&plan, stack, settings, Some(journal), progress)?.1;
    Ok((report.runs, report.reused))
}

/// Asks the pixel model for the runs of a plan; also the errors of the corrected level.
fn simulated(
    plan: &ShiftedPlan,
    stack: &PixelStack,
    settings: &ShiftedSettings,
    journal: Option<&Journal>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(ByDirection, BuildReport, Vec<CorrectionError>), ResponseError> {
    let table = &settings.table;
    let folder = journal.and_then(|j| j.path().parent());
    let wavelengths = table.wavelengths_nm.iter();
    let pixels = wavelengths
        .map(|&nm| ShiftedPixel::with_exact_runs_in(folder, stack, &table.model, nm))
        .collect::<Result<Vec<_>, _>>()?;
    let (values, report) = plan.simulate(journal, progress, &|run, shifts| {
        let cosines = run.cosines(run.wavelengths.start, &plan.plan.step);
        if let PixelModel::Fdtd(fdtd) = &table.model {
            let nm = &table.wavelengths_nm[run.wavelengths.clone()];
            let one = |&shift| {
                let run = pulse(&shifted(stack, shift), nm, cosines, fdtd, &|_| ())?;
                Ok(pulsed_answer(&|p: &[f64]| stack.own_share(p), &run))
            };
            return shifts.iter().map(one).collect();
        }
        let [u, v] = cosines;
        let light = pixels[run.wavelengths.start].light(u, v, shifts)?;
        Ok(light.into_iter().map(lit_answer).collect())
    })?;
    let corrections = pixels.iter().filter_map(|p| Some(p.correction()?.error()));
    Ok((values, report, corrections.collect()))
}

impl ShiftedPlan {
    /// Of a part of the directions.
    fn new(
        stack: &PixelStack,
        settings: &ShiftedSettings,
        shard: Shard,
    ) -> Result<Self, ResponseError> {
        if stack.lens.shift_um != [0.0, 0.0] {
            return Err(ResponseError::value(
                "lens.shift_um",
                format!("{:?}", stack.lens.shift_um),
                "[0, 0] for a table of all shifts",
            ));
        }
        let table = &settings.table;
        let mut plan = Plan::new(stack, table, table.model.is_pulsed());
        plan.keep_part(shard);
        let grid = ShiftGrid::new(stack.pitch_um, settings.per_pitch)?;
        let shifts = plan.runs.iter().map(|run| {
            let fixed = plan.symmetries.iter().copied();
            let fixed: Vec<_> = fixed.filter(|s| s.node(run.node) == run.node).collect();
            let first = |node: &ShiftNode| {
                let images = fixed.iter().map(|&s| grid.index(grid.sent(s, *node)));
                images.min() == Some(grid.index(*node))
            };
            grid.nodes().filter(first).collect()
        });
        Ok(Self {
            shifts: shifts.collect(),
            plan,
            grid,
        })
    }

    fn simulate(
        &self,
        journal: Option<&Journal>,
        progress: &(dyn Fn(usize, usize) + Sync),
        model: &ShiftsOfRun<'_>,
    ) -> Result<(ByDirection, BuildReport), ResponseError> {
        let total = self.shifts.iter().map(Vec::len).sum();
        let (done, reused) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let one = |(run, shifts): (&Run, &Vec<ShiftNode>)| -> Result<Vec<Answer>, ResponseError> {
            let id = |node: ShiftNode| (run.wavelengths.start, run.node, self.grid.index(node));
            let known = |node: &ShiftNode| {
                let answer = journal?.answer(id(*node))?;
                self.plan.fits(run, answer).then(|| answer.clone())
            };
            // All or none: what a model finds of one shift may hang, in the last bit, on those asked for with it.
            let answers: Option<Vec<Answer>> = shifts.iter().map(known).collect();
            let answers = match answers {
                Some(answers) => {
                    reused.fetch_add(answers.len(), Ordering::Relaxed);
                    answers
                }
                None => {
                    let places: Vec<[f64; 2]> =
                        shifts.iter().map(|&s| self.grid.shift_um(s)).collect();
                    let found = model(run, &places)?.into_iter();
                    let found = found.map(|answer| self.plan.checked(run, answer));
                    let found = found.collect::<Result<Vec<_>, _>>()?;
                    if let Some(journal) = journal {
                        for (&shift, answer) in shifts.iter().zip(&found) {
                            journal.keep(id(shift), answer);
                        }
                    }
                    found
                }
            };
            let so_far = done.fetch_add(shifts.len(), Ordering::Relaxed) + shifts.len();
            progress(so_far, total);
            Ok(answers)
        };
        let runs = self.plan.runs.par_iter().zip(&self.shifts);
        let answers: Vec<Vec<Answer>> = runs.map(one).collect::<Result<_, _>>()?;
        let mut report = BuildReport::of(total, reused.into_inner());
        let mut values = vec![BTreeMap::new(); self.plan.step.len()];
        for ((run, shifts), answers) in self.plan.runs.iter().zip(&self.shifts).zip(&answers) {
            for answer in answers {
                report.note(answer, run.cosines(run.wavelengths.start, &self.plan.step));
            }
            for (k, w) in run.wavelengths.clone().enumerate() {
                values[w].insert(run.node, self.all_shifts(run.node, shifts, answers, k));
            }
        }
        Ok((values, report))
    }

    /// P of all shifts of the period, `[shift][sub-pixel]`, from those simulated at a direction that some symmetries leave alone.
    fn all_shifts(
        &self,
        node: Node,
        shifts: &[ShiftNode],
        answers: &[Answer],
        k: usize,
    ) -> Vec<f64> {
        let count = self.plan.count;
        let s = self.plan.subpixels;
        let mut all = vec![0.0; self.grid.per_pitch * self.grid.per_pitch * count];
        let symmetries = self.plan.symmetries.iter();
        let fixed: Vec<_> = symmetries.filter(|g| g.node(node) == node).collect();
        for (&shift, answer) in shifts.iter().zip(answers) {
            for g in &fixed {
                let at = self.grid.index(self.grid.sent(**g, shift)) * count;
                for (i, p) in answer.absorbed[k].iter().enumerate() {
                    all[at + g.sub_pixel(s, i)] = *p;
                }
            }
        }
        all
    }

    /// The table of what was simulated: stored shifts, all directions.
    fn table(
        &self,
        stack: &PixelStack,
        settings: &ShiftedSettings,
        values: &ByDirection,
        report: &mut BuildReport,
    ) -> Result<AngularResponse, ResponseError> {
        let (count, s) = (self.plan.count, self.plan.subpixels);
        let stored = self.grid.stored(&self.plan.symmetries);
        let refine = settings.table.refine as i64;
        let mut table = Vec::new();
        for (simulated, &step) in values.iter().zip(&self.plan.step) {
            let plane = |&shift: &ShiftNode| {
                let mut all = BTreeMap::new();
                for node in self.plan.square() {
                    let mut images = self.plan.symmetries.iter();
                    let source = images.find_map(|g| simulated.get(&g.node(node)).map(|p| (p, g)));
                    if let Some((p, g)) = source {
                        let at = self.grid.index(self.grid.sent(*g, shift)) * count;
                        let own = (0..count).map(|i| p[at + g.sub_pixel(s, i)]);
                        all.insert(node, own.collect::<Vec<f64>>());
                    }
                }
                self.plan.sampled(&all, step, refine)
            };
            let planes: Vec<(Vec<f32>, f64)> = stored.par_iter().map(plane).collect();
            for (p, cut) in planes {
                report.most_cut = report.most_cut.max(cut);
                table.extend(p);
            }
        }
        let axis = self.plan.axis(&settings.table);
        let axes = ResponseAxes {
            wavelengths_nm: settings.table.wavelengths_nm.clone(),
            shifts_um: stored.iter().map(|&n| self.grid.shift_um(n)).collect(),
            u: axis.clone(),
            v: axis,
        };
        let meta = ResponseMeta {
            shift_grid: Some(self.grid),
            ..meta(stack, &settings.table, settings, settings.key(stack))?
        };
        let table = AngularResponse::new(axes, meta, table)?;
        let shifts = ChiefRayShifts::of_table(&table, settings.cone_f_number)?;
        Ok(table.with_chief_ray_shifts(shifts))
    }
}

#[cfg(test)]
mod tests;
