//! The response table: directions simulated, and how it is read between them, against directions simulated directly.
//!
//! A table samples a cubic through the simulated directions more finely, and the renderer reads it bilinearly; both
//! ways are told apart here by leaving the finer samples out.

use crate::error::LaboratoryError;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{Level, PixelModel, Preset};
use quadpixel::response::{AngularResponse, ResponseAxes, TableSettings, build_table};
use quadpixel::sampling::{SobolSet, concentric_disk};

use super::clock::best_of;
use super::row::{Curve, Row, Table, rms};
use super::work::{PIXEL, Size};

const WAVELENGTH_NM: f64 = 550.0;
/// Table steps in a simulated one, as the presets have them.
const REFINE: usize = 4;
/// Largest sin θ that is asked: beyond what lenses of F/1 send.
const REACH: f64 = 0.6;

/// What is tabulated and asked.
struct Plan<'a> {
    pixel: &'a str,
    model: WaveSettings,
    steps: &'a [usize],
    asked: usize,
}

pub(super) fn table(size: Size) -> Result<Table, LaboratoryError> {
    const STEPS: [usize; 7] = [4, 6, 9, 12, 18, 24, 36];
    let plan = |pixel| Plan {
        pixel,
        model: WaveSettings::standard(),
        steps: if size == Size::Full {
            &STEPS
        } else {
            &STEPS[1..]
        },
        asked: if size == Size::Full { 256 } else { 64 },
    };
    let mut curves = of(&plan(PIXEL))?;
    if size == Size::Full {
        curves.extend(of(&plan("2.8um"))?);
    }
    Ok(Table {
        knob: "grid",
        work: format!(
            "wave model, preset standard, {WAVELENGTH_NM} nm; a table of n steps from u = 0 to 0.8 is asked at directions all over sin theta <= {REACH}; bilinear, of the nodes simulated \
             or of {REFINE} times as many by a cubic (as in the presets)"
        ),
        reference: "the same directions simulated by the same model".into(),
        seconds_unit: "s a table",
        error_unit: "RMS of P, % of the largest",
        curves,
        law: None,
        notes: vec![
            "Dataset tables have 16 steps x 3.5 um / pitch (12 to 36): 35 of 1.6 um.".into(),
        ],
    })
}

fn of(plan: &Plan) -> Result<Vec<Curve>, LaboratoryError> {
    let stack = PixelStack::builtin(plan.pixel)?;
    let model = PixelModel::Wave(plan.model);
    let lit = model.solver(&stack, WAVELENGTH_NM)?;
    let directions = directions(plan.asked);
    let mut exact: Vec<f64> = Vec::new();
    for [u, v] in &directions {
        exact.extend(lit.on_microlens(*u, *v)?.mean.absorbed);
    }
    let peak = exact.iter().copied().fold(0.0, f64::max);
    let error = |table: &AngularResponse| {
        let lookup = table.interpolator(WAVELENGTH_NM);
        let mut p = vec![0f32; exact.len()];
        let both = directions
            .iter()
            .zip(p.chunks_exact_mut(stack.subpixels.count()));
        both.for_each(|([u, v], p)| lookup.weights(*u as f32, *v as f32, p));
        100.0 * rms(&p, &exact) / peak
    };
    let (mut cubic, mut bilinear) = (Vec::new(), Vec::new());
    for &steps in plan.steps {
        let settings = TableSettings {
            model: model.clone(),
            steps,
            refine: REFINE,
            ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
        };
        let (seconds, built) = best_of(1, || build_table(&stack, &settings, None, &|_, _| ()));
        let built = built?;
        let setting = format!("{steps} steps, {} directions", built.report.runs);
        cubic.push(Row::new(setting.clone(), seconds, error(&built.table)));
        bilinear.push(Row::new(
            setting,
            seconds,
            error(&simulated_alone(&built.table)?),
        ));
    }
    let curve = |name: &str, rows| Curve {
        name: format!("{}, {name}", plan.pixel),
        rows,
    };
    Ok(vec![curve("cubic", cubic), curve("bilinear", bilinear)])
}

/// Directions all over the disk sin θ ≤ [`REACH`], on no node of any grid.
fn directions(count: usize) -> Vec<[f64; 2]> {
    let set = SobolSet::new(count);
    let [mut s, mut t] = [vec![0.0; count], vec![0.0; count]];
    set.fill(0, 11, 0, &mut s);
    set.fill(1, 11, 0, &mut t);
    let disk = s.iter().zip(&t).map(|(s, t)| concentric_disk(*s, *t));
    disk.map(|(a, b)| [REACH * a, REACH * b]).collect()
}

/// The table without what the cubic put between the simulated nodes.
fn simulated_alone(table: &AngularResponse) -> Result<AngularResponse, LaboratoryError> {
    let axes = table.axes();
    let fewer = |axis: &[f64]| axis.iter().copied().step_by(REFINE).collect::<Vec<f64>>();
    let (u, v) = (fewer(&axes.u), fewer(&axes.v));
    let mut values = Vec::new();
    for j in 0..v.len() {
        for i in 0..u.len() {
            values.extend_from_slice(table.node(0, 0, j * REFINE, i * REFINE));
        }
    }
    let axes = ResponseAxes {
        u,
        v,
        ..axes.clone()
    };
    Ok(AngularResponse::new(axes, table.meta().clone(), values)?)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn lookups_converge_to_the_directions_that_are_simulated_directly() {
        let curves = of(&Plan {
            pixel: PIXEL,
            model: WaveSettings::draft(),
            steps: &[6, 18],
            asked: 32,
        })
        .unwrap();
        for curve in &curves {
            let [coarse, fine] = [0, 1].map(|i| curve.rows[i].error);
            // Resonances of the lossless layers are narrower than a step and hold even the cubic to first order: a
            // third of the error. Half of that gain is asked, as 32 directions meet few of them.
            assert!(fine < coarse * 2.0 / 3.0, "{curve:?}");
        }
    }
}
