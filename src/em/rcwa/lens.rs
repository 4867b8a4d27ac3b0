//! The lens: its Fourier coefficients slice by slice, and the light through it.
//!
//! A slice of thickness d, lengths in 1/k0, ties the fields at its two faces: with C = P Q and t(x) = tan(√x d/2)/√x,
//! ```text
//!   h_b − h_t = A (E_t + E_b)      A = i Q t(C)
//!   E_b − E_t = B (h_t + h_b)      B = i t(C) P
//! ```
//! (even and odd fields about the middle of the slice). With h_b = Y_b E_b below it follows
//! ```text
//!   (1 − 2 B Y_b + B A) E_b = (1 − B A) E_t,     Y_t E_t = (Y_b − A) E_b − A E_t:
//! ```
//! no modes are needed, and nothing grows. t is a polynomial through Chebyshev nodes of the interval in which the γ²
//! lie: slices are thin (√C d/2 well below 1), so a quadratic is exact to 1e-5.
//!
//! The lens changes within a slice. Two slices are one step of the commutator-free Magnus method of fourth order
//! (Blanes & Moan, Appl. Numer. Math. 56, 1519 (2006)): the upper one takes 1/2 + 1/√3 of the P and Q at the upper
//! Gauss node of both, and 1/2 − 1/√3 of those at the lower node; the lower one the other way round. No step reaches
//! across the height z0 at which the lens meets its neighbours: below it the corners that are left go as (z0 −
//! z)^(3/2), which makes the order 5/2 in all.

use std::f64::consts::PI;

use faer::linalg::solvers::Solve;

use super::basis::{Basis, Order, Parity};
use super::grid::Operators;
use super::layers::Climbed;
use super::lighting::{Lighting, Sunk};
use super::linear::{C, Matrix, plus_one, solve};
use super::quadrature::gauss_legendre;
use crate::em::PixelStack;

/// The lens in slices, from the top.
#[derive(Clone)]
pub(super) struct LensSlices {
    /// Thickness of each in µm.
    thickness_um: Vec<f64>,
    /// Resin below the lens's lowest point, in µm.
    pub pedestal_um: f64,
    /// Fourier coefficients of the part of a lens's cell that is resin: of orders (|n_x|, |n_y|) up to `most`, at the
    /// Gauss nodes of each pair of slices.
    masks: Vec<Vec<f64>>,
    most: usize,
    /// Lenses in a period, along each axis.
    lenses: i32,
    /// Shift in pitches.
    shift: [f64; 2],
    resin: C,
}

impl LensSlices {
    /// Slices of `slice_um` at most, with coefficients for differences of orders up to `most`.
    pub fn new(stack: &PixelStack, resin: C, slice_um: f64, most: usize) -> Self {
        let sag = stack.sag_um();
        let (r, p) = (stack.lens.radius_um, stack.pitch_um);
        let meets = r - (r * r - 0.25 * p * p).max(0.0).sqrt();
        let (mut thickness_um, mut masks) = (Vec::new(), Vec::new());
        for (from, to) in [(0.0, meets), (meets, sag)] {
            let steps = (0.5 * (to - from) / slice_um).ceil().max(1.0) as usize;
            let step = (to - from) / steps as f64;
            for i in 0..steps {
                let top = from + i as f64 * step;
                for (depth, _) in gauss_legendre(2, top, top + step) {
                    thickness_um.push(0.5 * step);
                    masks.push(disc(most, (depth * (2.0 * r - depth)).sqrt() / p));
                }
            }
        }
        Self {
            thickness_um,
            pedestal_um: (stack.lens.height_um - sag).max(0.0),
            masks,
            most,
            lenses: stack.microlenses_across() as i32,
            shift: stack.lens.shift_um.map(|s| s / p),
            resin,
        }
    }

    /// The same lens in the middle of the pixel.
    pub fn centred(&self) -> Self {
        Self {
            shift: [0.0; 2],
            ..self.clone()
        }
    }

    /// Slices.
    pub fn count(&self) -> usize {
        self.masks.len()
    }

    /// P and Q of a slice.
    fn operators(&self, basis: &Basis, slice: usize) -> Operators {
        let contrast = self.resin * self.resin - 1.0;
        let (this, other) = (&self.masks[slice], &self.masks[slice ^ 1]);
        let (most, least) = (0.5 + 1.0 / 3f64.sqrt(), 0.5 - 1.0 / 3f64.sqrt());
        let mix = this.iter().zip(other);
        let mixed: Vec<f64> = mix.map(|(a, b)| most * a + least * b).collect();
        let epsilon = |mask: &[f64], orders: &[Order], [px, py]: [Parity; 2]| {
            Matrix::from_fn(orders.len(), orders.len(), |i, j| {
                let (a, b) = (orders[i].n, orders[j].n);
                let mut sum = C::ZERO;
                for (gx, wx) in px.couplings(a[0], b[0]) {
                    for (gy, wy) in py.couplings(a[1], b[1]) {
                        if wx * wy != 0.0 {
                            sum += self.coefficient(mask, gx, gy) * (wx * wy);
                        }
                    }
                }
                let air = if i == j { C::ONE } else { C::ZERO };
                air + contrast * sum
            })
        };
        let [x, y, z] = basis.parities();
        let one = Matrix::identity(basis.z.len(), basis.z.len());
        let [eta, eta_other] = [this, other].map(|mask| solve(&epsilon(mask, &basis.z, z), &one));
        let eta = eta * faer::Scale(C::from(most)) + eta_other * faer::Scale(C::from(least));
        let (x, y) = (epsilon(&mixed, &basis.x, x), epsilon(&mixed, &basis.y, y));
        Operators::new(basis, &x, &y, eta)
    }

    /// Of orders of the period.
    fn coefficient(&self, mask: &[f64], gx: i32, gy: i32) -> C {
        if gx % self.lenses != 0 || gy % self.lenses != 0 {
            return C::ZERO;
        }
        let (gx, gy) = (gx / self.lenses, gy / self.lenses);
        let at = gx.unsigned_abs() as usize * (self.most + 1) + gy.unsigned_abs() as usize;
        let turn = f64::from(gx) * self.shift[0] + f64::from(gy) * self.shift[1];
        C::from_polar(mask[at], -2.0 * PI * turn)
    }

    /// A and B of a slice.
    fn faces(&self, basis: &Basis, slice: usize, k0_per_um: f64) -> [Matrix; 2] {
        let d = k0_per_um * self.thickness_um[slice];
        let Operators { p, q, .. } = self.operators(basis, slice);
        let highest = (self.resin * self.resin).re;
        let [c0, c1, c2] = tangent(1.0 - basis.cutoff * basis.cutoff, highest, d);
        let c = &p * &q;
        // i t(C).
        let square = &c * &c;
        let n = c.nrows();
        let t = Matrix::from_fn(n, n, |i, j| {
            let one = if i == j { c0 } else { 0.0 };
            C::I * (c[(i, j)] * c1 + square[(i, j)] * c2 + one)
        });
        [&q * &t, &t * &p]
    }

    /// Through a slice.
    pub fn climb(&self, basis: &Basis, slice: usize, k0_per_um: f64, below: &Matrix) -> Climbed {
        let [a, b] = self.faces(basis, slice, k0_per_um);
        let (left, right) = sides(&a, &b, below);
        let passage = solve(&left, &right);
        let above = (below - &a) * &passage - a;
        Climbed { above, passage }
    }

    /// Through a slice from above: see [`Sunk`].
    pub fn sink(&self, basis: &Basis, slice: usize, k0_per_um: f64, above: &Lighting) -> Sunk {
        let [a, b] = self.faces(basis, slice, k0_per_um);
        let Lighting { admittance, source } = above;
        let (left, right) = sides(&a, &b, admittance);
        let left = left.partial_piv_lu();
        let passage = left.solve(&right);
        // (1 − 2 B U + B A) E_t = (1 − B A) E_b − 2 B s, h_b = (A − U) E_t + A E_b + s.
        let b_source = &b * source;
        let driven = left.solve(&b_source) * faer::Scale(C::from(-2.0));
        let less = admittance - &a;
        let below = Lighting {
            admittance: &less * &passage - a,
            source: source - less * &driven,
        };
        Sunk {
            below,
            passage,
            driven,
        }
    }
}

/// 1 − 2 B Y + B A and 1 − B A.
fn sides(a: &Matrix, b: &Matrix, y: &Matrix) -> (Matrix, Matrix) {
    let ba = b * a;
    let by = b * y;
    let left = plus_one(&ba - by * faer::Scale(C::new(2.0, 0.0)));
    (left, plus_one(-ba))
}

/// Coefficients of the quadratic through tan(√x d/2)/√x at the Chebyshev nodes of [`low`, `high`].
fn tangent(low: f64, high: f64, d: f64) -> [f64; 3] {
    let t = |x: f64| {
        let root = x.abs().sqrt();
        if root * d < 1e-6 {
            0.5 * d
        } else if x > 0.0 {
            (0.5 * root * d).tan() / root
        } else {
            (0.5 * root * d).tanh() / root
        }
    };
    let x = [1.0, 3.0, 5.0]
        .map(|i: f64| 0.5 * (low + high) + 0.5 * (high - low) * (i * PI / 6.0).cos());
    let f = x.map(t);
    let first = (f[1] - f[0]) / (x[1] - x[0]);
    let second = ((f[2] - f[1]) / (x[2] - x[1]) - first) / (x[2] - x[0]);
    [
        f[0] - first * x[0] + second * x[0] * x[1],
        first - second * (x[0] + x[1]),
        second,
    ]
}

/// Fourier coefficients of a disc about the middle of a unit cell, cut off at its borders.
fn disc(most: usize, radius: f64) -> Vec<f64> {
    let mut out = vec![0.0; (most + 1) * (most + 1)];
    if radius >= 0.5f64.sqrt() {
        out[0] = 1.0;
        return out;
    }
    // Strips along x of half height h(x): the whole cell's up to `full`, then the arc's, by x = r sin t.
    let full = (radius * radius - 0.25).max(0.0).sqrt();
    let (from, to) = ((full / radius).asin(), (0.5 / radius).min(1.0).asin());
    let nodes = 12 + 2 * most;
    let mut strips: Vec<(f64, f64, f64)> = gauss_legendre(nodes, from, to)
        .into_iter()
        .map(|(t, w)| (radius * t.sin(), radius * t.cos(), w * radius * t.cos()))
        .collect();
    if full > 0.0 {
        let flat = gauss_legendre(nodes, 0.0, full);
        strips.extend(flat.into_iter().map(|(x, w)| (x, 0.5, w)));
    }
    let columns = most + 1;
    for (x, h, w) in strips {
        let high: Vec<f64> = (0..columns)
            .map(|g| {
                let k = 2.0 * PI * g as f64;
                if g == 0 {
                    2.0 * h
                } else {
                    2.0 * (k * h).sin() / k
                }
            })
            .collect();
        for gx in 0..columns {
            let f = 2.0 * w * (2.0 * PI * gx as f64 * x).cos();
            for (o, high) in out[gx * columns..].iter_mut().zip(&high) {
                *o += f * high;
            }
        }
    }
    out
}
