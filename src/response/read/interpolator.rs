//! Bilinear lookup in one wavelength's table: the renderer's inner loop.

use super::axes::{Axes, Cell};
use crate::sensor::{MovingFrame, Subpixels, by_count};

/// Directions whose cells are found together.
const TOGETHER: usize = 64;
/// Parts of the largest value by which mirror images may differ.
const MIRRORED: f32 = 1e-6;

/// P_i(u, v) of the centred lens at one wavelength. Made by [`crate::response::AngularResponse::interpolator`].
#[derive(Clone, Debug)]
pub struct Interpolator {
    subpixels: Subpixels,
    frame: MovingFrame,
    axes: Axes,
    /// [v][u][sub-pixel]
    plane: Vec<f32>,
}

impl Interpolator {
    /// Of a plane `[v][u][sub-pixel]` over the axes.
    pub(super) fn new(
        subpixels: Subpixels,
        frame: MovingFrame,
        axes: Axes,
        plane: Vec<f32>,
    ) -> Self {
        Self {
            subpixels,
            frame,
            axes,
            plane,
        }
    }

    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }
    /// How a lens shift moves the response.
    pub fn frame(&self) -> MovingFrame {
        self.frame
    }

    /// Whether mirrored directions have mirrored sub-pixels, to a millionth of the largest value.
    pub fn is_mirrored(&self) -> bool {
        let Axes { nu, nv, .. } = self.axes;
        let (subpixels, count) = (self.subpixels, self.subpixels.count());
        let largest = self.plane.iter().fold(0f32, |m, p| m.max(p.abs()));
        let near = |a: f32, b: f32| (a - b).abs() <= MIRRORED * largest;
        self.plane.iter().enumerate().all(|(at, &value)| {
            let (node, s) = (at / count, at % count);
            let (i, j) = (node % nu, node / nu);
            let across = (j * nu + nu - 1 - i) * count + subpixels.mirrored(s, [true, false]);
            let down = ((nv - 1 - j) * nu + i) * count + subpixels.mirrored(s, [false, true]);
            near(self.plane[across], value) && near(self.plane[down], value)
        })
    }

    /// The weights of one direction; `out` has one place per sub-pixel (more are left alone).
    pub fn weights(&self, u: f32, v: f32, out: &mut [f32]) {
        let count = self.subpixels.count();
        if let Some(out) = out.get_mut(..count) {
            self.weights_batch(&[u], &[v], out);
        }
    }

    /// The weights of many directions: `out` is `[direction][sub-pixel]`. The shortest of the three slices counts.
    pub fn weights_batch(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        by_count!(self.subpixels.count(), self.batch(u, v, out));
    }

    #[inline]
    fn batch<const N: usize>(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        let (nodes, _) = self.plane.as_chunks::<N>();
        let (out, _) = out.as_chunks_mut::<N>();
        let n = u.len().min(v.len()).min(out.len());
        let (u, v, out) = (&u[..n], &v[..n], &mut out[..n]);
        let axes = self.axes;
        // The cells of some directions first: then the processor fetches the nodes of many at a time.
        let mut cells = [Cell::default(); TOGETHER];
        let directions = u.chunks(TOGETHER).zip(v.chunks(TOGETHER));
        for ((u, v), out) in directions.zip(out.chunks_mut(TOGETHER)) {
            for ((cell, &u), &v) in cells.iter_mut().zip(u).zip(v) {
                *cell = axes.cell(axes.scale, u, v);
            }
            for (cell, out) in cells.iter().zip(out) {
                let at = cell.j * axes.nu + cell.i;
                // Two rows of two neighbouring nodes, each one contiguous read.
                let (r0, r1) = (&nodes[at..at + 2], &nodes[at + axes.nu..at + axes.nu + 2]);
                let [w00, w10, w01, w11] = cell.weights;
                for k in 0..N {
                    out[k] = w00 * r0[0][k] + w10 * r0[1][k] + w01 * r1[0][k] + w11 * r1[1][k];
                }
            }
        }
    }
}
