//! How the rays of a channel go through the lens.

use glam::DVec2;

use crate::frames::camera_from_sensor_mm;
use crate::lens::{IdealLens, OpticalSystem, PacketTracer, chief_rays};
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Surface by surface, or by first-order optics.
#[derive(Clone, Debug)]
pub(super) enum Tracer {
    /// The real lens.
    Surfaces(PacketTracer),
    /// The lens without aberrations.
    Ideal(IdealLens),
}

impl Tracer {
    /// The real lens.
    pub fn surfaces(system: &OpticalSystem) -> Self {
        Self::Surfaces(PacketTracer::new(system))
    }

    /// Traces every ray of `batch` in place from the sensor into the scene; see [`PacketTracer::trace_backward`].
    pub fn trace_backward(&self, batch: &mut RayBatch, level: SimdLevel) {
        match self {
            Self::Surfaces(packet) => packet.trace_backward(batch, level),
            Self::Ideal(ideal) => ideal.trace_backward(batch),
        }
    }

    /// Slopes (dx/dz, dy/dz), camera frame, at the sensor positions of a row of the rays through the centre of the stop
    /// of `system`, whose tracer this is; `None` where there is none.
    pub fn chief_slopes(&self, system: &OpticalSystem, row_mm: &[DVec2]) -> Vec<Option<DVec2>> {
        let row = row_mm.iter().copied();
        match self {
            Self::Surfaces(_) => (chief_rays(system, row).into_iter())
                .map(|ray| {
                    ray.ok()
                        .map(|ray| ray.direction.truncate() / ray.direction.z)
                })
                .collect(),
            Self::Ideal(ideal) => row
                .map(|xy_mm| camera_from_sensor_mm(xy_mm, 0.0).truncate())
                .map(|at_mm| Some(ideal.chief_slope(at_mm)))
                .collect(),
        }
    }
}
