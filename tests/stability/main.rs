//! Hard cases, each with the bound it is held to: where formulas divide by nothing, roots meet, sums are long, or
//! nothing is lit. `benches/runs/2026-11-21/stability.md` lists them, with those that live in other test binaries.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod crossings;
mod focus;
#[path = "../common/random.rs"]
mod lcg;
mod light;
mod random;
mod response;
mod scan;
#[path = "../common/shots.rs"]
mod shots;
#[path = "../lens_trace/support.rs"]
mod support;
mod surfaces;
mod wavelengths;

use quadpixel::lens::{Clipping, Lens, OpticalSystem, Prescription, Travel, trace_visiting};
use quadpixel::rays::{Ray, RayFailure};

use shots::PHONE;

/// A lens of the library, as prescribed.
fn builtin(name: &str) -> Lens {
    Lens::new(&Prescription::builtin(name).unwrap()).unwrap()
}

/// Traces without apertures.
fn free(system: &OpticalSystem, ray: Ray, travel: Travel) -> Result<Ray, RayFailure> {
    trace_visiting(system, ray, travel, Clipping::Off, |_, _| {})
}
