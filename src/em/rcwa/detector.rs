//! Integrals of Im ε |E|² over the photodiodes.

use rustfft::num_complex::Complex32;

use super::basis::Basis;
use super::block::Block;
use super::grid::Grid;
use super::linear::{C, Matrix};
use super::quadrature::gauss_legendre;

/// Integrates Im ε |E|² over the photodiodes: Gauss nodes in every one of them.
pub(super) struct Detector {
    /// Numbers of the orders along each axis, by component.
    orders: [[Vec<i32>; 2]; 3],
    /// From orders to nodes, by component and axis.
    synthesis: [[Matrix; 2]; 3],
    /// Photodiode along the axis, and weight in periods, of each node.
    nodes: [Vec<(usize, f64)>; 2],
    /// Photodiodes along each axis.
    parts: [usize; 2],
    /// Im ε of silicon.
    loss: f64,
}

impl Detector {
    /// Of silicon of a grid, under all functions `whole`.
    pub fn new(grid: &Grid, whole: &Basis) -> Self {
        let lattice = whole.lattice;
        let period = 2.0 * std::f64::consts::PI / lattice.step;
        let places = [0, 1].map(|axis| {
            let m = grid.parts[axis];
            let count = nodes_along(grid, axis, whole.cutoff, lattice.step);
            (0..m)
                .flat_map(|i| {
                    let [from, to] = grid.collected(axis, i).map(|x| x * period);
                    let nodes = gauss_legendre(count, from, to);
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
            orders,
            synthesis,
            parts: grid.parts.map(|m| m as usize),
            loss: grid.inside.im,
            nodes: places.map(|p| p.into_iter().map(|(i, _, w)| (i, w / period)).collect()),
        }
    }

    /// ∫ e_n* e_n' along an axis over photodiode `part`, in periods, of the functions of a component; and the first
    /// function's number.
    pub fn overlap(&self, component: usize, axis: usize, part: usize) -> (Matrix, i32) {
        let synthesis = &self.synthesis[component][axis];
        let weight = |p: usize| match self.nodes[axis][p] {
            (at, weight) if at == part => C::from(weight),
            _ => C::ZERO,
        };
        let weighed = Matrix::from_fn(synthesis.nrows(), synthesis.ncols(), |p, n| {
            synthesis[(p, n)] * weight(p)
        });
        let first = self.orders[component][axis].first().map_or(0, |n| *n);
        (synthesis.adjoint().to_owned() * weighed, first)
    }

    /// What each photodiode absorbs of the mode amplitudes of each block, column `j`, by Gauss nodes in `depths`
    /// (place, weight).
    pub fn absorbed(
        &self,
        blocks: &[Block],
        amplitudes: &[Matrix],
        depths: &[(f64, f64)],
        j: usize,
    ) -> Vec<f64> {
        let [columns, rows] = self.parts;
        let mut out = vec![0.0; columns * rows];
        for planes in self.planes(blocks, amplitudes, depths, j) {
            for (e, (_, weight)) in planes.iter().zip(depths) {
                for (q, (row, wy)) in self.nodes[1].iter().enumerate() {
                    for (p, (column, wx)) in self.nodes[0].iter().enumerate() {
                        out[row * columns + column] += weight * wx * wy * e[(p, q)].norm_sqr();
                    }
                }
            }
        }
        out.iter().map(|p| p * self.loss).collect()
    }

    /// As [`super::silicon::Silicon::fields`], of column `j`.
    pub fn fields(
        &self,
        blocks: &[Block],
        amplitudes: &[Matrix],
        depths: &[(f64, f64)],
        j: usize,
    ) -> Vec<Complex32> {
        let mut out = Vec::new();
        for planes in self.planes(blocks, amplitudes, depths, j) {
            for (e, (_, weight)) in planes.iter().zip(depths) {
                for (q, (_, wy)) in self.nodes[1].iter().enumerate() {
                    out.extend(self.nodes[0].iter().enumerate().map(|(p, (_, wx))| {
                        let e = e[(p, q)] * (self.loss * weight * wx * wy).sqrt();
                        Complex32::new(e.re as f32, e.im as f32)
                    }));
                }
            }
        }
        out
    }

    /// E at the nodes, by component and depth, of column `j`.
    fn planes(
        &self,
        blocks: &[Block],
        amplitudes: &[Matrix],
        depths: &[(f64, f64)],
        j: usize,
    ) -> [Vec<Matrix>; 3] {
        let mut fields: [Vec<Matrix>; 3] = [0, 1, 2].map(|component| {
            let [x, y] = &self.orders[component];
            vec![Matrix::zeros(x.len(), y.len()); depths.len()]
        });
        for (block, c) in blocks.iter().zip(amplitudes) {
            for (component, f) in block.fields(c, j, depths).iter().enumerate() {
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
        for (planes, [x, y]) in fields.iter_mut().zip(&self.synthesis) {
            for plane in planes {
                *plane = (x * &*plane) * y.transpose();
            }
        }
        fields
    }
}

/// Nodes in a photodiode along an axis: |E|² beats at twice the cutoff.
pub(super) fn nodes_along(grid: &Grid, axis: usize, cutoff: f64, step: f64) -> usize {
    let period = 2.0 * std::f64::consts::PI / step;
    let sides = (0..grid.of_pixel[axis]).map(|part| {
        let [from, to] = grid.collected(axis, part);
        (to - from) * period
    });
    let side = sides.fold(0.0, f64::max);
    (0.5 * cutoff * side) as usize + 8
}
