//! Normal equations of two coupled components, solved by Cholesky's method.

use faer::linalg::solvers::Solve;
use faer::{ColRef, Mat, Side};

/// Pivots below this share of their diagonal are rounding: the coefficient is not fixed by the data.
const SMALLEST_PIVOT: f64 = 1e-11;

/// Σ Bᵀ W B and Σ Bᵀ W d, the right component's coefficients first.
pub(super) struct Normal {
    terms: usize,
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    pub fn new(terms: usize) -> Self {
        Self {
            terms,
            matrix: vec![0.0; 4 * terms * terms],
            right: vec![0.0; 2 * terms],
        }
    }

    /// Adds an observation with `information` xx, xy, yy; only the lower triangle is kept.
    pub fn add(&mut self, basis: &[f64], [xx, xy, yy]: [f64; 3], shift: [f64; 2]) {
        let (n, size) = (self.terms, 2 * self.terms);
        let pull = [xx * shift[0] + xy * shift[1], xy * shift[0] + yy * shift[1]];
        for (i, bi) in basis.iter().enumerate() {
            self.right[i] += bi * pull[0];
            self.right[n + i] += bi * pull[1];
            for (j, bj) in basis.iter().enumerate() {
                let product = bi * bj;
                self.matrix[(n + i) * size + j] += product * xy;
                if j <= i {
                    self.matrix[i * size + j] += product * xx;
                    self.matrix[(n + i) * size + n + j] += product * yy;
                }
            }
        }
    }

    /// The coefficients; `None` where the matrix is singular to rounding.
    pub fn solve(self) -> Option<[Vec<f64>; 2]> {
        let mut right = solve_positive_definite(&self.matrix, &self.right)?;
        let down = right.split_off(self.terms);
        Some([right, down])
    }
}

/// The solution of a positive definite system of which the lower triangle is given (row-major); `None` where it is
/// singular to rounding.
pub(crate) fn solve_positive_definite(lower: &[f64], right: &[f64]) -> Option<Vec<f64>> {
    let n = right.len();
    let matrix = Mat::from_fn(n, n, |i, j| lower[i * n + j]);
    let factor = matrix.llt(Side::Lower).ok()?;
    let pivot = |i: usize| factor.L()[(i, i)].powi(2);
    let fixed = (0..n).all(|i| pivot(i) > SMALLEST_PIVOT * lower[i * n + i]);
    let solution = factor.solve(ColRef::from_slice(right));
    fixed.then(|| solution.iter().copied().collect())
}
