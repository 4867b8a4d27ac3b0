//! The few dense operations that the level needs, by `faer`, each on one thread.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use rustfft::num_complex::Complex64;

use super::SolverError;

pub(super) type C = Complex64;
pub(super) type Matrix = Mat<C>;

/// a⁻¹ b.
pub(super) fn solve(a: &Matrix, b: &Matrix) -> Matrix {
    a.partial_piv_lu().solve(b)
}

/// b a⁻¹.
pub(super) fn solve_right(b: &Matrix, a: &Matrix) -> Matrix {
    let transposed = a.transpose().to_owned();
    let lu = transposed.partial_piv_lu();
    lu.solve(b.transpose()).transpose().to_owned()
}

fn no_modes(size: usize) -> SolverError {
    SolverError::NotFound(format!(
        "rcwa: the eigenvalue iteration on {size} functions did not converge; other orders may help"
    ))
}

/// Eigenvalues and eigenvectors (columns).
pub(super) fn eigen(a: &Matrix) -> Result<(Vec<C>, Matrix), SolverError> {
    let decomposition = a.eigen().map_err(|_| no_modes(a.nrows()))?;
    let values = decomposition.S().column_vector().iter().copied().collect();
    Ok((values, decomposition.U().to_owned()))
}

/// m with column j multiplied by `by[j]`.
pub(super) fn scale_columns(mut m: Matrix, by: &[C]) -> Matrix {
    for (j, f) in by.iter().enumerate() {
        for x in m.col_mut(j).iter_mut() {
            *x *= f;
        }
    }
    m
}

/// m with row i multiplied by `by[i]`.
pub(super) fn scale_rows(mut m: Matrix, by: &[C]) -> Matrix {
    for j in 0..m.ncols() {
        for (x, f) in m.col_mut(j).iter_mut().zip(by) {
            *x *= f;
        }
    }
    m
}

/// m + 1.
pub(super) fn plus_one(mut m: Matrix) -> Matrix {
    for i in 0..m.nrows() {
        m[(i, i)] += C::ONE;
    }
    m
}

/// Re Σ e* h of column j: the flux of a field, mean over the cell.
pub(super) fn flux(e: MatRef<'_, C>, h: MatRef<'_, C>, j: usize) -> f64 {
    let both = e.col(j).iter().zip(h.col(j).iter());
    both.map(|(e, h)| (e.conj() * h).re).sum()
}

/// √γ² of a wave that decays, or travels, downwards.
pub(super) fn downward(gamma_squared: C) -> C {
    let g = gamma_squared.sqrt();
    // Rounding may put a lossless wave on the wrong side of the cut.
    let g = if g.im < -1e-9 * g.norm() { -g } else { g };
    // A wave that grazes to the last bit has no admittance.
    if g.norm() < 1e-8 {
        C::new(0.0, 1e-8)
    } else {
        g
    }
}
