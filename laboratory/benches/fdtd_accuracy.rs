//! Error and time of the `fdtd` presets: flat layers against the exact transfer matrix, and the pixels against the
//! reference curves of `tests/response/reference`.
//!
//! ```sh
//! # R, T, A at 0 to 70°, s and p, three meshes
//! cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- flat
//! # P of each half over θ, beside the reference; `1.6` .. `3.5`
//! cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- curve 1.6 standard
//! cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- curve 1.6 standard 0,10,20
//! # lateral nm / cells per wavelength / tolerance
//! cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- curve 1.6 32/11/0.002 0,10,20
//! # beside the Fourier modal level: pixel, preset, θ, φ; a pixel's name may end in -nolens (flat) or -notrench
//! cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- modal 1.6um draft 0,10,20 30
//! ```
#![allow(clippy::unwrap_used)] // because a bench fails by panicking

#[path = "../../benches/support/curves.rs"]
mod curves;

use std::f64::consts::PI;

use curves::{Errors, halves, numbers, reference, words};
use quadpixel::em::PixelStack;
use quadpixel::em::fdtd::{FdtdSettings, solve};
use quadpixel::em::multilayer::{FlatStack, Polarization};
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};

fn settings(name: &str) -> FdtdSettings {
    match name {
        "draft" => FdtdSettings::draft(),
        "standard" => FdtdSettings::standard(),
        "reference" => FdtdSettings::reference(),
        _ => {
            let n: Vec<f64> = name.split('/').map(|x| x.parse().unwrap()).collect();
            FdtdSettings {
                lateral_nm: n[0],
                cells_per_wavelength: n[1],
                tolerance: n[2],
                absorbing_layers: n.get(3).map_or(12, |n| *n as usize),
                ..FdtdSettings::standard()
            }
        }
    }
}

fn bloch(theta_deg: f64, phi_deg: f64) -> [f64; 2] {
    let k0 = 2.0 * PI / 0.55;
    let (s, p) = (theta_deg.to_radians().sin(), phi_deg.to_radians());
    let clean = |x: f64| if x.abs() < 1e-12 { 0.0 } else { x };
    [clean(k0 * s * p.cos()), clean(k0 * s * p.sin())]
}

/// The paper's layers under a flat lens, without trenches.
fn flat(names: &[String]) {
    // Lens and planarization are of one resin: together 0.5 um.
    let mut stack = PixelStack::paper(0.4, 1e3, 0.25, 0.75);
    stack.layers[0].thickness_um = 0.5 - stack.mean_lens_height_um();
    stack.trench_um = 0.0;
    let exact = FlatStack::from_pixel(&stack, 550.0).unwrap();
    println!("mesh theta pol  dR dA_si dT dElse  R_exact A_exact balance steps");
    for name in names {
        for theta in [0.0, 20.0, 40.0, 60.0, 70.0] {
            let run = solve(
                &stack,
                &[550.0],
                bloch(theta, 0.0),
                &settings(name),
                &|_| (),
            )
            .unwrap();
            for (pol, powers) in [
                (Polarization::S, run.answers[0].s()),
                (Polarization::P, run.answers[0].p()),
            ] {
                let e = exact.solve(550.0, theta.to_radians().sin(), pol).unwrap();
                let n = e.entering.len();
                let (si, t) = (e.entering[n - 2] - e.entering[n - 1], e.entering[n - 1]);
                println!(
                    "{name:9} {theta:4} {pol:?} {:+.5} {:+.5} {:+.5} {:+.5}  {:.5} {:.5} {:.5} {} {:.0} {:.1e}",
                    powers.reflected - e.reflected,
                    powers.absorbed.iter().sum::<f64>() - si,
                    powers.transmitted - t,
                    powers.elsewhere - (1.0 - e.reflected - si - t),
                    e.reflected,
                    si,
                    powers.balance(),
                    run.steps,
                    run.time_um,
                    run.residual
                );
            }
        }
    }
}

fn curve(pixel: &str, name: &str, only: Option<&str>) {
    let (stack, lines) = reference(pixel);
    let wanted = only.map(numbers);
    println!(
        "{pixel} {name}: theta pol left right (error in % of the strong half) R balance flux-volume"
    );
    let (mut errors, mut seconds) = (Errors::default(), 0.0);
    for n in lines {
        if wanted.as_ref().is_some_and(|w| !w.contains(&n[0])) {
            continue;
        }
        let run = solve(&stack, &[550.0], bloch(n[0], 0.0), &settings(name), &|_| ()).unwrap();
        let a = &run.answers[0];
        for (pol, powers, at) in [("s", a.s(), 1), ("p", a.p(), 3)] {
            let h = halves(powers);
            let e = errors.add(h, [n[at], n[at + 1]]);
            let flux = powers
                .absorbed
                .iter()
                .zip(&powers.absorbed_by_flux)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            println!(
                "{:5.1} {pol} {:.5} {:.5} ({:+.2} {:+.2}) {:.4} {:.4} {flux:.1e}",
                n[0],
                h[0],
                h[1],
                e[0],
                e[1],
                powers.reflected,
                powers.balance()
            );
        }
        seconds += run.seconds;
        println!(
            "      {:?} x{} {} steps, t {:.0}, residual {:.1e}, {:.1} s, {:.0} MB, {:.1} M real cells/s {:?}",
            run.cells,
            run.sets,
            run.steps,
            run.time_um,
            run.residual,
            run.seconds,
            run.memory_bytes as f64 / 1e6,
            run.cells.iter().product::<usize>() as f64 * run.sets as f64 * run.steps as f64
                / run.seconds
                / 1e6,
            run.warnings()
        );
    }
    println!(
        "{pixel} {name}: worst {:.2} %, rms {:.2} %, {seconds:.0} s",
        errors.worst,
        errors.rms()
    );
}

/// A built-in pixel, or a part of one.
fn part(name: &str) -> PixelStack {
    if let Some(whole) = name.strip_suffix("-nolens") {
        let mut stack = PixelStack::builtin(whole).unwrap();
        stack.lens.radius_um = 1e3;
        stack.lens.height_um = 0.5;
        return stack;
    }
    let whole = name.strip_suffix("-notrench");
    let mut stack = PixelStack::builtin(whole.unwrap_or(name)).unwrap();
    if whole.is_some() {
        stack.trench_um = 1e-3;
    }
    stack
}

/// FDTD beside the Fourier modal level, every sub-pixel, s and p.
fn modal(pixel: &str, name: &str, thetas: &str, phi_deg: f64) {
    let stack = part(pixel);
    let model = RcwaModel::new(&stack, 550.0, &RcwaSettings::standard()).unwrap();
    println!(
        "{pixel} {name} phi {phi_deg}: theta pol, error of each sub-pixel and of the sum in % of the largest half, R of both"
    );
    let (mut worst, mut worst_mean, mut squares, mut count, mut seconds) =
        (0.0f64, 0.0f64, 0.0, 0.0, 0.0);
    for theta in numbers(thetas) {
        let [bx, by] = bloch(theta, phi_deg);
        let k0 = 2.0 * PI / 0.55;
        let exact = model.solve(bx / k0, by / k0).unwrap();
        let run = solve(&stack, &[550.0], [bx, by], &settings(name), &|_| ()).unwrap();
        let a = &run.answers[0];
        let mut errors = Vec::new();
        for (pol, fdtd, exact) in [("s", a.s(), exact.s()), ("p", a.p(), exact.p())] {
            let half = 2.0 * exact.absorbed.iter().copied().fold(0.0, f64::max);
            let e: Vec<f64> = fdtd
                .absorbed
                .iter()
                .zip(&exact.absorbed)
                .map(|(a, b)| 200.0 * (a - b) / half)
                .collect();
            let shown: Vec<String> = e.iter().map(|e| format!("{e:+.2}")).collect();
            println!(
                "{theta:5.1} {pol} {}  {:+.2}  {:.4} {:.4}",
                shown.join(" "),
                e.iter().sum::<f64>() / 2.0,
                fdtd.reflected,
                exact.reflected
            );
            worst = e.iter().fold(worst, |w, e| w.max(e.abs()));
            squares += e.iter().map(|e| e * e).sum::<f64>();
            count += e.len() as f64;
            errors.push(e);
        }
        for (s, p) in errors[0].iter().zip(&errors[1]) {
            worst_mean = worst_mean.max(0.5 * (s + p).abs());
        }
        seconds += run.seconds;
        println!(
            "      {:?} x{} {} steps, t {:.0}, {:.1} s",
            run.cells, run.sets, run.steps, run.time_um, run.seconds
        );
    }
    println!(
        "{pixel} {name}: worst {worst:.2} %, of the mean {worst_mean:.2} %, rms {:.2} %, {seconds:.0} s",
        f64::sqrt(squares / count)
    );
}

fn main() {
    let words = words();
    let word = |i: usize| words.get(i).map(String::as_str);
    match word(0) {
        Some("curve") => curve(
            word(1).unwrap_or("1.6"),
            word(2).unwrap_or("draft"),
            word(3),
        ),
        Some("modal") => modal(
            word(1).unwrap_or("1.6um"),
            word(2).unwrap_or("draft"),
            word(3).unwrap_or("0,10,20"),
            word(4).map_or(0.0, |w| w.parse().unwrap()),
        ),
        Some("flat") if words.len() > 1 => flat(&words[1..]),
        _ => flat(&["draft", "standard", "reference"].map(String::from)),
    }
}
