//! Modes of the silicon by Bloch wavenumber and axis: angles on a grid share them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rustfft::num_complex::Complex64;

use super::modes::{AxisModes, Trenches};
use crate::em::PixelStack;

type C = Complex64;

/// The modes that were found, and how to find the others.
pub(super) struct KeptModes {
    period_um: f64,
    trench_um: f64,
    /// At splits and borders.
    uncollected_um: [f64; 2],
    /// Microlenses along an axis of the period.
    cells: usize,
    /// k0² (Re ε_si − Re ε_trench) in 1/µm².
    barrier: f64,
    /// Largest transverse wavenumber of their Fourier series, 1/µm.
    cutoff: f64,
    /// The same of modes that are asked for their absorption.
    absorbing: f64,
    kept: Mutex<HashMap<(u64, usize), Arc<AxisModes>>>,
}

impl KeptModes {
    pub fn new(stack: &PixelStack, [silicon, trench]: [C; 2], k0: f64, cutoff: f64) -> Self {
        Self {
            period_um: stack.period_um(),
            trench_um: stack.trench_um,
            uncollected_um: stack.uncollected_um(),
            cells: stack.microlenses_across(),
            barrier: k0 * k0 * ((silicon * silicon).re - (trench * trench).re),
            cutoff,
            absorbing: silicon.re * k0,
            kept: Mutex::default(),
        }
    }

    /// Of a pixel of so many photodiodes along the axis.
    pub fn at(&self, bloch: f64, parts_of_pixel: usize) -> Arc<AxisModes> {
        // A poisoned lock only means that another thread stopped; the map is whole between insertions.
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (bloch.to_bits(), parts_of_pixel);
        if let Some(modes) = kept().get(&key) {
            return Arc::clone(modes);
        }
        let trenches = Trenches {
            pitch_um: self.period_um,
            width_um: self.trench_um,
            uncollected_um: self.uncollected_um,
            parts: parts_of_pixel * self.cells,
            parts_of_pixel,
            barrier: self.barrier,
        };
        let modes = AxisModes::new(&trenches, bloch, self.cutoff, self.absorbing);
        let modes = Arc::new(modes);
        kept().insert(key, Arc::clone(&modes));
        modes
    }
}
