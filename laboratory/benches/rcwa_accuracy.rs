//! Error and time of the `rcwa` level against the reference curves of `tests/response/reference`, and P of any pixel
//! over θ.
//!
//! ```sh
//! # P of each half over θ, beside the reference; `1.6` .. `3.5`
//! cargo bench -p quadpixel-laboratory --bench rcwa_accuracy -- curve 1.6 standard
//! # slice nm / lens cutoff / wall cutoff / silicon margin
//! cargo bench -p quadpixel-laboratory --bench rcwa_accuracy -- curve 1.6 40/2.2/4/5 0,10,20
//! # a built-in pixel; last the azimuth, deg
//! cargo bench -p quadpixel-laboratory --bench rcwa_accuracy -- pixel 2.8um-tungsten standard 0,10,20 30
//! ```
#![allow(clippy::unwrap_used)] // because a bench fails by panicking

#[path = "../../benches/support/curves.rs"]
mod curves;

use curves::{Errors, halves, numbers, reference, words};
use quadpixel::em::PixelStack;
use quadpixel::em::light::Light;
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};

fn settings(name: &str) -> RcwaSettings {
    match name {
        "draft" => RcwaSettings::draft(),
        "standard" => RcwaSettings::standard(),
        "reference" => RcwaSettings::reference(),
        _ => {
            let n: Vec<f64> = name.split('/').map(|x| x.parse().unwrap()).collect();
            RcwaSettings {
                slice_nm: n[0],
                lens_cutoff: n[1],
                wall_cutoff: n[2],
                silicon_margin: n[3],
            }
        }
    }
}

/// Light from θ and φ: what is answered, and seconds.
fn light(model: &RcwaModel, theta_deg: f64, phi_deg: f64) -> (Light, f64) {
    let began = std::time::Instant::now();
    let (s, phi) = (theta_deg.to_radians().sin(), phi_deg.to_radians());
    let v = if phi_deg == 0.0 { 0.0 } else { s * phi.sin() };
    let light = model.solve(s * phi.cos(), v).unwrap();
    (light, began.elapsed().as_secs_f64())
}

fn pixel(name: &str, preset: &str, thetas: &str, phi_deg: f64) {
    let stack = PixelStack::builtin(name).unwrap();
    let model = RcwaModel::new(&stack, 550.0, &settings(preset)).unwrap();
    println!(
        "{name} {preset} phi {phi_deg}: theta, left right of s, of p, of the mean, R_s R_p, balance-1, s"
    );
    for theta in numbers(thetas) {
        let (a, took) = light(&model, theta, phi_deg);
        let (s, p) = (halves(a.s()), halves(a.p()));
        println!(
            "{theta:5.1}  {:.5} {:.5}  {:.5} {:.5}  {:.5} {:.5}  {:.5} {:.5}  {:+.1e} {:+.1e}  {} functions {:.2} s",
            s[0],
            s[1],
            p[0],
            p[1],
            0.5 * (s[0] + p[0]),
            0.5 * (s[1] + p[1]),
            a.s().reflected,
            a.p().reflected,
            a.s().balance() - 1.0,
            a.p().balance() - 1.0,
            a.functions.unwrap_or(0),
            took
        );
    }
}

fn curve(pixel: &str, name: &str, only: Option<&str>) {
    let (stack, lines) = reference(pixel);
    let wanted = only.map(numbers);
    let model = RcwaModel::new(&stack, 550.0, &settings(name)).unwrap();
    println!("{pixel} {name}: theta pol left right (error in % of the strong half) R balance-1");
    let (mut errors, mut seconds) = (Errors::default(), 0.0);
    for n in lines {
        if wanted.as_ref().is_some_and(|w| !w.contains(&n[0])) {
            continue;
        }
        let (a, took) = light(&model, n[0], 0.0);
        for (pol, powers, at) in [("s", a.s(), 1), ("p", a.p(), 3)] {
            let h = halves(powers);
            let e = errors.add(h, [n[at], n[at + 1]]);
            println!(
                "{:5.1} {pol} {:.5} {:.5} ({:+.2} {:+.2}) {:.4} {:+.1e} flux {:.5}",
                n[0],
                h[0],
                h[1],
                e[0],
                e[1],
                powers.reflected,
                powers.balance() - 1.0,
                powers.sum_by_flux(),
            );
        }
        seconds += took;
        println!("      {} functions, {took:.2} s", a.functions.unwrap_or(0));
    }
    println!(
        "{pixel} {name}: worst {:.2} %, rms {:.2} %, {seconds:.1} s",
        errors.worst,
        errors.rms()
    );
}

fn main() {
    let words = words();
    let word = |i: usize| words.get(i).map(String::as_str);
    match word(0) {
        Some("pixel") => pixel(
            word(1).unwrap_or("1.6um"),
            word(2).unwrap_or("standard"),
            word(3).unwrap_or("0,10,20"),
            word(4).map_or(0.0, |w| w.parse().unwrap()),
        ),
        _ => curve(
            word(1).unwrap_or("1.6"),
            word(2).unwrap_or("standard"),
            word(3),
        ),
    }
}
