//! The modes of silicon and trenches in one class of orders.

use faer::linalg::solvers::{PartialPivLu, Solve};

use super::SolverError;
use super::basis::{Basis, Class, Order, places};
use super::grid::{Grid, Modes, Operators};
use super::linear::{C, Matrix};
use super::uniform::Uniform;

/// Modes of one class.
pub(super) struct Block {
    pub class: Class,
    pub basis: Basis,
    operators: Operators,
    pub modes: Modes,
    above: Uniform,
    matching: PartialPivLu<C>,
    /// Where functions of the field above stand in this block: (there, here).
    pub shared: Vec<(usize, usize)>,
}

impl Block {
    /// The modes of a class in the grid, under a medium `above` of which the functions `low` are followed.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn new(
        low: &Basis,
        basis: Basis,
        class: Class,
        grid: &Grid,
        above: C,
    ) -> Result<Self, SolverError> {
        let operators = Operators::for_grid(&basis, grid);
        let modes = Modes::for_grid(&basis, grid, &operators)?;
        let above = Uniform::new(&basis, above);
        let matching = (above.times(&modes.w) + &modes.v).partial_piv_lu();
        let places = low.places_in(&basis).into_iter().enumerate();
        let shared = places.filter_map(|(i, p)| Some((i, p?))).collect();
        Ok(Self {
            class,
            basis,
            operators,
            modes,
            above,
            matching,
            shared,
        })
    }

    /// a of each function shared with the field above, a column each.
    pub fn of_each_shared(&self) -> Matrix {
        let mut a = Matrix::zeros(self.basis.len(), self.shared.len());
        for (j, (_, here)) in self.shared.iter().enumerate() {
            a[(*here, j)] = C::ONE;
        }
        a
    }

    /// c of a.
    pub fn amplitudes(&self, a: &Matrix) -> Matrix {
        let twice = self.above.times(a) * faer::Scale(C::from(2.0));
        self.matching.solve(&twice)
    }

    /// E_x, E_y, E_z at depths, a column each, of amplitudes `c` column `j`.
    pub fn fields(&self, c: &Matrix, j: usize, depths: &[(f64, f64)]) -> [Matrix; 3] {
        let mut modal = Matrix::zeros(c.nrows(), depths.len());
        for (p, (depth, _)) in depths.iter().enumerate() {
            for (i, phase) in self.modes.phases(*depth).into_iter().enumerate() {
                modal[(i, p)] = c[(i, j)] * phase;
            }
        }
        self.components(&(&self.modes.w * &modal), &(&self.modes.v * &modal))
    }

    /// E_x, E_y, E_z of tangential fields E and h, a column each.
    pub fn components(&self, e: &Matrix, h: &Matrix) -> [Matrix; 3] {
        let nx = self.basis.x.len();
        // E_z = −η (k_x h_x + k_y h_y).
        let z = places(&self.basis.z);
        let mut d = Matrix::zeros(self.basis.z.len(), h.ncols());
        let x = self.basis.x.iter().map(|o| (o, 0));
        for (i, (o, axis)) in x.chain(self.basis.y.iter().map(|o| (o, 1))).enumerate() {
            if let Some(k) = z.get(&o.n) {
                for p in 0..h.ncols() {
                    d[(*k, p)] -= h[(i, p)] * o.k[axis];
                }
            }
        }
        [
            e.get(..nx, ..).to_owned(),
            e.get(nx.., ..).to_owned(),
            &self.operators.eta * d,
        ]
    }

    /// The functions of E_x, E_y or E_z.
    pub fn orders(&self, component: usize) -> &[Order] {
        [&self.basis.x, &self.basis.y, &self.basis.z][component]
    }
}
