#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::sync::Mutex;

use super::runs::{Answers, Run, RunJournal, Runs};
use super::table_of_runs::AboutPixel;
use crate::em::light::{Incidence, Light, Powers};
use crate::em::symmetry::Node;
use crate::em::{Level, ModelChoice, PixelStack, Preset};
use crate::response::ResponseError;
use crate::response::TableSettings;
use crate::sensor::{Charge, CollectedAt};

/// A made-up pixel: what a lens at s sends to each sub-pixel, of few harmonics in s, with the symmetries of the square.
fn shares(u: f64, v: f64, shift_um: [f64; 2], pitch_um: f64) -> Vec<f64> {
    spread_shares([u, v], shift_um, pitch_um, 0.0)
}

/// The same after charge has wandered by σ: each harmonic is damped.
fn spread_shares([u, v]: [f64; 2], shift_um: [f64; 2], pitch_um: f64, sigma_um: f64) -> Vec<f64> {
    let turn = 2.0 * std::f64::consts::PI / pitch_um;
    damped_shares([u, v], shift_um, pitch_um, |f| {
        (-0.5 * (f * turn * sigma_um).powi(2)).exp()
    })
}

/// The same of what is kept of each harmonic.
fn damped_shares(
    [u, v]: [f64; 2],
    shift_um: [f64; 2],
    pitch_um: f64,
    kept: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let turn = 2.0 * std::f64::consts::PI / pitch_um;
    let half = |c: f64, s: f64| {
        let x = turn * s + 2.0 * std::f64::consts::PI * 0.9 * c;
        0.5 + 0.3 * kept(1.0) * x.sin() + 0.05 * kept(3.0) * (3.0 * x).sin()
    };
    let (right, up) = (half(u, shift_um[0]), half(v, shift_um[1]));
    let dim = 0.8 * (1.0 - 0.3 * (u * u + v * v));
    [(0, 0), (1, 0), (0, 1), (1, 1)]
        .map(|(c, r)| {
            let part = |x: f64, side: i32| if side == 1 { x } else { 1.0 - x };
            dim * part(right, c) * part(up, r)
        })
        .to_vec()
}

fn stack() -> PixelStack {
    PixelStack::paper(2.0, 1.5, 1.5, 1.0)
}

fn settings() -> TableSettings {
    let choice = ModelChoice::new(Level::Wave, Preset::Standard);
    TableSettings {
        steps: 5,
        refine: 1,
        ..TableSettings::for_all_shifts(&choice, &stack(), 8)
    }
}

fn runs() -> Runs {
    Runs::new(&stack(), &settings(), false).unwrap()
}

fn asked<'a>(
    plan: &'a Runs,
    count: &'a Mutex<Vec<(Node, usize)>>,
    most: usize,
) -> impl Fn(&Run, &[Incidence]) -> Result<Answers, ResponseError> + Sync + 'a {
    move |run, waves| {
        let [u, v] = run.cosines(0, &plan.step);
        let mut count = count.lock().unwrap();
        if count.iter().map(|c| c.1).sum::<usize>() >= most {
            // The kill: no answer.
            return Err(ResponseError::value("power", "off", "on"));
        }
        count.push((run.node, waves.len()));
        let one = |wave: &Incidence| {
            let mean = Powers {
                absorbed: shares(u, v, wave.shift_um, 2.0),
                ..Powers::default()
            };
            vec![Light {
                mean,
                ..Light::default()
            }]
        };
        Ok(waves.iter().map(one).collect())
    }
}

#[test]
fn symmetry_fills_every_shift_and_direction_from_an_octant() {
    let plan = runs();
    let runs = Mutex::new(Vec::new());
    let simulated = plan
        .simulate(None, &|_, _| (), &asked(&plan, &runs, usize::MAX))
        .unwrap();
    // All of the 11 × 11 directions under 64 shifts, but for the corners beyond 70°: an eighth, and the axes of
    // symmetry.
    assert!(plan.count() < 121 * 64 / 6, "{}", plan.count());
    let about = AboutPixel {
        frame: stack().moving_frame(550.0).unwrap(),
        corrections: Vec::new(),
        layout: None,
    };
    let table = plan
        .table(&stack(), &settings(), &about, &simulated)
        .unwrap()
        .table;
    for i in 0..8 {
        for j in 0..8 {
            let lookup = table.interpolator_at_shift([i, j], 550.0).unwrap();
            let shift = plan.shifts.grid().unwrap().shift_um([i, j]);
            for (u, v) in [(0.0, 0.0), (0.16, -0.48), (-0.64, 0.16), (0.48, 0.48)] {
                let mut p = [0f32; 4];
                lookup.weights(u as f32, v as f32, &mut p);
                for (p, wanted) in p.iter().zip(shares(u, v, shift, 2.0)) {
                    assert!(
                        (f64::from(*p) - wanted).abs() < 1e-6,
                        "{shift:?} ({u}, {v})"
                    );
                }
            }
        }
    }
    // Three harmonics through eight nodes: the lookup is exact anywhere, but for its splines. On 16 knots these are off
    // by 1.4 f³, twice that at worst: 9e-3 of the third harmonic (0.026 of P) and 3e-4 of the first (0.16), along both
    // axes.
    let lookup = table.shifted_interpolator(550.0).unwrap();
    for shift in [[0.1, 0.3], [-0.77, 0.42], [1.2, -0.95], [5.31, 7.3]] {
        let mut p = [0f32; 4];
        lookup.weights_batch(shift, &[0.32], &[-0.16], &mut p);
        for (p, wanted) in p.iter().zip(shares(0.32, -0.16, shift, 2.0)) {
            assert!((f64::from(*p) - wanted).abs() < 1.3e-3, "{shift:?}");
        }
    }
    assert!(lookup.bytes() == 11 * 11 * 11 * 11 * 4 * 4);
    // Charge that wanders: closed form of the same harmonics, and a part that the other three sub-pixels share.
    let charge = Charge {
        diffusion_um: 0.25,
        crosstalk: 0.15,
        ..Charge::default()
    };
    let spread = table.clone().with_charge(charge).unwrap();
    let lookup = spread.shifted_interpolator(550.0).unwrap();
    for shift in [[0.0, 0.0], [0.1, 0.3], [-0.77, 0.42], [1.2, -0.95]] {
        let mut p = [0f32; 4];
        lookup.weights_batch(shift, &[0.32], &[-0.16], &mut p);
        let own = spread_shares([0.32, -0.16], shift, 2.0, 0.25);
        let all: f64 = own.iter().sum();
        for (p, own) in p.iter().zip(own) {
            let wanted = 0.85 * own + 0.15 * (all - own) / 3.0;
            assert!(
                (f64::from(*p) - wanted).abs() < 1.3e-3,
                "{shift:?}: {p} {wanted}"
            );
        }
    }
    // By the depth that light of 465 nm goes, and of 610 nm: what is kept is the mean over e^(−z/L), z to the silicon's
    // depth, in steps.
    let deep = Charge {
        collected_at: CollectedAt::LitSide,
        crosstalk: 0.0,
        ..charge
    };
    let spread = table.clone().with_charge(deep).unwrap();
    let depths: Vec<f64> = (0..2000).map(|k| (k as f64 + 0.5) / 2000.0).collect();
    let mean = |nm: f64, of: &dyn Fn(f64) -> f64| {
        let k = stack().silicon.index(nm).unwrap().im.abs();
        let rate = 4.0 * std::f64::consts::PI * k / (1e-3 * nm);
        let weights = depths
            .iter()
            .map(|z| (-rate * z * stack().silicon_um).exp());
        let all: f64 = weights.clone().sum();
        weights.zip(&depths).map(|(w, z)| w * of(*z)).sum::<f64>() / all
    };
    let rms = mean(550.0, &|z| z * z).sqrt();
    for nm in [465.0, 550.0, 610.0] {
        let lookup = spread.shifted_interpolator(nm).unwrap();
        let kept = |f: f64| {
            let turns = f * std::f64::consts::PI * 0.25;
            mean(nm, &|z| (-0.5 * (turns * z / rms).powi(2)).exp())
        };
        let mut p = [0f32; 4];
        lookup.weights_batch([-0.77, 0.42], &[0.32], &[-0.16], &mut p);
        let wanted = damped_shares([0.32, -0.16], [-0.77, 0.42], 2.0, kept);
        for (p, wanted) in p.iter().zip(wanted) {
            assert!(
                (f64::from(*p) - wanted).abs() < 1.3e-3,
                "{nm}: {p} {wanted}"
            );
        }
    }
    // Of silicon that does not absorb no depth is known.
    let clear = PixelStack {
        silicon: crate::em::Material::Constant { n: 4.0, k: 0.0 },
        ..stack()
    };
    let why = table.clone().with_pixel(clear).with_charge(deep);
    assert!(why.unwrap_err().to_string().contains("collected_at"));
    // A table of the centred lens does not know what other shifts give.
    let centred = crate::response::AngularResponse::new(
        crate::response::ResponseAxes {
            shifts_um: vec![[0.0, 0.0]],
            ..table.axes().clone()
        },
        crate::response::ResponseMeta {
            shift_grid: None,
            chief_ray_shifts: None,
            ..table.meta().clone()
        },
        table.table()[..11 * 11 * 4].to_vec(),
    );
    let why = centred
        .unwrap()
        .with_charge(charge)
        .unwrap_err()
        .to_string();
    assert!(
        why.contains("diffusion_um") && why.contains("shifts"),
        "{why}"
    );
}

#[test]
fn a_build_stopped_in_the_middle_goes_on_and_ends_with_the_same_bits() {
    let plan = runs();
    let none = Mutex::new(Vec::new());
    let whole = plan
        .simulate(None, &|_, _| (), &asked(&plan, &none, usize::MAX))
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.journal");
    let runs = Mutex::new(Vec::new());
    let go = |most: usize| {
        let journal = RunJournal::open(&path, "key", &()).unwrap();
        plan.simulate(Some(&journal), &|_, _| (), &asked(&plan, &runs, most))
    };
    assert!(go(200).is_err());
    let resumed = go(usize::MAX).unwrap();
    assert!(resumed.reused >= 200 && resumed.reused < plan.count());
    assert_eq!(resumed.answers, whole.answers);
    let simulated: usize = runs.lock().unwrap().iter().map(|r| r.1).sum();
    assert_eq!(simulated, plan.count());
}
