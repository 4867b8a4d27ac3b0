//! Light through the layers between lens and silicon, from below: what stands below a layer is its admittance Y_b, h =
//! Y_b E.
//!
//! With waves f (down) and g (up) at the bottom of a layer of modes W, V = Q W/γ:
//! ρ = (V + Y_b W)⁻¹ (V − Y_b W), g = ρ f, and at the top, with X = e^(iγ k0 d), ρ' = X ρ X, Y = V (1 − ρ') (W (1 +
//! ρ'))⁻¹. Only decaying exponentials occur.

use super::SolverError;
use super::basis::Basis;
use super::grid::{Grid, Modes, Operators};
use super::linear::{C, Matrix, plus_one, scale_columns, scale_rows, solve, solve_right};
use super::uniform::Uniform;

/// What a layer makes of what is below it.
pub(super) struct Climbed {
    /// Admittance at the top.
    pub above: Matrix,
    /// E at the bottom of E at the top.
    pub passage: Matrix,
}

/// X ρ X.
fn there_and_back(rho: Matrix, x: &[C]) -> Matrix {
    scale_columns(scale_rows(rho, x), x)
}

/// Through a uniform layer.
pub(super) fn uniform(basis: &Basis, epsilon: C, k0_d: f64, below: &Matrix) -> Climbed {
    let medium = Uniform::new(basis, epsilon);
    let rho = reflection(&medium, below);
    let x = medium.phases(k0_d);
    let turned = there_and_back(rho.clone(), &x);
    let above = admittance(&medium, &turned);
    let passage = solve_right(&scale_columns(plus_one(rho), &x), &plus_one(turned));
    Climbed { above, passage }
}

/// What an admittance reflects into a medium.
pub(super) fn reflection(medium: &Uniform, below: &Matrix) -> Matrix {
    let y = medium.matrix();
    solve(&(&y + below), &(&y - below))
}

/// The admittance of a reflection in a medium: Y (1 − ρ)(1 + ρ)⁻¹.
pub(super) fn admittance(medium: &Uniform, rho: &Matrix) -> Matrix {
    solve_right(&medium.times(&plus_one(-rho)), &plus_one(rho.clone()))
}

/// Through a layer with walls.
pub(super) fn walled(
    basis: &Basis,
    grid: &Grid,
    k0_d: f64,
    below: &Matrix,
) -> Result<Climbed, SolverError> {
    let operators = Operators::for_grid(basis, grid);
    let modes = Modes::for_grid(basis, grid, &operators)?;
    Ok(patterned(&modes, k0_d, below))
}

/// Through a layer of these modes.
pub(super) fn patterned(modes: &Modes, k0_d: f64, below: &Matrix) -> Climbed {
    let Modes { w, v, .. } = modes;
    let yw = below * w;
    let rho = solve(&(v + &yw), &(v - &yw));
    let x = modes.phases(k0_d);
    let turned = there_and_back(rho.clone(), &x);
    let top = w * plus_one(turned.clone());
    let above = solve_right(&(v * plus_one(-turned)), &top);
    let passage = solve_right(&(w * scale_columns(plus_one(rho), &x)), &top);
    Climbed { above, passage }
}

/// From the functions `low` that a fine layer needs to the fewer `high` above it, in a medium: the admittance on
/// `high`, and E on `low` of E on `high`. The functions left out meet the medium without end.
pub(super) fn narrowed(low: &Basis, high: &Basis, epsilon: C, below: &Matrix) -> Climbed {
    let rho = reflection(&Uniform::new(low, epsilon), below);
    let places: Vec<usize> = high.places_in(low).into_iter().flatten().collect();
    let n = places.len();
    let followed = Matrix::from_fn(n, n, |i, j| rho[(places[i], places[j])]);
    let above = admittance(&Uniform::new(high, epsilon), &followed);
    // E = (1 + ρ) a on `low`, a = (1 + ρ)⁻¹ E on `high`.
    let mut widened = Matrix::zeros(low.len(), n);
    for (j, place) in places.iter().enumerate() {
        for i in 0..low.len() {
            widened[(i, j)] = rho[(i, *place)];
        }
        widened[(*place, j)] += C::ONE;
    }
    Climbed {
        above,
        passage: solve_right(&widened, &plus_one(followed)),
    }
}
