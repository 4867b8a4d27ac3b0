//! The kernels of the picture's cells, mixed from those of the field nodes around.

use glam::DVec2;

use super::add::Taps;
use super::halo::Parts;
use crate::render::kernels::KernelBank;
use crate::sensor::Sensor;

/// Side of the cells that have one kernel per layer, px: kernels change slowly over the field.
pub(super) const CELL: usize = 16;
/// Cells along each side that share their halo.
pub(super) const HALO_CELLS: i32 = 4;

/// Nodes and their weights.
pub(super) type Around = [(usize, f64); 4];

/// Kernels of a bank, in their parts. Cells are counted from the picture's first pixel.
pub(super) struct CellKernels<'a, const L: usize> {
    pub bank: &'a KernelBank,
    /// Of each depth of the bank.
    parts: &'a [Parts],
    sensor: &'a Sensor,
    subpixels: usize,
    /// `[node][sub-pixel]`: change of the centroid per layer, px.
    drift: Vec<DVec2>,
}

impl<'a, const L: usize> CellKernels<'a, L> {
    /// Of a bank and its parts.
    pub fn new((bank, parts): (&'a KernelBank, &'a [Parts]), sensor: &'a Sensor) -> Self {
        let subpixels = bank.subpixels().count();
        let (nx, ny) = bank.size();
        let channel = (bank.channels() - 1).min(1);
        let last = bank.depths().len() - 1;
        let drift = |k: usize| {
            let (node, s) = (k / subpixels, k % subpixels);
            let [near, far] = [0, last].map(|d| bank.figures(d, node, channel, s).centroid_px);
            let drift = (far - near) / last.max(1) as f64;
            match drift.is_finite() {
                true => drift,
                false => DVec2::ZERO,
            }
        };
        Self {
            bank,
            parts,
            sensor,
            subpixels,
            drift: (0..nx * ny * subpixels).map(drift).collect(),
        }
    }

    /// The nodes around a cell.
    pub fn around(&self, cell: [i32; 2]) -> Around {
        self.around_square(cell, CELL)
    }

    /// The nodes around the middle of a square of the grid of squares of a side.
    fn around_square(&self, square: [i32; 2], side: usize) -> Around {
        let side = side as f64;
        let [x, y] = square.map(|i| (f64::from(i) + 0.5) * side - 0.5);
        self.bank.around(self.sensor.position_mm(x, y))
    }

    /// How each sub-pixel's centroid drifts there per layer, px.
    pub fn drift(&self, around: Around) -> Vec<DVec2> {
        let mut drift = vec![DVec2::ZERO; self.subpixels];
        for (node, weight) in around {
            let own = &self.drift[node * self.subpixels..][..self.subpixels];
            let both = drift.iter_mut().zip(own);
            both.for_each(|(t, d)| *t += weight * *d);
        }
        drift
    }

    /// The core of the kernel there in a layer.
    pub fn core(&self, around: Around, level: usize) -> Taps<L> {
        let depth = &self.bank.depths()[level];
        let (whole, core) = (depth.support(), self.parts[level].core);
        let (left, top) = (core.left - whole.left, core.top - whole.top);
        let lanes = self.bank.lanes();
        let mut taps = Taps::empty(core);
        for (node, weight) in around {
            let rows = depth.of_node(node).chunks_exact(whole.width * lanes);
            let rows = rows.skip(top as usize);
            for (to, from) in taps.values.chunks_exact_mut(core.width).zip(rows) {
                self.mix(to, &from[left as usize * lanes..], weight as f32);
            }
        }
        taps
    }

    /// What is around the cores in a square of [`HALO_CELLS`]² cells in a layer, of a block, if anything.
    pub fn halo(&self, square: [i32; 2], level: usize) -> Option<Taps<L>> {
        let halo = self.parts[level].halo.as_ref()?;
        let mut taps = Taps::empty(halo.support);
        for (node, weight) in self.around_square(square, HALO_CELLS as usize * CELL) {
            self.mix(&mut taps.values, halo.of_node(node), weight as f32);
        }
        Some(taps)
    }

    /// Adds a part of a bank's values to those of all colours.
    fn mix(&self, to: &mut [[f32; L]], from: &[f32], part: f32) {
        let (subpixels, channels) = (self.subpixels, self.bank.channels());
        if self.bank.lanes() == L && channels == 3 {
            let both = to.as_flattened_mut().iter_mut().zip(from);
            return both.for_each(|(t, f)| *t += part * f);
        }
        for (to, from) in to.iter_mut().zip(from.chunks_exact(self.bank.lanes())) {
            for c in 0..3 {
                let from = &from[c.min(channels - 1) * subpixels..][..subpixels];
                let to = &mut to[c * subpixels..][..subpixels];
                to.iter_mut().zip(from).for_each(|(t, f)| *t += part * f);
            }
        }
    }
}
