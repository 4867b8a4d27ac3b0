//! Waves in a uniform medium, order by order.
//!
//! Tangential E = (E_x, E_y) and h = (H_y, −H_x) (in units of E / Z0), so that Re E†h is the downward flux. A wave
//! e^(iγ k0 z), z downwards, γ² = ε − k², has h = Y E with Y = (ε − K⊥ K⊥ᵀ)/γ, K⊥ = (−k_y, k_x).

use super::basis::{Basis, places};
use super::linear::{C, Matrix, downward};

/// Admittance and γ of every function of a basis.
pub(super) struct Uniform {
    pub gamma: Vec<C>,
    /// Y: diagonal, and the entry of the same order's other component.
    rows: Vec<(C, Option<(usize, C)>)>,
}

impl Uniform {
    pub fn new(basis: &Basis, epsilon: C) -> Self {
        let (x, y) = (places(&basis.x), places(&basis.y));
        let first_y = basis.x.len();
        let mut gamma = Vec::with_capacity(basis.len());
        let mut rows = Vec::with_capacity(basis.len());
        for (i, o) in basis.x.iter().chain(&basis.y).enumerate() {
            let [kx, ky] = o.k;
            let g = downward(epsilon - kx * kx - ky * ky);
            let (across, partner) = if i < first_y {
                (kx, y.get(&o.n).map(|j| j + first_y))
            } else {
                (ky, x.get(&o.n).copied())
            };
            gamma.push(g);
            // (ε − k_y²)/γ, so written that a grazing order keeps an admittance.
            let partner = partner.map(|j| (j, kx * ky / g));
            rows.push((g + across * across / g, partner));
        }
        Self { gamma, rows }
    }

    /// Y m.
    pub fn times(&self, m: &Matrix) -> Matrix {
        Matrix::from_fn(m.nrows(), m.ncols(), |i, j| {
            let (own, partner) = self.rows[i];
            own * m[(i, j)] + partner.map_or(C::ZERO, |(k, y)| y * m[(k, j)])
        })
    }

    /// Y as a matrix.
    pub fn matrix(&self) -> Matrix {
        let n = self.rows.len();
        let mut out = Matrix::zeros(n, n);
        for (i, (own, partner)) in self.rows.iter().enumerate() {
            out[(i, i)] = *own;
            if let Some((j, y)) = partner {
                out[(i, *j)] = *y;
            }
        }
        out
    }

    /// e^(iγ k0 z).
    pub fn phases(&self, k0_z: f64) -> Vec<C> {
        phases(&self.gamma, k0_z)
    }
}

/// e^(iγ k0 z).
pub(super) fn phases(gamma: &[C], k0_z: f64) -> Vec<C> {
    gamma.iter().map(|g| (C::I * g * k0_z).exp()).collect()
}
