#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::sync::Mutex;

use super::report::BuiltTable;
use super::runs::{Answers, Run, RunJournal, Runs, Simulated};
use super::table_of_runs::AboutPixel;
use crate::em::light::{Light, Powers};
use crate::em::{Level, PixelStack, Preset};
use crate::response::ResponseError;
use crate::response::TableSettings;
use crate::sensor::Subpixels;

const WAVELENGTHS_NM: [f64; 3] = [400.0, 500.0, 700.0];

/// The shares of a quad pixel that a smooth made-up pixel gives at (u, v): a lobe aimed at each sub-pixel, narrower for
/// blue.
fn lobes(u: f64, v: f64, wavelength_nm: f64) -> Vec<f64> {
    let sharp = 2.0 * 550.0 / wavelength_nm;
    let side = |c: f64| 1.0 / (1.0 + (-sharp * c * 4.0).exp());
    let (right, up) = (side(u), side(v));
    let s = Subpixels::QUAD;
    (0..4)
        .map(|i| {
            let (x, y) = s.centre(i);
            let a = if x > 0.0 { right } else { 1.0 - right };
            let b = if y > 0.0 { up } else { 1.0 - up };
            0.8 * a * b * (1.0 - 0.3 * (u * u + v * v))
        })
        .collect()
}

/// A plan as a pulsed model's would be.
fn pulsed_plan(stack: &PixelStack, settings: &TableSettings) -> Runs {
    Runs::new(stack, settings, true).unwrap()
}

fn stack() -> PixelStack {
    PixelStack::builtin("1.6um").unwrap()
}

fn settings() -> TableSettings {
    TableSettings {
        wavelengths_nm: WAVELENGTHS_NM.to_vec(),
        steps: 20,
        refine: 2,
        ..TableSettings::new(Level::Wave, Preset::Draft, &stack())
    }
}

fn answer(run: &Run, plan: &Runs) -> Answers {
    let at = |w: usize| {
        let [u, v] = run.cosines(w, &plan.step);
        let mean = Powers {
            absorbed: lobes(u, v, WAVELENGTHS_NM[w]),
            ..Powers::default()
        };
        Light {
            mean,
            ..Light::default()
        }
    };
    vec![run.wavelengths.clone().map(at).collect()]
}

fn built(plan: &Runs, stack: &PixelStack, simulated: &Simulated) -> BuiltTable {
    let about = AboutPixel {
        frame: stack.moving_frame(550.0).unwrap(),
        corrections: Vec::new(),
        layout: None,
    };
    plan.table(stack, &settings(), &about, simulated).unwrap()
}

#[test]
fn one_pulse_a_wavevector_gives_the_table_of_every_wavelength() {
    let stack = stack();
    let plan = pulsed_plan(&stack, &settings());
    // One run a k∥ answers for all wavelengths that travel; the outer ones are evanescent at 700 nm.
    let triangle = 21 * 22 / 2;
    assert!(plan.runs.len() <= triangle);
    assert!(plan.runs.iter().all(|r| r.wavelengths.start == 0));
    assert!(plan.runs.iter().any(|r| r.wavelengths.len() == 3));
    assert!(plan.runs.iter().any(|r| r.wavelengths.len() == 1));
    let simulated = plan
        .simulate(None, &|_, _| {}, &|run, _| Ok(answer(run, &plan)))
        .unwrap();
    let BuiltTable { table, report } = built(&plan, &stack, &simulated);
    assert_eq!(report.violation(), None);
    for nm in WAVELENGTHS_NM {
        let lookup = table.interpolator(nm);
        for (u, v) in [
            (0.0, 0.0),
            (0.11, -0.23),
            (0.3, 0.4),
            (-0.52, 0.17),
            (0.7, 0.1),
        ] {
            let mut p = [0.0; 4];
            lookup.weights(u as f32, v as f32, &mut p);
            for (p, wanted) in p.iter().zip(lobes(u, v, nm)) {
                // The grid's own step at 700 nm is 0.07: the lobes' cubic error there, and bilinear between table
                // nodes.
                assert!(
                    (f64::from(*p) - wanted).abs() < 4e-3,
                    "{nm} nm, ({u}, {v}): {p}, {wanted}"
                );
            }
        }
    }
}

#[test]
fn a_build_stopped_in_the_middle_repeats_no_run_and_ends_with_the_same_bits() {
    let stack = stack();
    let plan = pulsed_plan(&stack, &settings());
    let whole = plan
        .simulate(None, &|_, _| {}, &|run, _| Ok(answer(run, &plan)))
        .unwrap();
    let whole = built(&plan, &stack, &whole);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.journal");
    let asked = Mutex::new(Vec::new());
    let counted = |most: usize| {
        let journal = RunJournal::open(&path, "key", &()).unwrap();
        plan.simulate(Some(&journal), &|_, _| {}, &|run, _| {
            let mut asked = asked.lock().unwrap();
            if asked.len() >= most {
                // The kill: no answer.
                return Err(ResponseError::value("power", "off", "on"));
            }
            asked.push(run.node);
            Ok(answer(run, &plan))
        })
    };
    assert!(counted(50).is_err());
    assert!(counted(120).is_err());
    let resumed = built(&plan, &stack, &counted(usize::MAX).unwrap());
    assert_eq!(resumed.report.reused, 120);
    assert_eq!(resumed.table, whole.table);
    let mut asked = asked.into_inner().unwrap();
    assert_eq!(asked.len(), plan.runs.len());
    asked.sort_unstable();
    asked.dedup();
    assert_eq!(asked.len(), plan.runs.len());
}

#[test]
fn powers_that_cannot_be_are_told_before_they_are_cut() {
    let stack = stack();
    let plan = pulsed_plan(&stack, &settings());
    let with = |change: &(dyn Fn(&mut Vec<f64>) + Sync)| {
        let simulated = plan.simulate(None, &|_, _| {}, &|run, _| {
            let mut answer = answer(run, &plan);
            if run.node == (-5, -3) {
                change(&mut answer[0][0].mean.absorbed);
            }
            Ok(answer)
        });
        simulated.map(|s| built(&plan, &stack, &s).report)
    };
    let low = with(&|p| p[2] = -0.05).unwrap();
    assert!(low.violation().unwrap().contains("-0.0500"));
    assert!((low.most_cut - 0.05).abs() < 0.02, "{}", low.most_cut);
    let high = with(&|p| p[0] = 0.9).unwrap();
    assert!(high.violation().unwrap().contains("above 1"));
    assert!(
        with(&|p| p[1] = f64::NAN)
            .unwrap_err()
            .to_string()
            .contains("finite")
    );
    assert!(with(&|p| p.truncate(3)).is_err());
}
