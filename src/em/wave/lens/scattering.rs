//! What a lens region's sources send out, reflections at its ends and all, and a rough inverse of it.

use super::{C, LensRegion, S, single};
use crate::em::wave::krylov::System;
use crate::em::wave::planar::kz;
use crate::em::wave::spectral::{Order, Product};

/// What an order meets at the two ends of the region.
pub(super) struct Ends {
    pub k: C,
    /// (i/2k) Δz: what a source of one slice sends out.
    pub strength: S,
    /// Phase of a slice and of half of one.
    pub step: S,
    pub half_step: S,
    /// Longer way of a steep order through a slice, for the rough inverse; held down near grazing.
    pub obliquity: S,
    pub top: S,
    pub bottom: S,
    pub across: S,
    pub loops: S,
    pub enters: C,
    pub rises: C,
}

/// Scratch of one solution.
pub(super) struct Work<'a> {
    region: &'a LensRegion,
    product: Product<'a>,
    sources: Vec<S>,
    pub down: Vec<S>,
    pub up: Vec<S>,
    pub launched_down: Vec<S>,
    pub launched_up: Vec<S>,
    falling: Vec<S>,
    rising: Vec<S>,
}

impl<'a> Work<'a> {
    pub fn new(region: &'a LensRegion, orders: &[Order]) -> Self {
        let zeros = |n: usize| vec![S::ZERO; n];
        let n = orders.len();
        Self {
            region,
            product: Product::new(&region.fft, orders),
            sources: zeros(n * region.slices),
            down: zeros(n),
            up: zeros(n),
            launched_down: zeros(n),
            launched_up: zeros(n),
            falling: zeros(n),
            rising: zeros(n),
        }
    }
}

/// ψ − ∫ G V ψ.
pub(super) struct Scattering<'a> {
    pub work: Work<'a>,
    pub ends: &'a [Ends],
}

impl System<f32> for Scattering<'_> {
    fn apply(&mut self, x: &[S], y: &mut [S]) {
        let region = self.work.region;
        region.scatter(&mut self.work, self.ends, x, y);
        for (y, x) in y.iter_mut().zip(x) {
            *y = x - *y;
        }
    }
    fn precondition(&mut self, x: &[S], y: &mut [S]) {
        let region = self.work.region;
        region.one_way(&mut self.work, self.ends, x, y);
    }
}

impl LensRegion {
    pub(super) fn ends(&self, order: &Order, resin: C, stack: C) -> Ends {
        let air = kz(C::ONE, self.k0, order.k_perp_squared);
        let k = kz(self.background.sqrt(), self.k0, order.k_perp_squared);
        let below = kz(resin, self.k0, order.k_perp_squared);
        let top = (k - air) / (k + air);
        let step = (k - below) / (k + below);
        let bottom = (step + stack) / (1.0 + step * stack);
        let across = (C::I * k * self.depth_um).exp();
        let dz = self.depth_um / self.slices as f64;
        let ratio = self.background.sqrt() * self.k0 / k;
        Ends {
            strength: single(C::I * dz / (2.0 * k)),
            step: single((C::I * k * dz).exp()),
            half_step: single((C::I * k * (0.5 * dz)).exp()),
            obliquity: single(ratio * (2.0 / ratio.norm()).min(1.0)),
            k,
            top: single(top),
            bottom: single(bottom),
            across: single(across),
            loops: single(1.0 / (1.0 - top * bottom * across * across)),
            enters: 2.0 * air / (air + k),
            rises: 2.0 * below / ((below + k) * (1.0 + step * stack)),
        }
    }

    /// What the sources `x` become on their way, down and up, when nothing is reflected: each slice is a thin phase
    /// screen (beam propagation). The rough inverse that takes the forward scattering off the solver.
    fn one_way(&self, work: &mut Work, ends: &[Ends], x: &[S], out: &mut [S]) {
        let count = ends.len();
        let cells = self.fft.grid * self.fft.grid;
        out.copy_from_slice(x);
        let mut total = std::mem::take(&mut work.falling);
        let mut scattered = std::mem::take(&mut work.rising);
        work.down.fill(S::ZERO);
        for upward in [false, true] {
            if upward {
                // Half a slice past the last plane and half a slice back: what comes down, reflected, at the last
                // plane.
                for (d, e) in work.down.iter_mut().zip(ends) {
                    *d *= e.bottom;
                }
            }
            for turn in 0..self.slices {
                let j = if upward { self.slices - 1 - turn } else { turn };
                let slice = j * count..(j + 1) * count;
                for i in 0..count {
                    total[i] = x[slice.start + i] + work.down[i];
                }
                for (o, d) in out[slice].iter_mut().zip(&work.down) {
                    *o += d;
                }
                work.product.multiply(
                    &self.screen[j * cells..(j + 1) * cells],
                    &total,
                    &mut scattered,
                );
                for i in 0..count {
                    work.down[i] = ends[i].step * (work.down[i] + ends[i].obliquity * scattered[i]);
                }
            }
        }
        work.falling = total;
        work.rising = scattered;
    }

    /// out = ∫ G V x dz at the slices; leaves in `work` what reaches the ends and what they launch.
    pub(super) fn scatter(&self, work: &mut Work, ends: &[Ends], x: &[S], out: &mut [S]) {
        let count = ends.len();
        let cells = self.fft.grid * self.fft.grid;
        for j in 0..self.slices {
            let slice = j * count..(j + 1) * count;
            work.product.multiply(
                &self.potential[j * cells..(j + 1) * cells],
                &x[slice.clone()],
                &mut out[slice],
            );
        }
        work.down.fill(S::ZERO);
        work.up.fill(S::ZERO);
        for j in 0..self.slices {
            let (out, sources) = (
                &mut out[j * count..(j + 1) * count],
                &mut work.sources[j * count..(j + 1) * count],
            );
            for i in 0..count {
                let s = out[i] * ends[i].strength;
                sources[i] = s;
                work.down[i] = work.down[i] * ends[i].step + s;
                out[i] = work.down[i];
            }
        }
        for j in (0..self.slices).rev() {
            let (out, sources) = (
                &mut out[j * count..(j + 1) * count],
                &work.sources[j * count..(j + 1) * count],
            );
            for i in 0..count {
                let above = work.up[i] * ends[i].step;
                out[i] += above;
                work.up[i] = above + sources[i];
            }
        }
        for (i, e) in ends.iter().enumerate() {
            work.down[i] *= e.half_step;
            work.up[i] *= e.half_step;
            let (a, b) = (work.down[i], work.up[i]);
            let down = e.top * (b + e.across * e.bottom * a) * e.loops;
            work.launched_down[i] = down;
            work.launched_up[i] = e.bottom * (a + e.across * down);
            work.falling[i] = down * e.half_step;
            work.rising[i] = work.launched_up[i] * e.half_step;
        }
        for j in 0..self.slices {
            for (i, o) in out[j * count..(j + 1) * count].iter_mut().enumerate() {
                *o += work.falling[i];
                work.falling[i] *= ends[i].step;
            }
        }
        for j in (0..self.slices).rev() {
            for (i, o) in out[j * count..(j + 1) * count].iter_mut().enumerate() {
                *o += work.rising[i];
                work.rising[i] *= ends[i].step;
            }
        }
    }
}
