//! The Fourier modal level: exact where layers are flat, energy to the last digits, the symmetries of light, and curves
//! of independent solvers.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod bad_input;
mod curves;
mod fields;
mod flat;
mod light;
mod mosaic;
mod shifts;

use quadpixel::em::light::{Light, Powers};
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};
use quadpixel::em::{Material, MetalWalls, PixelStack};

/// A pixel of half the usual size, and settings for it: some hundredths of a second a direction.
fn small() -> (PixelStack, RcwaSettings) {
    let mut stack = PixelStack::paper(0.9, 0.7, 0.7, 0.4);
    stack.silicon_um = 1.0;
    (stack, RcwaSettings::draft())
}

fn tungsten() -> Material {
    Material::Table("W_Rakic1998_LD".into())
}

/// Walls between the microlenses through a layer.
fn walls(layer: &str, material: Material) -> MetalWalls {
    MetalWalls {
        layer: layer.into(),
        width_um: 0.1,
        material,
    }
}

fn solve(stack: &PixelStack, settings: &RcwaSettings, u: f64, v: f64) -> Light {
    let model = RcwaModel::new(stack, 550.0, settings).unwrap();
    model.solve(u, v).unwrap()
}

/// All powers in a row, s and p.
fn all(answer: &Light) -> Vec<f64> {
    let of = |p: &Powers| {
        let mut out = p.absorbed.clone();
        out.extend([p.sum_by_flux(), p.reflected, p.transmitted, p.elsewhere]);
        out
    };
    [of(answer.s()), of(answer.p())].concat()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f64::max)
}
