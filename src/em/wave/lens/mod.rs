//! The field in the lens, reflections and all: the Lippmann-Schwinger equation of the scalar wave equation,
//!
//! `(∂z² + ∇⊥² + k0² ε) ψ = 0`,  `ψ = ψ_b + ∫ G V ψ dz`,  `V = k0² (ε − ε_b)`,
//!
//! by FFT in the plane and plane-wave orders in depth. ε_b is a uniform background that fills the region from the apex
//! (z = 0) to the lens's lowest point (z = D), with air above and the flat stack below. For an order of wavenumber k in
//! the background, `G(z, z') = (i/2k) e^(ik|z−z'|)` and what the two ends throw back (r_t at z = 0, r_b at z = D), so
//! every round trip between silicon, stack and lens is in it. Applying G costs one sweep down and one up.
//!
//! Slices are Δz thick with V at half height ([`potential`]). Solved by GMRES, preconditioned with beam propagation
//! ([`scattering`]).

mod potential;
mod scattering;

use rustfft::num_complex::{Complex32, Complex64};

use super::krylov::gmres;
use super::spectral::{Order, Transforms};
use crate::em::PixelStack;
use scattering::{Ends, Scattering, Work};

type C = Complex64;
/// The field inside the region is f32: it is solved to 1e-2 or 1e-3, and the solver is bound by memory.
type S = Complex32;

/// GMRES steps after which the residual is taken as it is.
const MOST_STEPS: usize = 150;

/// Fewest slices per wavelength in the lens. Of 20,000 random pixels the light found and lost in the slices was at most
/// 0.71 of all with 100 nm, 0.16 with four slices per wavelength, 0.07 with six
/// (benches/runs/2026-11-30/slices.md).
const LEAST_SLICES_PER_WAVELENGTH: f64 = 4.0;

/// The lens region of one pixel at one wavelength (independent of the angle).
pub(super) struct LensRegion {
    k0: f64,
    background: C,
    depth_um: f64,
    slices: usize,
    /// V for the sum over slices, `[slice][y][x]`; x = index × pitch / grid from the lens's centre.
    potential: Vec<S>,
    /// e^(iVΔz/2k) − 1 with k of the background, for the rough inverse.
    screen: Vec<S>,
    fft: Transforms,
}

/// What lights the lens, and what lies below it.
pub(super) struct Illumination<'a> {
    pub orders: &'a [Order],
    /// The order in which light of unit amplitude falls in.
    pub incident: usize,
    /// Index of the medium below.
    pub resin: C,
    /// What the layers below reflect, per order, seen in the resin at z = D.
    pub stack: &'a [C],
}

/// The field at the ends of the lens region, per order.
pub(super) struct LensField {
    pub at_top: Vec<C>,
    pub at_bottom: Vec<C>,
    /// Relative residual of the solution.
    pub residual: f64,
}

impl LensRegion {
    pub fn new(stack: &PixelStack, n: C, k0: f64, slice_um: f64, grid: usize) -> Self {
        let depth_um = stack.sag_um();
        let wavelengths = depth_um * n.re * k0 / (2.0 * std::f64::consts::PI);
        let slices = (depth_um / slice_um).max(LEAST_SLICES_PER_WAVELENGTH * wavelengths);
        let slices = (slices.ceil() as usize).max(1);
        let dz = depth_um / slices as f64;
        let eps = n * n;
        // Any background gives the same field. One with loss (V takes it out again) lets no light run round in the
        // region between solver steps, which quarters their number; more than this needs thinner slices.
        let background = 1.0 + (eps - 1.0) * 0.75 + C::new(0.0, 1.0);
        let potential = potential::of_slices(stack, [eps, background], k0, slices, grid);
        Self {
            k0,
            background,
            depth_um,
            slices,
            fft: Transforms::new(grid),
            screen: potential
                .iter()
                .map(|v| single((C::I * v * dz / (2.0 * k0 * background.sqrt())).exp() - 1.0))
                .collect(),
            potential: potential.into_iter().map(single).collect(),
        }
    }

    /// The field under `illumination`, with waves `upward` (amplitude ψ in the resin at z = D) from below. `field` is
    /// the start and the result, as orders of every slice; empty for no start.
    pub fn solve(
        &self,
        illumination: &Illumination,
        upward: &[C],
        field: &mut Vec<S>,
        tolerance: f64,
    ) -> LensField {
        let orders = illumination.orders;
        let ends: Vec<Ends> = orders
            .iter()
            .zip(illumination.stack)
            .map(|(o, &r)| self.ends(o, illumination.resin, r))
            .collect();
        let count = orders.len();
        let mut start = vec![S::ZERO; self.slices * count];
        let dz = self.depth_um / self.slices as f64;
        let (mut from_top, mut from_bottom) = (vec![C::ZERO; count], vec![C::ZERO; count]);
        for (i, e) in ends.iter().enumerate() {
            let enters = if i == illumination.incident {
                e.enters
            } else {
                C::ZERO
            };
            let rises = upward[i] * e.rises;
            // Waves launched at either end, all round trips between them.
            let (top, bottom, across) = (double(e.top), double(e.bottom), double(e.across));
            let down = (enters + top * across * rises) * double(e.loops);
            let up = rises + bottom * across * down;
            (from_top[i], from_bottom[i]) = (down, up);
            for j in 0..self.slices {
                let z = (j as f64 + 0.5) * dz;
                start[j * count + i] = single(
                    down * (C::I * e.k * z).exp() + up * (C::I * e.k * (self.depth_um - z)).exp(),
                );
            }
        }
        if field.len() != start.len() {
            field.clone_from(&start);
        }
        let mut system = Scattering {
            work: Work::new(self, orders),
            ends: &ends,
        };
        let residual = gmres(&mut system, &start, field, tolerance, MOST_STEPS);
        let mut work = system.work;
        let mut scattered = vec![S::ZERO; start.len()];
        self.scatter(&mut work, &ends, field, &mut scattered);
        let mut at_top = Vec::with_capacity(count);
        let mut at_bottom = Vec::with_capacity(count);
        for (i, e) in ends.iter().enumerate() {
            let (down, up) = (
                from_top[i] + double(work.launched_down[i]),
                from_bottom[i] + double(work.launched_up[i]),
            );
            at_top.push(down + double(work.up[i]) + double(e.across) * up);
            at_bottom.push(double(e.across) * down + double(work.down[i]) + up);
        }
        LensField {
            at_top,
            at_bottom,
            residual,
        }
    }
}

fn single(z: C) -> S {
    S::new(z.re as f32, z.im as f32)
}

fn double(z: S) -> C {
    C::new(f64::from(z.re), f64::from(z.im))
}
