//! How much of the light enters.

use rustfft::num_complex::Complex64;

use super::lens::{Illumination, LensField};
use super::planar::kz;
use super::spectral::Order;
use super::surface;
use crate::em::PixelStack;

type C = Complex64;

/// How much of the light on a pixel enters its layers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    /// Flux that falls in.
    pub incoming: f64,
    /// Part of it that enters, and what of all is found again.
    pub entering: f64,
    pub balance: f64,
    /// By which all powers below the lens are scaled.
    pub scale: f64,
}

impl Budget {
    /// Of the field of the lens and the flux `entering` the layers below it; light of (u, v), lens of index `n`.
    pub fn new(
        (stack, n, k0): (&PixelStack, C, f64),
        illumination: &Illumination,
        f: &LensField,
        entering: f64,
        [u, v]: [f64; 2],
    ) -> Self {
        let orders = illumination.orders;
        let air = |o: &Order| kz(C::ONE, k0, o.k_perp_squared).re;
        let incoming = air(&orders[illumination.incident]);
        let mut reflected = 0.0;
        for (i, (o, psi)) in orders.iter().zip(&f.at_top).enumerate() {
            let incident = if i == illumination.incident {
                C::ONE
            } else {
                C::ZERO
            };
            reflected += air(o) * (psi - incident).norm_sqr() / incoming;
        }
        let entering = entering / incoming;
        // Reflected and entering light add up to one but for the slices and the residual; the powers are scaled so that
        // they do.
        let balance = reflected + entering;
        // The scalar field was reflected by the lens as s light is; the mean of s and p loses less.
        let gain = surface::transmission_gain(stack, n.re, u, v);
        Self {
            incoming,
            entering,
            balance,
            scale: (gain / balance).min(1.0 / entering),
        }
    }
}

/// A power held to the `most` that it can be, and by which part it was more.
pub(super) fn at_most(power: f64, most: f64) -> (f64, f64) {
    if power > most && most > 0.0 {
        (most, power / most - 1.0)
    } else {
        (power, 0.0)
    }
}
