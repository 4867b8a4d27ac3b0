//! Bilinear lookup in one wavelength's table: the renderer's inner loop.
//!
//! Bilinear weights are ≥ 0 and sum to 1, so 0 ≤ P_i and Σ P_i ≤ 1 carry over from the nodes (to rounding). Directions
//! beyond the axes read the edge. Plain multiplies and adds, no fused ones: the same bits on every CPU.

use crate::sensor::{MovingFrame, Subpixels};

/// P_i(u, v) of the centred lens at one wavelength. Made by [`crate::response::AngularResponse::interpolator`].
#[derive(Clone, Debug)]
pub struct Interpolator {
    subpixels: Subpixels,
    frame: MovingFrame,
    nu: usize,
    nv: usize,
    /// place on the axis = cosine × scale + centre
    scale: [f32; 2],
    centre: [f32; 2],
    /// [v][u][sub-pixel]
    plane: Vec<f32>,
}

impl Interpolator {
    /// Axes as (count, last value). The caller (a checked table) guarantees counts ≥ 3 and the plane's length.
    pub(super) fn new(
        subpixels: Subpixels,
        frame: MovingFrame,
        (nu, u_end): (usize, f32),
        (nv, v_end): (usize, f32),
        plane: Vec<f32>,
    ) -> Self {
        let (cu, cv) = ((nu / 2) as f32, (nv / 2) as f32);
        Self {
            subpixels,
            frame,
            nu,
            nv,
            scale: [cu / u_end, cv / v_end],
            centre: [cu, cv],
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

    /// The weights of one direction; `out` has one place a sub-pixel (more are left alone).
    pub fn weights(&self, u: f32, v: f32, out: &mut [f32]) {
        let count = self.subpixels.count();
        if let Some(out) = out.get_mut(..count) {
            self.weights_batch(&[u], &[v], out);
        }
    }

    /// The weights of many directions: `out` is `[direction][sub-pixel]`. The shortest of the three slices counts.
    pub fn weights_batch(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        match self.subpixels.count() {
            1 => self.batch::<1>(u, v, out),
            2 => self.batch::<2>(u, v, out),
            4 => self.batch::<4>(u, v, out),
            9 => self.batch::<9>(u, v, out),
            _ => self.batch::<16>(u, v, out),
        }
    }

    #[inline]
    fn batch<const N: usize>(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        let (nodes, _) = self.plane.as_chunks::<N>();
        let (out, _) = out.as_chunks_mut::<N>();
        let (last_u, last_v) = ((self.nu - 1) as f32, (self.nv - 1) as f32);
        for ((&u, &v), out) in u.iter().zip(v).zip(out) {
            let x = (u * self.scale[0] + self.centre[0]).clamp(0.0, last_u);
            let y = (v * self.scale[1] + self.centre[1]).clamp(0.0, last_v);
            let i = (x as usize).min(self.nu - 2);
            let j = (y as usize).min(self.nv - 2);
            let (a, b) = (x - i as f32, y - j as f32);
            let at = j * self.nu + i;
            // Two rows of two neighbouring nodes, each one contiguous read.
            let (r0, r1) = (&nodes[at..at + 2], &nodes[at + self.nu..at + self.nu + 2]);
            let w00 = (1.0 - a) * (1.0 - b);
            let w10 = a * (1.0 - b);
            let w01 = (1.0 - a) * b;
            let w11 = a * b;
            for k in 0..N {
                out[k] = w00 * r0[0][k] + w10 * r0[1][k] + w01 * r1[0][k] + w11 * r1[1][k];
            }
        }
    }
}
