//! A smooth field over a sensor window: values at the nodes of a regular grid, bilinear between them.
//!
//! Carries whatever changes slowly over the sensor (chief rays, pupil centroids, Jacobians). The error of bilinear
//! interpolation is at most h²/8 times the second derivative; [`FieldGrid::nodes_for`] picks h.

use glam::DVec2;

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
        let (i, fx) = cell(
            xy_mm.x - self.window.centre.x,
            self.window.half_width,
            self.nx,
        );
        let (j, fy) = cell(
            xy_mm.y - self.window.centre.y,
            self.window.half_height,
            self.ny,
        );
        let (i1, j1) = ((i + 1).min(self.nx - 1), (j + 1).min(self.ny - 1));
        let node = |i: usize, j: usize| {
            &self.data[(j * self.nx + i) * self.components..][..self.components]
        };
        let (a, b, c, d) = (node(i, j), node(i1, j), node(i, j1), node(i1, j1));
        for (k, o) in out.iter_mut().enumerate().take(self.components) {
            let top = a[k] + fx * (b[k] - a[k]);
            let bottom = c[k] + fx * (d[k] - c[k]);
            *o = top + fy * (bottom - top);
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
    let i = (f as usize).min(n - 2);
    (i, f - i as f64)
}

#[cfg(test)]
mod tests {
    // because tests fail by panicking
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_bilinear_field_is_reproduced_and_clamped_outside() {
        let window = SensorWindowMm {
            centre: DVec2::new(1.0, -2.0),
            half_width: 0.5,
            half_height: 2.0,
        };
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
        }
        grid.sample(DVec2::new(9.0, 9.0), &mut out);
        assert!((out[0] - f(DVec2::new(1.5, 0.0))).abs() < 1e-12);
    }
}
