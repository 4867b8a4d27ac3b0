//! A smooth field over a sensor window: values at the nodes of a regular grid, bilinear between them.
//!
//! Carries whatever changes slowly over the sensor (chief rays, pupil centroids, Jacobians). The error of bilinear
//! interpolation is at most h²/8 times the second derivative; [`FieldGrid::nodes_for`] picks h.

mod cubic;

use glam::DVec2;

pub(crate) use cubic::CubicGrid;

/// A rectangle on the sensor, sensor frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorWindowMm {
    /// Its centre.
    pub centre: DVec2,
    /// Half its width.
    pub half_width: f64,
    /// Half its height.
    pub half_height: f64,
}

impl SensorWindowMm {
    /// Whether what is the same around the optical axis mirrors itself in both of the window's middle lines.
    pub(crate) fn is_on_axis(&self) -> bool {
        self.centre == DVec2::ZERO
    }
}

/// Of a row-major node of nx × ny over a window on the axis: the node of the first quarter that it mirrors, and the
/// signs of x and y that take what is there to it.
pub(crate) fn mirrored(node: usize, (nx, ny): (usize, usize)) -> (usize, DVec2) {
    let along = |i: usize, side: usize| match 2 * i < side {
        true => (i, 1.0),
        false => (side - 1 - i, -1.0),
    };
    let ((column, x), (row, y)) = (along(node % nx, nx), along(node / nx, ny));
    (row * nx + column, DVec2::new(x, y))
}

/// `components` values at each of nx × ny nodes that span a window.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldGrid {
    window: SensorWindowMm,
    nx: usize,
    ny: usize,
    components: usize,
    data: Vec<f64>,
}

impl FieldGrid {
    /// Number of nodes along a window of `length_px` pixels: one every 16 px, between 2 and 65.
    pub fn nodes_for(length_px: usize) -> usize {
        length_px.div_ceil(16).clamp(1, 64) + 1
    }

    /// Position of node (i, j) of an nx × ny grid over `window`, sensor frame, mm.
    pub fn node_mm(
        window: SensorWindowMm,
        (nx, ny): (usize, usize),
        (i, j): (usize, usize),
    ) -> DVec2 {
        let at = |i: usize, n: usize| {
            if n > 1 {
                2.0 * i as f64 / (n - 1) as f64 - 1.0
            } else {
                0.0
            }
        };
        window.centre
            + DVec2::new(
                at(i, nx) * window.half_width,
                at(j, ny) * window.half_height,
            )
    }

    /// Position of a node by its row-major number, sensor frame, mm.
    pub fn place_mm(&self, node: usize) -> DVec2 {
        Self::node_mm(
            self.window,
            (self.nx, self.ny),
            (node % self.nx, node / self.nx),
        )
    }

    /// A grid from node values in row-major order (components innermost); `None` when the length does not fit.
    pub fn new(
        window: SensorWindowMm,
        (nx, ny): (usize, usize),
        components: usize,
        data: Vec<f64>,
    ) -> Option<Self> {
        let fits = nx > 0 && ny > 0 && components > 0 && data.len() == nx * ny * components;
        fits.then_some(Self {
            window,
            nx,
            ny,
            components,
            data,
        })
    }

    /// The window.
    pub fn window(&self) -> SensorWindowMm {
        self.window
    }

    /// Values per node.
    pub fn components(&self) -> usize {
        self.components
    }

    /// All node values, row-major, components innermost.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// Writes the field at `xy_mm` (clamped to the window) into `out`.
    #[inline]
    pub fn sample(&self, xy_mm: DVec2, out: &mut [f64]) {
        let count = self.components.min(out.len());
        self.sample_from(xy_mm, 0, &mut out[..count]);
    }

    /// Writes the components from `first` on of the field at `xy_mm` (clamped to the window) into `out`: as many as it
    /// holds.
    #[inline]
    pub(crate) fn sample_from(&self, xy_mm: DVec2, first: usize, out: &mut [f64]) {
        let [(i, fx), (j, fy)] = self.cells(xy_mm);
        let (i1, j1) = ((i + 1).min(self.nx - 1), (j + 1).min(self.ny - 1));
        let node = |i: usize, j: usize| {
            &self.data[(j * self.nx + i) * self.components + first..][..out.len()]
        };
        let (a, b, c, d) = (node(i, j), node(i1, j), node(i, j1), node(i1, j1));
        for (k, o) in out.iter_mut().enumerate() {
            let top = a[k] + fx * (b[k] - a[k]);
            let bottom = c[k] + fx * (d[k] - c[k]);
            *o = top + fy * (bottom - top);
        }
    }

    /// So many of its components from `first` on along the line of a y (clamped to the window).
    pub(crate) fn row(&self, y_mm: f64, first: usize, count: usize) -> FieldRow {
        let (window, components) = (self.window, self.components);
        let (j, fy) = cell(y_mm - window.centre.y, window.half_height, self.ny);
        let row = |j: usize| self.data[j * self.nx * components..].chunks_exact(components);
        let nodes = row(j).zip(row((j + 1).min(self.ny - 1))).take(self.nx);
        let mut data = Vec::with_capacity(self.nx * count);
        for (a, b) in nodes {
            let pairs = a[first..][..count].iter().zip(&b[first..][..count]);
            data.extend(pairs.map(|(a, b)| a + fy * (b - a)));
        }
        FieldRow {
            middle_mm: window.centre.x,
            half_mm: window.half_width,
            nx: self.nx,
            components: count,
            data,
        }
    }

    /// The four nodes (row-major numbers) around `xy_mm` (clamped to the window) and their bilinear weights.
    pub fn around(&self, xy_mm: DVec2) -> [(usize, f64); 4] {
        let [(i, fx), (j, fy)] = self.cells(xy_mm);
        let (i1, j1) = ((i + 1).min(self.nx - 1), (j + 1).min(self.ny - 1));
        let node = |i: usize, j: usize| j * self.nx + i;
        [
            (node(i, j), (1.0 - fx) * (1.0 - fy)),
            (node(i1, j), fx * (1.0 - fy)),
            (node(i, j1), (1.0 - fx) * fy),
            (node(i1, j1), fx * fy),
        ]
    }

    /// Column and row of the cell that holds `xy_mm`, and the part of each that lies before it.
    #[inline]
    fn cells(&self, xy_mm: DVec2) -> [(usize, f64); 2] {
        let offset = xy_mm - self.window.centre;
        [
            cell(offset.x, self.window.half_width, self.nx),
            cell(offset.y, self.window.half_height, self.ny),
        ]
    }
}

/// A field along a line of one y: what is the same all along is done once.
#[derive(Clone, Debug)]
pub(crate) struct FieldRow {
    middle_mm: f64,
    half_mm: f64,
    nx: usize,
    components: usize,
    data: Vec<f64>,
}

impl FieldRow {
    /// Values per place.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Writes its components at an x (clamped to the window) into `out`: as many as it holds.
    #[inline]
    pub fn sample(&self, x_mm: f64, out: &mut [f64]) {
        let (i, fx) = cell(x_mm - self.middle_mm, self.half_mm, self.nx);
        let node = |i: usize| &self.data[i * self.components..][..self.components];
        let (a, b) = (node(i), node((i + 1).min(self.nx - 1)));
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a + fx * (b - a);
        }
    }
}

/// Cell and fraction of offset `x` from the centre on n nodes over ±half.
#[inline]
fn cell(x: f64, half: f64, n: usize) -> (usize, f64) {
    if n < 2 || half <= 0.0 {
        return (0, 0.0);
    }
    let f = ((x / half + 1.0) * 0.5 * (n - 1) as f64).clamp(0.0, (n - 1) as f64);
    // To 32 bits: a single instruction, to 64 many.
    let i = (f as i32 as usize).min(n - 2);
    (i, f - f64::from(i as i32))
}

/// The window of the tests.
#[cfg(test)]
const TESTED: SensorWindowMm = SensorWindowMm {
    centre: DVec2::new(1.0, -2.0),
    half_width: 0.5,
    half_height: 2.0,
};

#[cfg(test)]
mod tests {
    // because tests fail by panicking
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_bilinear_field_is_reproduced_and_clamped_outside() {
        let window = TESTED;
        let f = |p: DVec2| 3.0 + 2.0 * p.x - p.y + 0.5 * p.x * p.y;
        let size = (5, 4);
        let data: Vec<f64> = (0..4)
            .flat_map(|j| (0..5).map(move |i| f(FieldGrid::node_mm(window, size, (i, j)))))
            .collect();
        let grid = FieldGrid::new(window, size, 1, data).unwrap();
        let mut out = [0.0];
        for p in [
            DVec2::new(0.63, -3.1),
            DVec2::new(1.5, 0.0),
            DVec2::new(1.2, -0.4),
        ] {
            grid.sample(p, &mut out);
            assert!((out[0] - f(p)).abs() < 1e-12);
            grid.row(p.y, 0, 1).sample(p.x, &mut out);
            assert!((out[0] - f(p)).abs() < 1e-12);
        }
        grid.sample(DVec2::new(9.0, 9.0), &mut out);
        assert!((out[0] - f(DVec2::new(1.5, 0.0))).abs() < 1e-12);
    }
}
