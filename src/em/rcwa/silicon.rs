//! Silicon between its trenches, without end below: what it throws back, and what each photodiode absorbs.
//!
//! The trenches repeat with every sub-pixel, so silicon couples only orders of one [`Class`]: for a quad pixel four
//! problems of a quarter of the orders, one sixteenth of the work. It is lit from the medium above, whose waves a
//! (down) and b (up) are order by order: a + b = W c, Y (a − b) = V c, so (Y W + V) c = 2 Y a.

use rustfft::num_complex::Complex32;

use super::SolverError;
use super::basis::{Basis, Class};
use super::block::Block;
use super::column::Pixel;
use super::detector::{Detector, nodes_along};
use super::grid::Grid;
use super::linear::{C, Matrix, flux, scale_rows};
use super::quadrature::gauss_legendre;

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
    /// Absorbed in trenches that absorb and in isolation, if there are such: what is left of the loss of flux.
    pub between: f64,
}

impl InSilicon {
    pub fn new(entering: f64, leaving: f64, absorbed: Vec<f64>, lossy_between: bool) -> Self {
        let between = match lossy_between {
            true => entering - leaving - absorbed.iter().sum::<f64>(),
            false => 0.0,
        };
        Self {
            entering,
            leaving,
            absorbed,
            between,
        }
    }
}

impl Silicon {
    /// Under a medium `above`, of which the functions `low` are followed.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn new(low: &Basis, grid: Grid, above: C, cutoff: f64) -> Result<Self, SolverError> {
        let (lattice, sector) = (low.lattice, low.sector);
        let mut blocks = Vec::new();
        for class in Class::all(grid.parts, sector) {
            let basis = Basis::new(lattice, sector, cutoff, class);
            if basis.len() == 0 {
                continue;
            }
            blocks.push(Block::new(low, basis, class, &grid, above)?);
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

    /// Whether what lies between the photodiodes absorbs, too.
    pub fn lossy_between(&self) -> bool {
        self.grid.outside.im > 0.0 || self.grid.uncollected != [self.grid.wall; 2]
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

    /// Amplitudes of the modes of each block under waves `down`, a column each.
    fn amplitudes(&self, down: &Matrix) -> Vec<Matrix> {
        let of_block = |b: &Block| {
            let mut a = Matrix::zeros(b.basis.len(), down.ncols());
            for (there, here) in &b.shared {
                for j in 0..down.ncols() {
                    a[(*here, j)] = down[(*there, j)];
                }
            }
            b.amplitudes(&a)
        };
        self.blocks.iter().map(of_block).collect()
    }

    /// E of waves `down` (a column each) at the nodes of the photodiodes down to `depth` (1/k0), component by
    /// component, depth by depth, node by node, times the square roots of Im ε and of the nodes' weights: the squares
    /// over a photodiode add up to what it absorbs.
    pub fn fields(&self, down: &Matrix, depth: f64) -> Vec<Vec<Complex32>> {
        let z = depths(&self.grid, depth);
        let amplitudes = self.amplitudes(down);
        let detector = Detector::new(&self.grid, &self.whole);
        (0..down.ncols())
            .map(|j| detector.fields(&self.blocks, &amplitudes, &z, j))
            .collect()
    }

    /// Photodiode of each node of a plane of [`Self::fields`], and the nodes in a row.
    pub fn photodiodes_of_nodes(pixel: &Pixel) -> (Vec<usize>, usize) {
        let grid = pixel.silicon();
        let along = [0, 1].map(|axis| {
            let each = nodes_along(&grid, axis, pixel.silicon_cutoff, pixel.step);
            (0..grid.parts[axis] as usize).flat_map(move |i| std::iter::repeat_n(i, each))
        });
        let [columns, rows] = along;
        let across: Vec<usize> = columns.collect();
        let parts = grid.parts[0] as usize;
        let nodes = rows.flat_map(|row| across.iter().map(move |column| row * parts + column));
        (nodes.collect(), across.len())
    }

    /// What becomes of waves `down` (a column per polarization).
    pub fn absorb(&self, down: &Matrix, k0_per_um: f64, depth_um: f64) -> Vec<InSilicon> {
        let depth = k0_per_um * depth_um;
        let z = depths(&self.grid, depth);
        let amplitudes = self.amplitudes(down);
        let flux_at = |depth: f64, j: usize| -> f64 {
            let flux_of_class = |(b, c): (&Block, &Matrix)| {
                let c = scale_rows(c.clone(), &b.modes.phases(depth));
                flux((&b.modes.w * &c).as_ref(), (&b.modes.v * &c).as_ref(), j)
            };
            self.blocks.iter().zip(&amplitudes).map(flux_of_class).sum()
        };
        let detector = Detector::new(&self.grid, &self.whole);
        (0..down.ncols())
            .map(|j| {
                let (entering, leaving) = (flux_at(0.0, j), flux_at(depth, j));
                let absorbed = detector.absorbed(&self.blocks, &amplitudes, &z, j);
                InSilicon::new(entering, leaving, absorbed, self.lossy_between())
            })
            .collect()
    }
}

/// Depths (place, weight) of an integral over |E|², which beats in z at up to n_silicon k0.
fn depths(grid: &Grid, depth: f64) -> Vec<(f64, f64)> {
    gauss_legendre(depth_count(grid, depth), 0.0, depth)
}

fn depth_count(grid: &Grid, depth: f64) -> usize {
    (0.25 * grid.inside.sqrt().re * depth) as usize + 16
}

/// Nodes of [`Silicon::fields`] along x, along y and in depth.
pub(super) fn node_counts(pixel: &Pixel) -> [usize; 3] {
    let grid = pixel.silicon();
    let along = |axis: usize| {
        let each = nodes_along(&grid, axis, pixel.silicon_cutoff, pixel.step);
        each * grid.parts[axis] as usize
    };
    let depth = pixel.k0_per_um * pixel.stack.silicon_um;
    [along(0), along(1), depth_count(&grid, depth)]
}
