//! Normal equations of two coupled components, and Cholesky's method.

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
    pub fn solve(mut self) -> Option<[Vec<f64>; 2]> {
        cholesky(&mut self.matrix, &mut self.right)?;
        let down = self.right.split_off(self.terms);
        Some([self.right, down])
    }
}

/// Replaces `right` by the solution of a positive definite system of which the lower triangle is given (row-major), and the
/// triangle by its factor; `None` where it is singular to rounding.
pub(crate) fn cholesky(matrix: &mut [f64], right: &mut [f64]) -> Option<()> {
    let (size, m, x) = (right.len(), matrix, right);
    for i in 0..size {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| m[i * size + k] * m[j * size + k]).sum();
            let rest = m[i * size + j] - dot;
            if i > j {
                m[i * size + j] = rest / m[j * size + j];
            } else if rest > SMALLEST_PIVOT * m[i * size + i] {
                m[i * size + i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    for i in 0..size {
        let dot: f64 = (0..i).map(|k| m[i * size + k] * x[k]).sum();
        x[i] = (x[i] - dot) / m[i * size + i];
    }
    for i in (0..size).rev() {
        let dot: f64 = (i + 1..size).map(|k| m[k * size + i] * x[k]).sum();
        x[i] = (x[i] - dot) / m[i * size + i];
    }
    Some(())
}
