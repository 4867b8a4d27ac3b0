//! What the Fourier modal level answers.

use serde::{Deserialize, Serialize};

/// Where the light of one polarization goes, as parts of the power that falls on the period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RcwaPowers {
    /// Absorbed per sub-pixel, by volume integral (see [`crate::sensor::Subpixels`] for the order); of a mosaic microlens by microlens
    /// ([`crate::em::mosaic`]).
    pub absorbed: Vec<f64>,
    /// The same in all, by the loss of flux on the way through the counted silicon. (Where trenches absorb, what they do is known by this
    /// difference only, and the two are equal.)
    pub absorbed_by_flux: f64,
    /// Reflected into all orders in air.
    pub reflected: f64,
    /// Passing below the counted silicon.
    pub transmitted: f64,
    /// Absorbed elsewhere: in lens, layers, walls and trenches.
    pub elsewhere: f64,
}

impl RcwaPowers {
    /// Sum of all powers, the photodiodes' by volume integral; 1 for an exact solution.
    pub fn balance(&self) -> f64 {
        self.reflected + self.transmitted + self.elsewhere + self.absorbed.iter().sum::<f64>()
    }
}

/// What was found for one direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RcwaAnswer {
    /// E across the plane of incidence (along y at u = v = 0).
    pub s: RcwaPowers,
    /// E in the plane of incidence (along x at u = v = 0).
    pub p: RcwaPowers,
    /// Functions followed in silicon for one polarization (a mirror of the pixel halves them).
    pub functions: usize,
    /// Wall clock; of shifts solved together, an equal part.
    pub seconds: f64,
}

impl RcwaAnswer {
    /// Largest difference, as a part of the incident power, of what the photodiodes absorb by volume and by flux.
    pub fn residual(&self) -> f64 {
        let off = |p: &RcwaPowers| (p.absorbed.iter().sum::<f64>() - p.absorbed_by_flux).abs();
        off(&self.s).max(off(&self.p))
    }
}
