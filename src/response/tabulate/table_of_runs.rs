//! The table of what was simulated: by symmetry to all directions and stored lens shifts, then resampled to the table's
//! (u, v).

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::report::{BuildReport, BuiltTable};
use super::resample::{Grid, Place, shares};
use super::runs::{LARGEST_SINE, Runs, Simulated};
use crate::em::PixelStack;
use crate::em::light::CorrectionFit;
use crate::em::symmetry::Node;
use crate::response::{
    AngularResponse, ChiefRayShifts, Provenance, ResponseAxes, ResponseError, ResponseMeta,
    TableSettings,
};
use crate::sensor::{Charge, MovingFrame};

/// What a table tells of its pixel beside P.
pub(super) struct AboutPixel {
    pub frame: MovingFrame,
    pub corrections: Vec<CorrectionFit>,
    /// Lens shifts that chief rays need; `None`: those of the table's own colour.
    pub layout: Option<ChiefRayShifts>,
}

/// P of all lens shifts at the simulated directions of a wavelength, `[shift][sub-pixel]`.
type ByDirection = BTreeMap<Node, Vec<f64>>;

impl Runs {
    /// The table of the pixel's colour.
    ///
    /// # Errors
    /// P that cannot be, or a chief ray that no lens shift is found for.
    pub fn table(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
        about: &AboutPixel,
        simulated: &Simulated,
    ) -> Result<BuiltTable, ResponseError> {
        let mut report = BuildReport::new(self.count(), simulated.reused);
        let by_wavelength = self.by_direction(stack, simulated, &mut report);
        let stored = self.shifts.stored(&self.symmetries);
        let mut table = Vec::new();
        for (by_direction, &step) in by_wavelength.iter().zip(&self.step) {
            let plane = |&(shift, _): &(usize, [f64; 2])| {
                let all = self.all_directions(stack, by_direction, shift);
                self.sampled(&all, step, settings.refine as i64, stack.subpixels.count())
            };
            let planes: Vec<(Vec<f32>, f64)> = stored.par_iter().map(plane).collect();
            for (p, cut) in planes {
                report.most_cut = report.most_cut.max(cut);
                table.extend(p);
            }
        }
        let axis = self.axis(settings);
        let axes = ResponseAxes {
            wavelengths_nm: settings.wavelengths_nm.clone(),
            shifts_um: stored.into_iter().map(|(_, shift_um)| shift_um).collect(),
            u: axis.clone(),
            v: axis,
        };
        let meta = ResponseMeta {
            model: settings.model.version().to_owned(),
            settings: Provenance::Simulated(settings.clone()),
            pixel: stack.clone(),
            pitch_um: stack.pitch_um,
            subpixels: stack.subpixels,
            frame: about.frame,
            key: settings.key(stack)?,
            shift_grid: self.shifts.grid(),
            chief_ray_shifts: None,
            corrections: about.corrections.clone(),
            charge: Charge::default(),
        };
        let mut table = AngularResponse::new(axes, meta, table)?;
        if let Some(shifts) = &settings.shifts {
            let chief_ray_shifts = match &about.layout {
                Some(layout) => layout.clone(),
                None => ChiefRayShifts::from_table(&table, shifts.cone_f_number)?,
            };
            table = table.with_chief_ray_shifts(chief_ray_shifts);
        }
        Ok(BuiltTable { table, report })
    }

    /// P of the pixel's colour under all lens shifts, by wavelength and simulated direction; takes all answers into the
    /// report.
    fn by_direction(
        &self,
        stack: &PixelStack,
        simulated: &Simulated,
        report: &mut BuildReport,
    ) -> Vec<ByDirection> {
        let s = stack.subpixels;
        let colour = stack.mosaic.as_ref().map(|m| m.colour).unwrap_or_default();
        let mut values = vec![BTreeMap::new(); self.step.len()];
        for (run, answers) in self.runs.iter().zip(&simulated.answers) {
            let fixing = self.shifts.fixing(run.node, &self.symmetries);
            let cosines = run.cosines(run.wavelengths.start, &self.step);
            let mut all = vec![vec![0.0; self.shifts.count() * s.count()]; run.wavelengths.len()];
            for (&shift, lights) in run.shifts.iter().zip(answers) {
                report.note(lights, cosines);
                for (all, light) in all.iter_mut().zip(lights) {
                    let p = stack.share_of(colour, &light.mean.absorbed);
                    report.note_shares(&p);
                    for g in &fixing {
                        let at = self.shifts.sent(*g, shift) * s.count();
                        for (i, p) in p.iter().enumerate() {
                            all[at + g.sub_pixel(s, i)] = *p;
                        }
                    }
                }
            }
            for (w, all) in run.wavelengths.clone().zip(all) {
                values[w].insert(run.node, all);
            }
        }
        values
    }

    /// P of every direction under a stored shift: light from a node, seen through a symmetry, is light from a simulated
    /// one.
    fn all_directions(
        &self,
        stack: &PixelStack,
        simulated: &ByDirection,
        shift: usize,
    ) -> BTreeMap<Node, Vec<f64>> {
        let s = stack.subpixels;
        let side = -self.steps..=self.steps;
        let mut all = BTreeMap::new();
        for node in side.clone().flat_map(|a| side.clone().map(move |b| (a, b))) {
            let mut images = self.symmetries.iter();
            let source = images.find_map(|g| simulated.get(&g.node(node)).map(|p| (p, g)));
            if let Some((p, g)) = source {
                let at = self.shifts.sent(*g, shift) * s.count();
                let seen = (0..s.count()).map(|i| p[at + g.sub_pixel(s, i)]);
                all.insert(node, seen.collect());
            }
        }
        all
    }

    /// The table's values `[v][u][sub-pixel]` of all simulated nodes, `step` apart, and the most that they were cut.
    fn sampled(
        &self,
        all: &BTreeMap<Node, Vec<f64>>,
        step: f64,
        refine: i64,
        count: usize,
    ) -> (Vec<f32>, f64) {
        let grid = Grid::filled(all, self.steps, LARGEST_SINE / step, count);
        let places = Place::axis(self.steps * refine, refine, self.step[0] / step, self.steps);
        shares(grid.at(&places), count)
    }
}
