//! Silicon between its trenches, without end below: what it throws back, and what each photodiode absorbs.
//!
//! The trenches repeat with every sub-pixel, so silicon couples only orders of one [`Class`]: for a quad pixel four problems of a quarter of
//! the orders, one sixteenth of the work. It is lit from the medium above, whose waves a (down) and b (up) are order by order:
//! a + b = W c, Y (a − b) = V c, so (Y W + V) c = 2 Y a.

use faer::linalg::solvers::{PartialPivLu, Solve};

use super::RcwaError;
use super::basis::{Basis, Class, Order, places};
use super::grid::{Grid, Modes, Operators};
use super::linear::{C, Matrix, flux, scale_rows};
use super::quadrature::gauss_legendre;
use super::uniform::Uniform;

/// Modes of one class.
struct Block {
    basis: Basis,
    operators: Operators,
    modes: Modes,
    above: Uniform,
    matching: PartialPivLu<C>,
    /// Where functions of the field above stand in this block: (there, here).
    shared: Vec<(usize, usize)>,
}

/// Silicon, ready to be lit.
pub(super) struct Silicon {
    blocks: Vec<Block>,
    grid: Grid,
    /// All classes together.
    whole: Basis,
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

    /// b of a, `n` functions each.
    pub fn reflection(&self, n: usize) -> Matrix {
        let mut out = Matrix::zeros(n, n);
        for block in &self.blocks {
            let mut a = Matrix::zeros(block.basis.len(), block.shared.len());
            for (j, (_, here)) in block.shared.iter().enumerate() {
                a[(*here, j)] = C::ONE;
            }
            let e = &block.modes.w * block.amplitudes(&a);
            for (j, (column, _)) in block.shared.iter().enumerate() {
                for (row, here) in &block.shared {
                    out[(*row, *column)] = e[(*here, j)] - a[(*here, j)];
                }
            }
        }
        out
    }

    /// What becomes of waves `down` (a column a polarization).
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
        let detector = Detector::new(self, &z);
        (0..down.ncols())
            .map(|j| {
                let (entering, leaving) = (flux_at(0.0, j), flux_at(depth, j));
                let absorbed = detector.absorbed(self, &amplitudes, j);
                let trenches = match self.grid.outside.im > 0.0 {
                    true => entering - leaving - absorbed.iter().sum::<f64>(),
                    false => 0.0,
                };
                InSilicon {
                    entering,
                    leaving,
                    absorbed,
                    trenches,
                }
            })
            .collect()
    }
}

impl Block {
    /// c of a.
    fn amplitudes(&self, a: &Matrix) -> Matrix {
        let twice = self.above.times(a) * faer::Scale(C::from(2.0));
        self.matching.solve(&twice)
    }

    /// E_x, E_y, E_z at depths, a column each, of amplitudes `c` column `j`.
    fn fields(&self, c: &Matrix, j: usize, depths: &[(f64, f64)]) -> [Matrix; 3] {
        let mut modal = Matrix::zeros(c.nrows(), depths.len());
        for (p, (depth, _)) in depths.iter().enumerate() {
            for (i, phase) in self.modes.phases(*depth).into_iter().enumerate() {
                modal[(i, p)] = c[(i, j)] * phase;
            }
        }
        let (e, h) = (&self.modes.w * &modal, &self.modes.v * &modal);
        let nx = self.basis.x.len();
        // E_z = −η (k_x h_x + k_y h_y).
        let z = places(&self.basis.z);
        let mut d = Matrix::zeros(self.basis.z.len(), depths.len());
        let x = self.basis.x.iter().map(|o| (o, 0));
        for (i, (o, axis)) in x.chain(self.basis.y.iter().map(|o| (o, 1))).enumerate() {
            if let Some(k) = z.get(&o.n) {
                for p in 0..depths.len() {
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

    fn orders(&self, component: usize) -> &[Order] {
        [&self.basis.x, &self.basis.y, &self.basis.z][component]
    }
}

/// Integrates Im ε |E|² over the photodiodes: Gauss nodes in every one of them.
struct Detector<'a> {
    depths: &'a [(f64, f64)],
    /// Numbers of the orders along each axis, by component.
    orders: [[Vec<i32>; 2]; 3],
    /// From orders to nodes, by component and axis.
    synthesis: [[Matrix; 2]; 3],
    /// Photodiode along the axis, and weight in periods, of each node.
    nodes: [Vec<(usize, f64)>; 2],
}

impl<'a> Detector<'a> {
    fn new(silicon: &Silicon, depths: &'a [(f64, f64)]) -> Self {
        let Silicon { grid, whole, .. } = silicon;
        let lattice = whole.lattice;
        let period = 2.0 * std::f64::consts::PI / lattice.step;
        let places = [0, 1].map(|axis| {
            let m = grid.parts[axis];
            let side = (1.0 / f64::from(m) - grid.wall) * period;
            let count = (0.5 * whole.cutoff * side) as usize + 8;
            (0..m)
                .flat_map(|i| {
                    let middle = ((f64::from(i) + 0.5) / f64::from(m) - grid.border) * period;
                    let nodes = gauss_legendre(count, middle - 0.5 * side, middle + 0.5 * side);
                    nodes.into_iter().map(move |(x, w)| (i as usize, x, w))
                })
                .collect::<Vec<_>>()
        });
        let parities = whole.parities();
        let orders = parities.map(|both| [0, 1].map(|axis| whole.axis(axis, both[axis])));
        let synthesis = [0, 1, 2].map(|component| {
            [0, 1].map(|axis| {
                let (parity, n) = (parities[component][axis], &orders[component][axis]);
                let wave = Matrix::from_fn(places[axis].len(), n.len(), |i, j| {
                    parity.value(n[j], lattice.k(axis, n[j]), places[axis][i].1)
                });
                if axis == component {
                    // Across the walls it is ε E that has no jump and a good series.
                    let d = grid.inverse_rule(axis, parity, n);
                    (&wave * &d) * faer::Scale(grid.inside.inv())
                } else {
                    wave
                }
            })
        });
        Self {
            depths,
            orders,
            synthesis,
            nodes: places.map(|p| p.into_iter().map(|(i, _, w)| (i, w / period)).collect()),
        }
    }

    fn absorbed(&self, silicon: &Silicon, amplitudes: &[Matrix], j: usize) -> Vec<f64> {
        let [columns, rows] = silicon.grid.parts.map(|m| m as usize);
        let mut out = vec![0.0; columns * rows];
        let mut fields: [Vec<Matrix>; 3] = [0, 1, 2].map(|component| {
            let [x, y] = &self.orders[component];
            vec![Matrix::zeros(x.len(), y.len()); self.depths.len()]
        });
        for (block, c) in silicon.blocks.iter().zip(amplitudes) {
            for (component, f) in block.fields(c, j, self.depths).iter().enumerate() {
                let [x0, y0] =
                    [0, 1].map(|axis| self.orders[component][axis].first().map_or(0, |n| *n));
                for (i, o) in block.orders(component).iter().enumerate() {
                    let at = ((o.n[0] - x0) as usize, (o.n[1] - y0) as usize);
                    for (p, plane) in fields[component].iter_mut().enumerate() {
                        plane[at] = f[(i, p)];
                    }
                }
            }
        }
        for (component, planes) in fields.iter().enumerate() {
            let [x, y] = &self.synthesis[component];
            for (plane, (_, weight)) in planes.iter().zip(self.depths) {
                let e = (x * plane) * y.transpose();
                for (q, (row, wy)) in self.nodes[1].iter().enumerate() {
                    for (p, (column, wx)) in self.nodes[0].iter().enumerate() {
                        out[row * columns + column] += weight * wx * wy * e[(p, q)].norm_sqr();
                    }
                }
            }
        }
        let loss = silicon.grid.inside.im;
        out.iter().map(|p| p * loss).collect()
    }
}
