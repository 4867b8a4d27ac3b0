//! The fast ray tracer: blocks of rays, stored as columns, go through one surface after the other.
//!
//! Same physics as the plain tracer ([`super::trace`]), with the divisions gathered. With s = √(1 − (1+k) c² r²), V = Σ
//! A_p r^p, V' = Σ p A_p r^(p−2) and w = x D_x + y D_y, a Newton step on z − sag = 0 and the (not normalised) normal
//! are
//!
//! ```text
//! δt = s ((z − V)(1 + s) − c r²) / ((1 + s)(s D_z − (c + s V') w))        m = (−x (c + s V'), −y (c + s V'), s)
//! ```
//!
//! so a step costs one square root and one division, refraction two and one.
//!
//! **The floor.** An asphere with p ≤ 14 costs about 40 operations, a root and a division to meet its conic, 55, a root
//! and a division for each Newton step (three to four), 70, two roots and a division to refract: about 300 operations,
//! 6 roots and 6 divisions. In AVX-512 (two 8-wide units; a root takes about 24 and a division 16 cycles per vector)
//! that is 19 + 30 cycles per ray, so ten aspheres, two cover-glass planes and a stop cannot take less than about 350
//! to 550 cycles per ray.
//!
//! **Bits.** Every lane does the same operations in the same order, whatever its companions: a lane that has settled is
//! frozen, nothing is contracted (no fused multiply-add) and no sum runs across lanes. A ray that Newton's method does
//! not bring to the aperture beyond doubt is traced again, alone, with the plain tracer's search ([`super::crossing`]).
//! So every [`SimdLevel`] and every grouping of rays gives the same bits.

mod block;
mod kernel;
mod newton;
mod prepared;

use super::surface::Travel;
use super::system::OpticalSystem;
use crate::rays::RayBatch;
use crate::simd::SimdLevel;
use prepared::Prepared;

/// A lens at one wavelength, prepared for tracing batches.
#[derive(Clone, Debug)]
pub struct PacketTracer {
    surfaces: Vec<Prepared>,
    sensor_z_mm: f64,
}

impl PacketTracer {
    /// Prepares `system`.
    pub fn new(system: &OpticalSystem) -> PacketTracer {
        PacketTracer {
            surfaces: system.surfaces.iter().map(Prepared::new).collect(),
            sensor_z_mm: system.sensor_z_mm,
        }
    }

    /// Traces every ray of `batch` in place from the scene to the sensor plane, clipped by every aperture. Every ray
    /// comes in alive and gets a status; one that is lost keeps its old origin and direction. A `level` above what the
    /// CPU has is lowered.
    pub fn trace_forward(&self, batch: &mut RayBatch, level: SimdLevel) {
        self.run(batch, Travel::Forward, level);
    }

    /// Traces every ray of `batch` in place from the sensor into the scene; see [`super::trace_backward`] for the form
    /// of the rays and [`PacketTracer::trace_forward`] for the rest.
    pub fn trace_backward(&self, batch: &mut RayBatch, level: SimdLevel) {
        self.run(batch, Travel::Backward, level);
    }

    fn run(&self, batch: &mut RayBatch, travel: Travel, level: SimdLevel) {
        match level.min(SimdLevel::detect()) {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { run_avx512(self, batch, travel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { run_avx2(self, batch, travel) },
            _ => kernel::trace(&self.surfaces, self.sensor_z_mm, batch, travel),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(tracer: &PacketTracer, batch: &mut RayBatch, travel: Travel) {
    kernel::trace(&tracer.surfaces, tracer.sensor_z_mm, batch, travel);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn run_avx512(tracer: &PacketTracer, batch: &mut RayBatch, travel: Travel) {
    kernel::trace(&tracer.surfaces, tracer.sensor_z_mm, batch, travel);
}
