//! Rays through a map, with the best instructions there are, and what it cannot tell through the lens itself.

use std::ops::Range;

use glam::DVec2;

use super::kernel::run;
use super::lens_map::LensMap;
use super::place::{Doubtful, PlaceBuffers};
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Of the number of pixels that a map reaches.
const ROUNDING: f64 = 1e-6;

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
        let all = std::iter::once((place_mm, 0..batch.len()));
        self.trace_places(batch, all, buffers, level)
    }

    /// The same of rays of several places, each of which has some of the batch's; the others are not traced. Those that
    /// are traced exactly go through the lens together.
    pub fn trace_places(
        &self,
        batch: &mut RayBatch,
        places: impl Iterator<Item = (DVec2, Range<usize>)>,
        buffers: &mut PlaceBuffers,
        level: SimdLevel,
    ) -> usize {
        let level = level.min(SimdLevel::detect());
        self.begin(batch, buffers);
        for (place_mm, rays) in places {
            buffers.go(self, place_mm, level);
            if buffers.place.band[0].is_infinite() {
                buffers.rays.numbers.extend(rays);
            } else {
                self.map_rays(batch, rays, buffers, level);
            }
        }
        self.trace_doubtful(batch, buffers, level)
    }

    /// Pixels of a row, one after the other, with their rays, by places that stand evenly over the window: as many
    /// pixels share one as leave half of the map's reach to rays that start beside their pixel.
    pub fn places(
        &self,
        pixels: impl Iterator<Item = (DVec2, Range<usize>)>,
        pitch_mm: f64,
    ) -> impl Iterator<Item = (DVec2, Range<usize>)> {
        let mut pixels = pixels.peekable();
        std::iter::from_fn(move || {
            let (first, mut rays) = pixels.next()?;
            let place = self.shared_place(first, pitch_mm);
            let is_there = |pixel: &DVec2| self.shared_place(*pixel, pitch_mm) == place;
            while let Some((_, more)) = pixels.next_if(|(pixel, _)| is_there(pixel)) {
                rays.end = more.end;
            }
            Some((place, rays))
        })
    }

    /// The place of a pixel and those beside it in its row: the middle of as many columns as the map reaches, counted
    /// from the window's edge.
    fn shared_place(&self, pixel_mm: DVec2, pitch_mm: f64) -> DVec2 {
        let left = self.window.centre.x - self.window.half_width;
        let columns = (2.0 * self.window.half_width / pitch_mm).round();
        let together = (self.reach_mm / pitch_mm + ROUNDING).floor().max(1.0);
        let column = ((pixel_mm.x - left) / pitch_mm).floor();
        let first = (column / together).floor() * together;
        // The last ones may be fewer.
        let end = (first + together).min(columns.max(column + 1.0));
        DVec2::new(left + 0.5 * (first + end) * pitch_mm, pixel_mm.y)
    }

    /// The polynomials alone, also beyond the edge.
    pub(super) fn trace_unbounded(
        &self,
        batch: &mut RayBatch,
        place_mm: DVec2,
        buffers: &mut PlaceBuffers,
    ) {
        buffers.go_unbounded(self, place_mm);
        self.begin(batch, buffers);
        self.map_rays(batch, 0..batch.len(), buffers, SimdLevel::detect());
        self.trace_doubtful(batch, buffers, SimdLevel::detect());
    }

    fn begin(&self, batch: &mut RayBatch, buffers: &mut PlaceBuffers) {
        let rays = batch.len();
        batch.status.resize(rays, 0);
        batch.surface.resize(rays, 0);
        buffers.rays.numbers.clear();
    }

    fn map_rays(
        &self,
        batch: &mut RayBatch,
        rays: Range<usize>,
        buffers: &mut PlaceBuffers,
        level: SimdLevel,
    ) {
        match level {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL, and FMA on this CPU.
            SimdLevel::Avx512 => unsafe { run_avx512(self, batch, rays, buffers) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) and FMA on this CPU.
            SimdLevel::Avx2 => unsafe { run_avx2(self, batch, rays, buffers) },
            _ => run::<[f32; 8]>(self, batch, rays, buffers),
        }
    }

    fn trace_doubtful(
        &self,
        batch: &mut RayBatch,
        buffers: &mut PlaceBuffers,
        level: SimdLevel,
    ) -> usize {
        let Doubtful {
            numbers,
            batch: doubtful,
        } = &mut buffers.rays;
        if numbers.is_empty() {
            return 0;
        }
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
        numbers.len()
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2(map: &LensMap, batch: &mut RayBatch, rays: Range<usize>, buffers: &mut PlaceBuffers) {
    run::<std::arch::x86_64::__m256>(map, batch, rays, buffers);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,fma")]
fn run_avx512(map: &LensMap, batch: &mut RayBatch, rays: Range<usize>, buffers: &mut PlaceBuffers) {
    run::<std::arch::x86_64::__m512>(map, batch, rays, buffers);
}
