//! One direction under many shifts of the lens, at little more than the cost of one.
//!
//! Nothing below the lens knows of its shift, and a lens moved by s is the same lens, but that order G of the light
//! below it turns by Φ = e^(iG·s). So lens ([`FreeLens`]: it sends down t of the incident waves and throws back L of
//! light from below), base (it throws back R) and what the photodiodes absorb ([`Forms`]) are found once. In the frame
//! of the lens the light x that goes down is
//! ```text
//!   x = t + L Φ R Φ* x
//! ```
//! What flat layers throw back, the part D of R that keeps its order, knows no shift, and only the trenches are left:
//! with M = 1 − L D,
//! ```text
//!   x = M⁻¹ t + M⁻¹ L Φ (R − D) Φ* x
//! ```
//! is iterated, all shifts at once; where that does not converge, solved.

use super::SolverError;
use super::basis::{Basis, Lattice, Parity, Sector};
use super::column::{Column, Pixel};
use super::forms::Forms;
use super::free_lens::FreeLens;
use super::layers;
use super::linear::{C, Matrix, flux, plus_one, solve};
use super::powers::{check_finite, order_zero, powers};
use super::uniform::Uniform;
use crate::em::light::Powers;

/// Change of x at which it is taken for converged, of its length.
const CONVERGED: f64 = 1e-9;
/// Rounds after which it is solved directly.
const MOST_ROUNDS: usize = 40;

/// What is the same under all shifts.
struct Shared {
    basis: Basis,
    /// M⁻¹ t.
    first: Matrix,
    /// M⁻¹ L.
    again: Matrix,
    /// R − D.
    astray: Matrix,
}

/// Powers of the incident waves (E_x, E_y of order 0) under each shift, in pitches; and the functions followed in
/// silicon.
pub(super) fn light<const N: usize>(
    pixel: &Pixel,
    lattice: Lattice,
    waves: [[f64; 2]; N],
    shifts: &[[f64; 2]],
) -> Result<(Vec<[Powers; N]>, usize), SolverError> {
    let sector = Sector {
        x: Parity::None,
        y: Parity::None,
    };
    let base = Column::below_lens(pixel, lattice, sector)?;
    let basis = &base.basis;
    let resin = Uniform::new(basis, pixel.resin());
    let reflected = layers::reflection(&resin, &base.admittance);
    let down_to_silicon = base.falling(&plus_one(reflected.clone()));
    let depth = pixel.k0_per_um * pixel.stack.silicon_um;
    let forms = Forms::new(&base.silicon, down_to_silicon.nrows(), depth);
    let forms = forms.seen_through(&down_to_silicon);

    let incident = order_zero(basis, &waves);
    let lens = FreeLens::new(
        &pixel.slices.centred(),
        basis,
        pixel.resin(),
        pixel.k0_per_um,
        &incident,
    );
    let unshifted = within_orders(basis, &reflected);
    let m = plus_one(-(&lens.back * &unshifted));
    let shared = Shared {
        basis: basis.clone(),
        first: solve(&m, &lens.down),
        again: solve(&m, &lens.back),
        astray: &reflected - &unshifted,
    };

    let turns = shared.turns(shifts);
    let x = shared.down(&turns, N);
    let a = turned(&x, &turns, N, true);
    let inside = forms.powers(&a);
    // Up in the air, in the frame of the lens: the turns change no power there.
    let from_below = turned(&(&reflected * &a), &turns, N, false);
    let up = &lens.out * from_below;
    let up = Matrix::from_fn(up.nrows(), up.ncols(), |i, j| {
        up[(i, j)] + lens.up[(i, j % N)]
    });
    let air = Uniform::new(basis, C::ONE);
    let (h_incident, h_up) = (air.times(&incident), air.times(&up));
    let one = |k: usize| -> [Powers; N] {
        std::array::from_fn(|wave| {
            let j = k * N + wave;
            let whole = flux(incident.as_ref(), h_incident.as_ref(), wave);
            let reflected = flux(up.as_ref(), h_up.as_ref(), j);
            powers(&inside[j], whole - reflected, reflected, 1.0 / whole)
        })
    };
    let all: Vec<[Powers; N]> = (0..shifts.len()).map(one).collect();
    check_finite(all.iter().flatten())?;
    Ok((all, base.silicon.functions()))
}

impl Shared {
    /// Φ of each shift and function.
    fn turns(&self, shifts: &[[f64; 2]]) -> Vec<Vec<C>> {
        let tau = 2.0 * std::f64::consts::PI;
        let orders = || self.basis.x.iter().chain(&self.basis.y);
        let phases = |s: &[f64; 2]| {
            orders()
                .map(|o| C::cis(tau * (f64::from(o.n[0]) * s[0] + f64::from(o.n[1]) * s[1])))
                .collect()
        };
        shifts.iter().map(phases).collect()
    }

    /// x: `waves` columns per shift.
    fn down(&self, turns: &[Vec<C>], waves: usize) -> Matrix {
        let (n, columns) = (self.first.nrows(), turns.len() * waves);
        let first = Matrix::from_fn(n, columns, |i, j| self.first[(i, j % waves)]);
        let mut x = first.clone();
        for _ in 0..MOST_ROUNDS {
            let astray = &self.astray * turned(&x, turns, waves, true);
            let next = &first + &self.again * turned(&astray, turns, waves, false);
            let apart = (0..columns).map(|j| {
                let change = size((0..n).map(|i| next[(i, j)] - x[(i, j)]));
                change / size((0..n).map(|i| first[(i, j)]))
            });
            // A NaN stays.
            let worst = apart.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
            x = next;
            if worst < CONVERGED {
                return x;
            }
        }
        // As rare as grazing orders: all are solved, so that no answer depends on which others were asked for.
        for (k, turns) in turns.iter().enumerate() {
            let round = Matrix::from_fn(n, n, |i, j| {
                self.astray[(i, j)] * turns[i] * turns[j].conj()
            });
            let solution = solve(&plus_one(-(&self.again * round)), &self.first);
            for wave in 0..waves {
                for i in 0..n {
                    x[(i, k * waves + wave)] = solution[(i, wave)];
                }
            }
        }
        x
    }
}

/// Columns of each shift times Φ, or Φ*.
fn turned(m: &Matrix, turns: &[Vec<C>], waves: usize, back: bool) -> Matrix {
    Matrix::from_fn(m.nrows(), m.ncols(), |i, j| {
        let turn = turns[j / waves][i];
        m[(i, j)] * if back { turn.conj() } else { turn }
    })
}

/// Length of a vector.
fn size(vector: impl Iterator<Item = C>) -> f64 {
    vector.map(|x| x.norm_sqr()).sum::<f64>().sqrt()
}

/// The entries of a matrix between functions of one order.
fn within_orders(basis: &Basis, m: &Matrix) -> Matrix {
    let orders: Vec<[i32; 2]> = basis.x.iter().chain(&basis.y).map(|o| o.n).collect();
    Matrix::from_fn(m.nrows(), m.ncols(), |i, j| {
        if orders[i] == orders[j] {
            m[(i, j)]
        } else {
            C::ZERO
        }
    })
}
