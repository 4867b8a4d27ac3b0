//! Flat layers have an exact solution.

use quadpixel::em::multilayer::{FlatStack, Polarization};
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::{Material, PixelStack};

use super::{solve, walls};

/// The paper's layers, under a lens of air; no trenches. Of this pitch, two wavelengths, orders graze in air at θ = 0.
fn flat() -> PixelStack {
    let mut stack = PixelStack::paper(1.1, 0.8, 0.8, 0.75);
    stack.lens.material = Material::Constant { n: 1.0, k: 0.0 };
    stack.trench_um = 0.0;
    stack
}

fn settings() -> RcwaSettings {
    RcwaSettings {
        silicon_margin: 0.0,
        lens_cutoff: 1.3,
        ..RcwaSettings::draft()
    }
}

/// Largest deviation of R, T, silicon and rest from the transfer matrix, over angles, azimuths and polarizations.
fn worst(stack: &PixelStack, of: &PixelStack) -> f64 {
    let exact = FlatStack::from_pixel(of, 550.0).unwrap();
    let mut worst = 0.0f64;
    for (theta, phi) in [
        (0.0, 0.0f64),
        (20.0, 0.0),
        (40.0, 90.0),
        (60.0, 25.0),
        (75.0, 200.0),
    ] {
        let sine = f64::to_radians(theta).sin();
        let (s, c) = phi.to_radians().sin_cos();
        let v = if phi == 0.0 { 0.0 } else { sine * s };
        let answer = solve(stack, &settings(), sine * c, v);
        for (pol, ours) in [(Polarization::S, answer.s()), (Polarization::P, answer.p())] {
            let e = exact.solve(550.0, sine, pol).unwrap();
            let n = e.entering.len();
            let silicon = e.entering[n - 2] - e.entering[n - 1];
            let elsewhere = e.entering[0] - e.entering[n - 2];
            let mut off = vec![
                ours.reflected - e.reflected,
                ours.transmitted - e.transmitted(),
                ours.sum_by_flux() + ours.elsewhere - silicon - elsewhere,
            ];
            if stack.trench_um == 0.0 {
                off.push(ours.sum_by_flux() - silicon);
                // Gauss nodes for waves of the largest angle in silicon are more than these need.
                off.push(ours.absorbed.iter().sum::<f64>() - silicon);
            }
            assert!(off.iter().all(|x| x.is_finite()));
            worst = off.iter().fold(worst, |worst, x| worst.max(x.abs()));
        }
    }
    worst
}

#[test]
fn flat_layers_are_the_transfer_matrix_to_1e_10() {
    // Rounding: some hundred operations in a row on numbers of condition up to 1e3.
    let off = worst(&flat(), &flat());
    assert!(off < 1e-10, "{off:.1e}");
}

#[test]
fn trenches_of_silicon_are_no_trenches() {
    let mut stack = flat();
    stack.trench_um = 0.1;
    stack.trench = stack.silicon.clone();
    let off = worst(&stack, &flat());
    assert!(off < 1e-10, "{off:.1e}");
}

#[test]
fn walls_of_their_layers_own_material_are_no_walls() {
    let mut stack = flat();
    let material = stack.layer("filter").unwrap().material.clone();
    stack.metal = Some(walls("filter", material));
    let off = worst(&stack, &flat());
    assert!(off < 1e-10, "{off:.1e}");
}

#[test]
fn what_flat_silicon_absorbs_is_shared_by_area() {
    let mut stack = flat();
    for parts in [[1, 2], [2, 2], [3, 3]] {
        stack.subpixels = quadpixel::sensor::Subpixels::new(parts[0], parts[1]).unwrap();
        let answer = solve(&stack, &settings(), 0.3, 0.2);
        let share = answer.s().sum_by_flux() / (parts[0] * parts[1]) as f64;
        for p in answer.s().absorbed.iter().copied() {
            assert!((p / share - 1.0).abs() < 1e-9, "{p} of {share}");
        }
    }
}
