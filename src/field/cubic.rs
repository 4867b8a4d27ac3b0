//! A field with slopes: cubic between few nodes.

use glam::DVec2;

use super::{FieldGrid, SensorWindowMm, cell};

/// A field that is dear to compute, at few nodes, four a side at least, cubic between them. Its error is at most
/// 3/128 h⁴ times the fourth derivative, and its slopes come with it. Where a value beside a cell is not finite the
/// cell is bilinear.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CubicGrid(FieldGrid);

impl CubicGrid {
    /// Number of nodes along a window of `length_px` pixels, one every so many px.
    pub fn nodes_for(length_px: usize, every_px: usize) -> usize {
        length_px.div_ceil(every_px).clamp(3, 64) + 1
    }

    /// Middles of cells, where the error is largest: of those in the corners, along the edges and in between, nine at
    /// most. Of a field that mirrors itself, those whose mirror image is not among them.
    pub fn tests_mm(
        window: SensorWindowMm,
        (nx, ny): (usize, usize),
        is_mirrored: bool,
    ) -> Vec<DVec2> {
        let tested = if is_mirrored { 2 } else { 3 };
        let along = |nodes: usize| {
            let cells = nodes - 1;
            let tests = [0, cells / 2, cells - 1].into_iter().take(tested);
            tests.map(move |cell| 2.0 * (cell as f64 + 0.5) / cells as f64 - 1.0)
        };
        let half = DVec2::new(window.half_width, window.half_height);
        let places = along(ny).flat_map(|y| along(nx).map(move |x| DVec2::new(x, y)));
        places.map(|at| window.centre + at * half).collect()
    }

    /// A grid of four nodes or more a side; `None` when the length does not fit.
    pub fn new(
        window: SensorWindowMm,
        (nx, ny): (usize, usize),
        components: usize,
        data: Vec<f64>,
    ) -> Option<Self> {
        let grid = FieldGrid::new(window, (nx, ny), components, data)?;
        (nx >= 4 && ny >= 4).then_some(Self(grid))
    }

    /// The field at `xy_mm` within the window, and its slopes along x and y, per mm.
    pub fn sample(&self, xy_mm: DVec2) -> [Vec<f64>; 3] {
        let grid = &self.0;
        let axis = |x: f64, half: f64, n: usize| {
            let (i, f) = cell(x, half, n);
            let first = i.saturating_sub(1).min(n - 4);
            // Slopes per cell to slopes per mm.
            (first, i, f, (n - 1) as f64 / (2.0 * half))
        };
        let offset = xy_mm - grid.window.centre;
        let (i0, i, fx, per_x) = axis(offset.x, grid.window.half_width, grid.nx);
        let (j0, j, fy, per_y) = axis(offset.y, grid.window.half_height, grid.ny);
        let (wx, dx) = lagrange(fx + (i - i0) as f64);
        let (wy, dy) = lagrange(fy + (j - j0) as f64);
        let (lx, ly) = (linear(i - i0, fx), linear(j - j0, fy));
        let count = grid.components;
        let node =
            |a: usize, b: usize| &grid.data[((j0 + b) * grid.nx + i0 + a) * count..][..count];
        // Of values, and of slopes along x and y.
        let weights = |[(wx, dx), (wy, dy)]: [([f64; 4], [f64; 4]); 2], a: usize, b: usize| {
            [wx[a] * wy[b], dx[a] * wy[b] * per_x, wx[a] * dy[b] * per_y]
        };
        let mut out = [0; 3].map(|_| vec![0.0; count]);
        let all = || (0..16).map(|n| (n % 4, n / 4));
        for (a, b) in all() {
            let values = node(a, b);
            for (out, weight) in out.iter_mut().zip(weights([(wx, dx), (wy, dy)], a, b)) {
                (out.iter_mut().zip(values)).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        for k in 0..count {
            // Whatever its weight, a value that is not finite leaves its mark.
            if out[0][k].is_finite() {
                continue;
            }
            let mut sums = [0.0; 3];
            for (a, b) in all() {
                for (sum, weight) in sums.iter_mut().zip(weights([lx, ly], a, b)) {
                    if weight != 0.0 {
                        *sum += weight * node(a, b)[k];
                    }
                }
            }
            (out.iter_mut().zip(sums)).for_each(|(out, sum)| out[k] = sum);
        }
        out
    }
}

/// Weights, and slopes of the weights, of the cubic through values at 0, 1, 2 and 3.
fn lagrange(t: f64) -> ([f64; 4], [f64; 4]) {
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    (
        [
            -b * c * d / 6.0,
            a * c * d / 2.0,
            -a * b * d / 2.0,
            a * b * c / 6.0,
        ],
        [
            -(b * c + b * d + c * d) / 6.0,
            (a * c + a * d + c * d) / 2.0,
            -(a * b + a * d + b * d) / 2.0,
            (a * b + a * c + b * c) / 6.0,
        ],
    )
}

/// The same of the straight line between values `first` and `first` + 1, at the fraction `f`.
fn linear(first: usize, f: f64) -> ([f64; 4], [f64; 4]) {
    let (mut weights, mut slopes) = ([0.0; 4], [0.0; 4]);
    (weights[first], weights[first + 1]) = (1.0 - f, f);
    (slopes[first], slopes[first + 1]) = (-1.0, 1.0);
    (weights, slopes)
}

#[cfg(test)]
mod tests {
    // because tests fail by panicking
    #![allow(clippy::unwrap_used)]
    use super::super::TESTED;
    use super::*;

    #[test]
    fn a_cubic_field_comes_with_its_slopes_and_a_hole_stays_small() {
        let window = TESTED;
        let f = |p: DVec2| 3.0 + p.x.powi(3) - p.y * p.y * p.x + p.y.powi(3);
        let size = (5, 6);
        let node = |k: usize| f(FieldGrid::node_mm(window, size, (k % 5, k / 5)));
        let mut data: Vec<f64> = (0..30).map(node).collect();
        let grid = CubicGrid::new(window, size, 1, data.clone()).unwrap();
        for p in [
            DVec2::new(0.63, -3.1),
            DVec2::new(1.5, 0.0),
            DVec2::new(0.5, -4.0),
        ] {
            let [value, dx, dy] = grid.sample(p);
            assert!((value[0] - f(p)).abs() < 1e-12);
            assert!(
                (dx[0] - (3.0 * p.x * p.x - p.y * p.y)).abs() < 1e-11,
                "{}",
                dx[0]
            );
            assert!((dy[0] - (3.0 * p.y * p.y - 2.0 * p.x * p.y)).abs() < 1e-11);
        }
        // The first node is dark: only the cell that it bounds is.
        data[0] = f64::NAN;
        let grid = CubicGrid::new(window, size, 1, data).unwrap();
        assert!(grid.sample(DVec2::new(0.55, -3.9))[0][0].is_nan());
        let beside = DVec2::new(0.8, -3.9);
        // A straight line along y, an eighth of a cell from its end: t (1 − t)/2 · h² f″ = 0.9.
        assert!((grid.sample(beside)[0][0] - f(beside)).abs() < 1.0);
    }
}
