//! Silicon between its trenches, without end below: what it throws back, and what each photodiode absorbs.
//!
//! The trenches repeat with every sub-pixel, so silicon couples only orders of one [`Class`]: for a quad pixel four
//! problems of a quarter of the orders, one sixteenth of the work. It is lit from the medium above, whose waves a
//! (down) and b (up) are order by order: a + b = W c, Y (a − b) = V c, so (Y W + V) c = 2 Y a.

use faer::linalg::solvers::{PartialPivLu, Solve};

use super::RcwaError;
use super::basis::{Basis, Class, Order, places};
use super::detector::Detector;
use super::grid::{Grid, Modes, Operators};
use super::linear::{C, Matrix, flux, scale_rows};
use super::quadrature::gauss_legendre;
use super::uniform::Uniform;

/// Modes of one class.
pub(super) struct Block {
    pub class: Class,
    basis: Basis,
    operators: Operators,
    pub modes: Modes,
    above: Uniform,
    matching: PartialPivLu<C>,
    /// Where functions of the field above stand in this block: (there, here).
    pub shared: Vec<(usize, usize)>,
}

/// Silicon, ready to be lit.
pub(super) struct Silicon {
    pub blocks: Vec<Block>,
    pub grid: Grid,
    /// All classes together.
    pub whole: Basis,
}

/// Powers in silicon, in units of Re E†h.
pub(super) struct InSilicon {
    /// Entering from above.
    pub entering: f64,
    /// Passing below the counted depth.
    pub leaving: f64,
    /// Absorbed in each photodiode, by volume integral: by columns of a row, from half a microlens before the origin.
    pub absorbed: Vec<f64>,
    /// Absorbed in the trenches, if they absorb at all: what is left of the loss of flux.
    pub trenches: f64,
}

impl InSilicon {
    pub fn new(entering: f64, leaving: f64, absorbed: Vec<f64>, lossy_trenches: bool) -> Self {
        let trenches = match lossy_trenches {
            true => entering - leaving - absorbed.iter().sum::<f64>(),
            false => 0.0,
        };
        Self {
            entering,
            leaving,
            absorbed,
            trenches,
        }
    }
}

impl Silicon {
    /// Under a medium `above`, of which the functions `low` are followed.
    pub fn new(low: &Basis, grid: Grid, above: C, cutoff: f64) -> Result<Self, RcwaError> {
        let (lattice, sector) = (low.lattice, low.sector);
        let mut blocks = Vec::new();
        for class in Class::all(grid.parts, sector) {
            let basis = Basis::new(lattice, sector, cutoff, class);
            if basis.len() == 0 {
                continue;
            }
            let operators = Operators::of_grid(&basis, &grid);
            let modes = Modes::of_grid(&basis, &grid, &operators)?;
            let above = Uniform::new(&basis, above);
            let matching = (above.times(&modes.w) + &modes.v).partial_piv_lu();
            let places = low.places_in(&basis).into_iter().enumerate();
            let shared = places.filter_map(|(i, p)| Some((i, p?))).collect();
            blocks.push(Block {
                class,
                basis,
                operators,
                modes,
                above,
                matching,
                shared,
            });
        }
        Ok(Self {
            blocks,
            grid,
            whole: Basis::new(lattice, sector, cutoff, Class::WHOLE),
        })
    }

    /// Functions followed in silicon, of all classes.
    pub fn functions(&self) -> usize {
        self.whole.len()
    }

    /// Whether trenches absorb too.
    pub fn lossy_trenches(&self) -> bool {
        self.grid.outside.im > 0.0
    }

    /// b of a, `n` functions each.
    pub fn reflection(&self, n: usize) -> Matrix {
        let mut out = Matrix::zeros(n, n);
        for block in &self.blocks {
            let a = block.of_each_shared();
            let e = &block.modes.w * block.amplitudes(&a);
            for (j, (column, _)) in block.shared.iter().enumerate() {
                for (row, here) in &block.shared {
                    out[(*row, *column)] = e[(*here, j)] - a[(*here, j)];
                }
            }
        }
        out
    }

    /// What becomes of waves `down` (a column per polarization).
    pub fn absorb(&self, down: &Matrix, k0_per_um: f64, depth_um: f64) -> Vec<InSilicon> {
        let depth = k0_per_um * depth_um;
        // |E|² beats in z at up to n_silicon k0, and along x and y at twice the cutoff.
        let n = self.grid.inside.sqrt().re;
        let z = gauss_legendre((0.25 * n * depth) as usize + 16, 0.0, depth);
        let amplitudes: Vec<Matrix> = self
            .blocks
            .iter()
            .map(|b| {
                let mut a = Matrix::zeros(b.basis.len(), down.ncols());
                for (there, here) in &b.shared {
                    for j in 0..down.ncols() {
                        a[(*here, j)] = down[(*there, j)];
                    }
                }
                b.amplitudes(&a)
            })
            .collect();
        let flux_at = |depth: f64, j: usize| -> f64 {
            let of = |(b, c): (&Block, &Matrix)| {
                let c = scale_rows(c.clone(), &b.modes.phases(depth));
                flux((&b.modes.w * &c).as_ref(), (&b.modes.v * &c).as_ref(), j)
            };
            self.blocks.iter().zip(&amplitudes).map(of).sum()
        };
        let detector = Detector::new(self);
        (0..down.ncols())
            .map(|j| {
                let (entering, leaving) = (flux_at(0.0, j), flux_at(depth, j));
                let absorbed = detector.absorbed(self, &amplitudes, &z, j);
                InSilicon::new(entering, leaving, absorbed, self.lossy_trenches())
            })
            .collect()
    }
}

impl Block {
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
