//! What a run answers: powers by wavelength and polarization, and what it took.

use serde::{Deserialize, Serialize};

/// Deviation of the energy balance from 1 that a run may have; [`FdtdRun::warnings`] names others.
pub const BALANCE: f64 = 0.01;

/// Where the light of one polarization goes, as parts of the power that falls on the period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FdtdPowers {
    /// Absorbed per sub-pixel, by volume integral (see [`crate::sensor::Subpixels`] for the order); of a mosaic microlens by microlens
    /// ([`crate::em::mosaic`]).
    pub absorbed: Vec<f64>,
    /// The same by the flux through the six faces of its box, less what its trenches absorb.
    pub absorbed_by_flux: Vec<f64>,
    /// Reflected into all orders in air.
    pub reflected: f64,
    /// Passing below the counted silicon.
    pub transmitted: f64,
    /// Absorbed elsewhere: in layers, lens, walls and trenches.
    pub elsewhere: f64,
    /// Sum of all of these; 1 for an exact run.
    pub balance: f64,
}

/// Powers at one wavelength.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FdtdAnswer {
    /// Wavelength in nm.
    pub wavelength_nm: f64,
    /// Direction cosines k∥/k0 at this wavelength.
    pub uv: [f64; 2],
    /// E across the plane of incidence (along y at u = v = 0).
    pub s: FdtdPowers,
    /// E in the plane of incidence (along x at u = v = 0).
    pub p: FdtdPowers,
}

/// What a run found and what it took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FdtdRun {
    /// One an asked wavelength.
    pub answers: Vec<FdtdAnswer>,
    /// Largest change of a photodiode's P in the last [`super::CHECK_UM`], or difference of its volume integral and flux.
    pub residual: f64,
    /// Whether the residual came below the tolerance in the allowed time.
    pub converged: bool,
    /// Time steps.
    pub steps: u64,
    /// Simulated time in µm/c.
    pub time_um: f64,
    /// Wall clock.
    pub seconds: f64,
    /// Bytes of fields, maps and phasors.
    pub memory_bytes: usize,
    /// Cells in x, y and z of what was stepped (halved by mirrors).
    pub cells: [usize; 3],
    /// Sets of real fields that were stepped.
    pub sets: usize,
}

impl FdtdRun {
    /// What is wrong with the run: not converged, or energy lost or made. Empty if nothing is.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if !self.converged {
            out.push(format!(
                "not converged after {:.0} um/c: P still changes by {:.1e}",
                self.time_um, self.residual
            ));
        }
        for a in &self.answers {
            for (name, p) in [("s", &a.s), ("p", &a.p)] {
                if (p.balance - 1.0).abs() > BALANCE {
                    out.push(format!(
                        "{} nm, {name}: reflected + absorbed + transmitted = {:.4}",
                        a.wavelength_nm, p.balance
                    ));
                }
            }
        }
        out
    }
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FdtdProgress {
    /// Simulated time in µm/c.
    pub time_um: f64,
    /// Largest change of a photodiode's P in the last [`super::CHECK_UM`]; infinite before there are two values.
    pub residual: f64,
}
