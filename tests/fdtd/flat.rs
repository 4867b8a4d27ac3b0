//! Flat stacks against the exact transfer matrix.

use std::f64::consts::PI;

use quadpixel::em::fdtd::{FdtdSettings, solve};
use quadpixel::em::light::Powers;
use quadpixel::em::multilayer::{FlatPowers, FlatStack, Polarization};
use quadpixel::em::{Material, PixelStack};

use super::{bloch, both, run};

/// The paper's layers under a flat lens, no trenches, and silicon short enough for a test: what the grid does to an
/// interface does not depend on its depth.
fn layers() -> PixelStack {
    let mut stack = PixelStack::paper(0.4, 1e3, 0.25, 0.75);
    stack.layers[0].thickness_um = 0.5 - stack.mean_lens_height_um();
    stack.silicon_um = 1.0;
    stack.trench_um = 0.0;
    stack
}

fn settings(cells_per_wavelength: f64) -> FdtdSettings {
    FdtdSettings {
        lateral_nm: 50.0,
        cells_per_wavelength,
        absorbing_layers: 16,
        tolerance: 2e-4,
        longest_um: 200.0,
    }
}

/// Differences of R, A in silicon, T and A elsewhere.
fn differences(got: &Powers, exact: &FlatPowers) -> [f64; 4] {
    let n = exact.entering.len();
    let (into, through) = (exact.entering[n - 2], exact.entering[n - 1]);
    [
        got.reflected - exact.reflected,
        got.absorbed.iter().sum::<f64>() - (into - through),
        got.transmitted - through,
        got.elsewhere - (1.0 - exact.reflected - into),
    ]
}

fn worst_at(stack: &PixelStack, theta_deg: f64, settings: &FdtdSettings) -> f64 {
    let exact = FlatStack::from_pixel(stack, 550.0).unwrap();
    let run = run(stack, bloch(theta_deg, 0.0), settings);
    println!("{} steps, {:.1} s", run.steps, run.seconds);
    let mut worst = 0.0f64;
    for (got, polarization) in both(&run)
        .into_iter()
        .zip([Polarization::S, Polarization::P])
    {
        let sine = theta_deg.to_radians().sin();
        let d = differences(got, &exact.solve(550.0, sine, polarization).unwrap());
        println!(
            "{theta_deg} {polarization:?} {d:+.5?} balance {:.5}",
            got.balance()
        );
        assert!((got.balance() - 1.0).abs() < 0.01);
        worst = d.iter().fold(worst, |w, d| w.max(d.abs()));
    }
    worst
}

/// Issue's bound: 0.5 % absolute at the `reference` preset, whose layers in z these are.
#[test]
fn reflection_and_absorption_are_exact_to_half_a_per_cent_at_0_to_40_deg() {
    for theta in [0.0, 20.0, 40.0] {
        assert!(worst_at(&layers(), theta, &settings(20.0)) < 5e-3);
    }
}

#[test]
fn reflection_and_absorption_are_exact_to_half_a_per_cent_at_60_and_70_deg() {
    for theta in [60.0, 70.0] {
        assert!(worst_at(&layers(), theta, &settings(20.0)) < 5e-3);
    }
}

/// Second order: twice the cells, a quarter of the error. 1.6 leaves room for layers that round to whole cells.
#[test]
fn the_error_falls_with_the_square_of_the_step() {
    let [coarse, middle, fine] = [8.0, 12.0, 18.0].map(|c| worst_at(&layers(), 40.0, &settings(c)));
    let order = (coarse / fine).ln() / (18.0f64 / 8.0).ln();
    println!("{coarse:.5} {middle:.5} {fine:.5}: order {order:.2}");
    assert!(coarse > middle && middle > fine);
    assert!(order > 1.6, "{order}");
}

/// A film of Re ε = −8 (silver-like) in the oxide's place: Drude terms on the grid. 1 %, as the skin depth of 28 nm has
/// few cells.
#[test]
fn a_metal_film_reflects_what_the_transfer_matrix_says() {
    let mut stack = layers();
    stack.layers[2].material = Material::Constant { n: 0.3, k: 2.9 };
    stack.layers[2].thickness_um = 0.02;
    assert!(worst_at(&stack, 40.0, &settings(20.0)) < 0.01);
}

/// One pulse at three wavelengths; 3 % because the correction is made for one of them and the tables are followed by
/// poles.
#[test]
fn one_pulse_answers_at_several_wavelengths() {
    let stack = layers();
    let wavelengths = [450.0, 532.0, 650.0];
    let bloch = [2.0 * PI / 0.532 * 0.3, 0.0];
    let run = solve(&stack, &wavelengths, bloch, &settings(12.0), &|_| ()).unwrap();
    assert!(run.warnings().is_empty(), "{:?}", run.warnings());
    for (a, nm) in run.answers.iter().zip(wavelengths) {
        // The pulse has one k∥: the longer the wavelength, the larger its angle.
        let sine = 0.3 * nm / 532.0;
        let exact = FlatStack::from_pixel(&stack, nm).unwrap();
        for (got, polarization) in [(a.s(), Polarization::S), (a.p(), Polarization::P)] {
            let want = exact.solve(nm, sine, polarization).unwrap();
            let d = differences(got, &want);
            println!("{nm} {polarization:?} {d:+.5?}");
            assert!(d.iter().all(|d| d.abs() < 0.03), "{d:?}");
        }
    }
}
