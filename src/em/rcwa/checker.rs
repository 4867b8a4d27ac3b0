//! The filters of a mosaic: a layer of 2×2 squares to the period, the first one about the origin; its modes.
//!
//! As in `grid.rs`, by Li's rule: ε_x is the sum over both rows of ⟦1/ε_row⟧⁻¹ along x ⊗ the part of y that the row
//! takes, for a row's two squares; ε_y likewise by columns; for E_z the plain products.

use super::SolverError;
use super::basis::{Basis, Order, Parity};
use super::grid::{Modes, Operators};
use super::linear::{C, Matrix, solve};

/// ε of the squares, row by row.
pub(super) struct Checker(pub [C; 4]);

impl Checker {
    fn epsilon(&self, column: usize, row: usize) -> C {
        self.0[2 * row + column]
    }

    /// The modes of the layer.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn modes(&self, basis: &Basis) -> Result<Modes, SolverError> {
        let [first, rest @ ..] = self.0;
        if rest.iter().all(|e| *e == first) {
            return Ok(Modes::plain(basis, first));
        }
        let [x, y, z] = basis.parities();
        let epsilon_x = self.tangential(basis, 0, x);
        let epsilon_y = self.tangential(basis, 1, y);
        let n = basis.z.len();
        let product = |a: &Order, b: &Order| {
            let mut sum = C::ZERO;
            for row in 0..2 {
                for column in 0..2 {
                    let part = strip(column, z[0], a.n[0], b.n[0]);
                    let part = part * strip(row, z[1], a.n[1], b.n[1]);
                    sum += self.epsilon(column, row) * part;
                }
            }
            sum
        };
        let epsilon_z = Matrix::from_fn(n, n, |i, j| product(&basis.z[i], &basis.z[j]));
        let eta = solve(&epsilon_z, &Matrix::identity(n, n));
        Operators::new(basis, &epsilon_x, &epsilon_y, eta).modes()
    }

    /// ε for the field component along `axis`.
    fn tangential(&self, basis: &Basis, axis: usize, parity: [Parity; 2]) -> Matrix {
        let (orders, across) = ([&basis.x, &basis.y][axis], 1 - axis);
        let along = basis.axis(axis, parity[axis]);
        // By row (for ε_x) or column: ⟦1/ε⟧⁻¹ of its two squares.
        let inverse = [0, 1].map(|line| {
            let series = Matrix::from_fn(along.len(), along.len(), |i, j| {
                (0..2)
                    .map(|at| {
                        let [column, row] = if axis == 0 { [at, line] } else { [line, at] };
                        let part = strip(at, parity[axis], along[i], along[j]);
                        self.epsilon(column, row).inv() * part
                    })
                    .sum()
            });
            solve(&series, &Matrix::identity(along.len(), along.len()))
        });
        let place: Vec<usize> = orders
            .iter()
            .map(|o| along.partition_point(|n| *n < o.n[axis]))
            .collect();
        Matrix::from_fn(orders.len(), orders.len(), |i, j| {
            let (a, b) = (orders[i].n[across], orders[j].n[across]);
            (0..2)
                .map(|line| inverse[line][(place[i], place[j])] * strip(line, parity[across], a, b))
                .sum()
        })
    }
}

/// ⟨n| s |n'⟩ of the half of the period about the origin (0) or of the other half (1).
fn strip(which: usize, parity: Parity, n: i32, other: i32) -> f64 {
    let terms = parity.couplings(n, other);
    let first: f64 = terms.iter().map(|(g, w)| w * half(*g)).sum();
    match (which, n == other) {
        (0, _) => first,
        (_, true) => 1.0 - first,
        (_, false) => -first,
    }
}

/// Fourier coefficient of the half of the period about the origin: sin(πG/2)/πG.
fn half(order: i32) -> f64 {
    match order.rem_euclid(4) {
        _ if order == 0 => 0.5,
        1 => 1.0 / (std::f64::consts::PI * f64::from(order)),
        3 => -1.0 / (std::f64::consts::PI * f64::from(order)),
        _ => 0.0,
    }
}
