//! A layer of rectangles parted by walls along x and y (silicon in its trenches; oxide between metal walls): its modes.
//!
//! With E, h as in `uniform.rs` and lengths in 1/k0, Maxwell's equations for the orders of a layer are
//! ```text
//!   ∂E/∂z = i P h    P = 1 − K η Kᵀ            K = (k_x, k_y)
//!   ∂h/∂z = i Q E    Q = ε_t − K⊥ K⊥ᵀ          η: inverse of ε for E_z, whose jumps lie nowhere: the plain product
//! ```
//! Modes e^(iγz): P Q w = γ² w, h = Q w/γ.
//!
//! # Products of jumps
//! ε E_x is continuous across walls that lie along y, E_x across those along x. By Li's rule (J. Opt. Soc. Am. A 14,
//! 2758 (1997)) it is the inverse of the truncated series of 1/ε that multiplies along x, and the plain series along y:
//! ε_x = ε_wall + (⟦1/ε_row⟧⁻¹ − ε_wall) ⊗ b, ε_row being ε along a row of rectangles and b the part of y that these
//! take. The orders lie in a circle; the inverse is that of its diameter for all rows: then D_x = ε_x E_x along a row
//! of rectangles, and the absorption of D_x/ε there adds up to the loss of flux to the last digits.

use super::basis::{Basis, Parity, places};
use super::linear::{C, Matrix, downward, eigen, scale_columns, solve};
use super::uniform::Uniform;
use super::{SolverError, uniform};

/// Rectangles and walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Rectangles in a period, along x and y.
    pub parts: [i32; 2],
    /// Width of the walls in periods.
    pub wall: f64,
    /// Widths in periods that collect no charge, at a pixel's splits and at its border.
    pub uncollected: [f64; 2],
    /// Rectangles of a pixel, along x and y.
    pub of_pixel: [i32; 2],
    /// Place of a wall in periods, a quarter or a half: half a microlens from the centre of the first.
    pub border: f64,
    /// ε of the rectangles.
    pub inside: C,
    /// ε of the walls.
    pub outside: C,
}

impl Grid {
    /// Fourier coefficient G of the part of an axis that the rectangles take; walls are centred on the borders of the
    /// parts. It is real: the origin is a mirror.
    pub fn filled(&self, axis: usize, order: i32) -> f64 {
        let m = self.parts[axis];
        let walls = f64::from(m) * self.wall;
        if order == 0 {
            return 1.0 - walls;
        }
        if order % m != 0 || walls == 0.0 {
            return 0.0;
        }
        let x = std::f64::consts::PI * f64::from(order) * self.wall;
        // cos 2πGb of whole and half turns, exactly.
        let turns = f64::from(order) * self.border;
        let sign = if (turns - turns.round()).abs() < 0.25 {
            1.0
        } else {
            -1.0
        };
        -walls * sign * x.sin() / x
    }

    /// Where rectangle `part` of an axis collects charge, in periods.
    pub fn collected(&self, axis: usize, part: i32) -> [f64; 2] {
        let [split, border] = self.uncollected;
        let edge = |edge: i32, inwards: f64| {
            let strip = match edge % self.of_pixel[axis] == 0 {
                true => border,
                false => split,
            };
            f64::from(edge) / f64::from(self.parts[axis]) - self.border + 0.5 * inwards * strip
        };
        [edge(part, 1.0), edge(part + 1, -1.0)]
    }

    /// Whether what is collected is alike, rectangle by rectangle.
    pub fn is_even(&self) -> bool {
        self.uncollected[0] == self.uncollected[1]
    }

    /// ⟨n| filled |n'⟩.
    fn part(&self, axis: usize, parity: Parity, n: i32, other: i32) -> f64 {
        let terms = parity.couplings(n, other);
        terms
            .iter()
            .map(|(g, w)| {
                if *w == 0.0 {
                    0.0
                } else {
                    w * self.filled(axis, *g)
                }
            })
            .sum()
    }

    /// ⟦1/ε_row⟧⁻¹ along an axis.
    pub fn inverse_rule(&self, axis: usize, parity: Parity, orders: &[i32]) -> Matrix {
        let n = orders.len();
        let (inside, outside) = (self.inside.inv(), self.outside.inv());
        let series = Matrix::from_fn(n, n, |i, j| {
            let background = if i == j { outside } else { C::ZERO };
            background + (inside - outside) * self.part(axis, parity, orders[i], orders[j])
        });
        solve(&series, &Matrix::identity(n, n))
    }
}

/// P and Q of a layer, and η.
pub(super) struct Operators {
    pub p: Matrix,
    pub q: Matrix,
    pub eta: Matrix,
}

impl Operators {
    /// Of ε_x, ε_y (for E_x and E_y) and η (for E_z).
    pub fn new(basis: &Basis, epsilon_x: &Matrix, epsilon_y: &Matrix, eta: Matrix) -> Self {
        let (nx, n) = (basis.x.len(), basis.len());
        let z = places(&basis.z);
        // K of each tangential function, and the E_z function that it leads to.
        let x = basis.x.iter().map(|o| (o.k[0], z.get(&o.n)));
        let y = basis.y.iter().map(|o| (o.k[1], z.get(&o.n)));
        let to_z: Vec<(f64, Option<usize>)> = x.chain(y).map(|(k, z)| (k, z.copied())).collect();
        let p = Matrix::from_fn(n, n, |i, j| {
            let one = if i == j { C::ONE } else { C::ZERO };
            match (to_z[i], to_z[j]) {
                ((ki, Some(a)), (kj, Some(b))) => one - eta[(a, b)] * (ki * kj),
                _ => one,
            }
        });
        let of_y = places(&basis.y);
        let mut q = Matrix::zeros(n, n);
        for i in 0..nx {
            for j in 0..nx {
                q[(i, j)] = epsilon_x[(i, j)];
            }
            let [kx, ky] = basis.x[i].k;
            q[(i, i)] -= ky * ky;
            if let Some(j) = of_y.get(&basis.x[i].n) {
                q[(i, nx + j)] = C::from(kx * ky);
                q[(nx + j, i)] = C::from(kx * ky);
            }
        }
        for i in nx..n {
            for j in nx..n {
                q[(i, j)] = epsilon_y[(i - nx, j - nx)];
            }
            let kx = basis.y[i - nx].k[0];
            q[(i, i)] -= kx * kx;
        }
        Self { p, q, eta }
    }

    /// Of rectangles and walls.
    pub fn for_grid(basis: &Basis, grid: &Grid) -> Self {
        let parities = basis.parities();
        let epsilon_x = tangential(basis, grid, 0, parities[0]);
        let epsilon_y = tangential(basis, grid, 1, parities[1]);
        let contrast = grid.inside - grid.outside;
        let [px, py] = parities[2];
        let n = basis.z.len();
        let epsilon_z = Matrix::from_fn(n, n, |i, j| {
            let (a, b) = (basis.z[i].n, basis.z[j].n);
            let background = if i == j { grid.outside } else { C::ZERO };
            background + contrast * (grid.part(0, px, a[0], b[0]) * grid.part(1, py, a[1], b[1]))
        });
        let eta = solve(&epsilon_z, &Matrix::identity(n, n));
        Self::new(basis, &epsilon_x, &epsilon_y, eta)
    }

    /// The modes of a layer that is not uniform.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn modes(&self) -> Result<Modes, SolverError> {
        let (squares, w) = eigen(&(&self.p * &self.q))?;
        let gamma: Vec<C> = squares.into_iter().map(downward).collect();
        let inverse: Vec<C> = gamma.iter().map(|g| g.inv()).collect();
        let v = scale_columns(&self.q * &w, &inverse);
        Ok(Modes { gamma, w, v })
    }
}

/// ε for the field component along `axis`, with functions `orders` of parities `parity`.
fn tangential(basis: &Basis, grid: &Grid, axis: usize, parity: [Parity; 2]) -> Matrix {
    let (orders, across) = ([&basis.x, &basis.y][axis], 1 - axis);
    let along = basis.axis(axis, parity[axis]);
    let inverse = grid.inverse_rule(axis, parity[axis], &along);
    let place: Vec<usize> = orders
        .iter()
        .map(|o| along.partition_point(|n| *n < o.n[axis]))
        .collect();
    let n = orders.len();
    Matrix::from_fn(n, n, |i, j| {
        let (a, b) = (orders[i].n, orders[j].n);
        let outside = |same: bool| if same { grid.outside } else { C::ZERO };
        let share = grid.part(across, parity[across], a[across], b[across]);
        outside(i == j) + (inverse[(place[i], place[j])] - outside(a[axis] == b[axis])) * share
    })
}

/// Modes of a layer: columns of E (`w`) and of h (`v`), travelling or decaying downwards as e^(iγ k0 z).
pub(super) struct Modes {
    pub gamma: Vec<C>,
    pub w: Matrix,
    pub v: Matrix,
}

impl Modes {
    /// Of a grid with these operators.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn for_grid(
        basis: &Basis,
        grid: &Grid,
        operators: &Operators,
    ) -> Result<Self, SolverError> {
        if grid.wall != 0.0 && grid.inside != grid.outside {
            return operators.modes();
        }
        Ok(Self::plain(basis, grid.inside))
    }

    /// Plane waves: many of equal γ, of which the eigenvalue iteration would make anything.
    pub fn plain(basis: &Basis, epsilon: C) -> Self {
        let plain = Uniform::new(basis, epsilon);
        Self {
            w: Matrix::identity(basis.len(), basis.len()),
            v: plain.matrix(),
            gamma: plain.gamma,
        }
    }

    pub fn phases(&self, k0_z: f64) -> Vec<C> {
        uniform::phases(&self.gamma, k0_z)
    }
}
