//! Rays through a map, with the best instructions there are, and what it cannot tell through the lens itself.

use glam::DVec2;

use super::kernel::run;
use super::lens_map::LensMap;
use super::place::{Doubtful, Edge, PlaceBuffers};
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

impl LensMap {
    /// Takes every ray of `batch` in place from the sensor into the scene, as
    /// [`PacketTracer::trace_backward`](crate::lens::PacketTracer::trace_backward) does. The rays start near the sensor
    /// position `place_mm` (sensor frame); one that starts farther off than the map holds, or comes near the edge of
    /// the pupil, is traced exactly. Returns how many were. A living ray's origin lies in a plane through the first
    /// surface. A ray that the map tells to be lost is said to be vignetted at the stop.
    pub fn trace_backward(
        &self,
        batch: &mut RayBatch,
        place_mm: DVec2,
        buffers: &mut PlaceBuffers,
        level: SimdLevel,
    ) -> usize {
        buffers.go(self, place_mm, level);
        if buffers.place.band.is_infinite() {
            self.tracer.trace_backward(batch, level);
            return batch.len();
        }
        self.trace_at(batch, buffers, level)
    }

    /// The polynomials alone, also beyond the edge.
    pub(super) fn trace_unbounded(
        &self,
        batch: &mut RayBatch,
        place_mm: DVec2,
        buffers: &mut PlaceBuffers,
    ) {
        buffers.go(self, place_mm, SimdLevel::detect());
        buffers.place.edge = Edge::default();
        self.trace_at(batch, buffers, SimdLevel::detect());
    }

    fn trace_at(
        &self,
        batch: &mut RayBatch,
        buffers: &mut PlaceBuffers,
        level: SimdLevel,
    ) -> usize {
        let level = level.min(SimdLevel::detect());
        let rays = batch.len();
        batch.status.resize(rays, 0);
        batch.surface.resize(rays, 0);
        buffers.rays.numbers.clear();
        match level {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL, and FMA on this CPU.
            SimdLevel::Avx512 => unsafe { run_avx512(self, batch, buffers) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) and FMA on this CPU.
            SimdLevel::Avx2 => unsafe { run_avx2(self, batch, buffers) },
            _ => run(self, batch, buffers),
        }
        let Doubtful {
            numbers,
            batch: doubtful,
        } = &mut buffers.rays;
        if !numbers.is_empty() {
            doubtful.clear();
            for &i in numbers.iter() {
                let ray = batch.ray(i);
                doubtful.push(ray.origin_mm, ray.direction);
            }
            self.tracer.trace_backward(doubtful, level);
            for (k, &i) in numbers.iter().enumerate() {
                (batch.ox[i], batch.oy[i], batch.oz[i]) =
                    (doubtful.ox[k], doubtful.oy[k], doubtful.oz[k]);
                (batch.dx[i], batch.dy[i], batch.dz[i]) =
                    (doubtful.dx[k], doubtful.dy[k], doubtful.dz[k]);
                (batch.status[i], batch.surface[i]) = (doubtful.status[k], doubtful.surface[k]);
            }
        }
        numbers.len()
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2(map: &LensMap, batch: &mut RayBatch, buffers: &mut PlaceBuffers) {
    run(map, batch, buffers);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,fma")]
fn run_avx512(map: &LensMap, batch: &mut RayBatch, buffers: &mut PlaceBuffers) {
    run(map, batch, buffers);
}
