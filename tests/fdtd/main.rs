//! The `fdtd` level: flat stacks against the exact transfer matrix, small pixels in the cases that break solvers, and
//! one of the paper's pixels against an independent vector solution. The larger comparisons:
//! `laboratory/benches/fdtd_accuracy.rs`.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod bad_input;
mod flat;
mod hard_cases;
mod mosaic;
mod pixel;

use std::f64::consts::PI;

use quadpixel::em::PixelStack;
use quadpixel::em::fdtd::{FdtdRun, FdtdSettings, solve};
use quadpixel::em::light::Powers;

const NM: f64 = 550.0;

/// k∥ in 1/µm of a direction at 550 nm.
fn bloch(theta_deg: f64, phi_deg: f64) -> [f64; 2] {
    let k = 2.0 * PI / (NM * 1e-3) * theta_deg.to_radians().sin();
    let p = phi_deg.to_radians();
    [k * p.cos(), k * p.sin()].map(|x| if x.abs() < 1e-9 { 0.0 } else { x })
}

/// Coarse enough for a test.
fn coarse() -> FdtdSettings {
    FdtdSettings {
        lateral_nm: 50.0,
        tolerance: 5e-4,
        longest_um: 200.0,
        ..FdtdSettings::draft()
    }
}

/// A quad pixel with every part of the paper's, but small.
fn small(pitch_um: f64) -> PixelStack {
    let r = pitch_um * std::f64::consts::FRAC_1_SQRT_2;
    let mut stack = PixelStack::paper(pitch_um, r, r, 0.2);
    stack.layers[0].thickness_um = 0.1;
    stack.layers[2].thickness_um = 0.2;
    stack.silicon_um = 0.6;
    stack
}

fn run(stack: &PixelStack, bloch: [f64; 2], settings: &FdtdSettings) -> FdtdRun {
    solve(stack, &[NM], bloch, settings, &|_| ()).unwrap()
}

fn both(run: &FdtdRun) -> [&Powers; 2] {
    [run.answers[0].s(), run.answers[0].p()]
}

/// What every run has to keep: energy within 1 %, 0 ≤ P, Σ P ≤ 1, and volume integral and flux within `flux` of each
/// other.
fn holds(run: &FdtdRun, flux: f64) {
    assert!(run.warnings().is_empty(), "{:?}", run.warnings());
    for p in both(run) {
        println!("{p:?}");
        assert!((p.balance() - 1.0).abs() < 0.01, "{}", p.balance());
        assert!(p.absorbed.iter().all(|p| *p >= 0.0));
        assert!(p.absorbed.iter().sum::<f64>() <= 1.0);
        assert!(p.reflected > -0.002 && p.transmitted > -0.002 && p.elsewhere > -0.002);
        for (v, f) in p.absorbed.iter().zip(&p.absorbed_by_flux) {
            assert!((v - f).abs() < flux, "volume {v}, flux {f}");
        }
    }
}
