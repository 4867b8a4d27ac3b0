//! How the rays of a channel go through the lens.

use glam::DVec2;

use crate::frames::camera_from_sensor_mm;
use crate::lens::{IdealLens, OpticalSystem, PacketTracer, chief_ray};
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

    /// Slope (dx/dz, dy/dz), camera frame, at the sensor position `xy_mm` of the ray through the centre of the stop of
    /// `system`, whose tracer this is; `None` where there is none.
    pub fn chief_slope(&self, system: &OpticalSystem, xy_mm: DVec2) -> Option<DVec2> {
        match self {
            Self::Surfaces(_) => {
                let ray = chief_ray(system, xy_mm.x, xy_mm.y).ok()?;
                Some(ray.direction.truncate() / ray.direction.z)
            }
            Self::Ideal(ideal) => {
                Some(ideal.chief_slope(camera_from_sensor_mm(xy_mm, 0.0).truncate()))
            }
        }
    }
}
