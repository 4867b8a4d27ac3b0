//! The rays of a block, step by step: aimed, weighed by the response, traced, looked along, splatted.

use std::ops::Range;

use glam::DVec2;

use super::Execution;
use super::aiming::{Target, displace, sample};
use super::camera::Camera;
use super::lamp_rays::{LampSketch, lamp_key, rays_per_sketch, weight};
use super::occlusion::Occlusion;
use super::pixel_aim::PixelAim;
use super::stats::Tally;
use super::tracer::Tracer;
use crate::frames::uv_from_traced_direction;
use crate::lens::{LensMap, PlaceBuffers};
use crate::rays::{RayBatch, RaySlices};
use crate::response::ResponseLookup;
use crate::sampling::SobolSet;
use crate::scene::world::PathKey;
use crate::scene::{Hits, Scene};
use crate::simd::SimdLevel;

/// Buffers that a thread reuses from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    /// Place in the pixel, 0 to 1, and point of the pupil's unit disk.
    pub samples: [Vec<f64>; 4],
    /// Rays of the block that go anywhere; behind them are those towards lamps.
    pub rays: usize,
    /// Lamps of which few rays would meet any.
    pub lamp_sketches: Vec<LampSketch>,
    /// Displacement of each origin by lens diffraction over wavelength, camera frame; without it empty.
    pub displacements: [Vec<f64>; 2],
    /// Origins on the sensor and unit directions away from it, camera frame.
    pub aimed: [Vec<f64>; 6],
    /// From the sensor to the plane of the pupil, mm.
    pub pupil_z_mm: f64,
    /// cos θ dω of each ray per area on the pupil's plane, Δz²/ℓ⁴, sr/mm².
    pub measure: Vec<f64>,
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    pub weights: Vec<f32>,
    pub batch: RayBatch,
    /// One per wavelength that has a map.
    pub maps: Vec<PlaceBuffers>,
    pub hits: Hits,
    /// One list per channel.
    pub radiance: [Vec<f32>; 3],
    /// Of all that was rendered with these buffers.
    pub tally: Tally,
}

/// With what a block is traced.
pub(super) struct TracedColour<'a> {
    pub tracer: &'a Tracer,
    /// In its place, with its number.
    pub map: Option<(usize, &'a LensMap)>,
    pub wavelength_mm: f64,
}

impl Workspace {
    /// Rays `first .. first + n` of the pixel: origins, directions, measure.
    pub fn aim(
        &mut self,
        camera: &Camera,
        sobol: &SobolSet,
        aim: &PixelAim,
        (first, n): (usize, usize),
        execution: &Execution,
    ) {
        sample(
            sobol,
            aim.key,
            (first, n),
            &mut self.samples,
            execution.simd,
        );
        self.rays = n;
        self.aim_at_lamps(sobol, aim, first);
        let n = self.samples[0].len();
        self.aimed.iter_mut().for_each(|a| a.resize(n, 0.0));
        self.measure.resize(n, 0.0);
        let target = Target::new(camera, aim);
        self.pupil_z_mm = target.pupil.centre_mm.z - target.sensor_z_mm;
        target.aim(
            &self.samples,
            &mut self.aimed,
            &mut self.measure,
            execution.simd,
        );
        if self.lamp_sketches.is_empty() {
            return;
        }
        let [sx, sy, sp, sq] = &self.samples;
        for (i, measure) in self.measure.iter_mut().enumerate() {
            let (place, q) = (DVec2::new(sx[i], sy[i]), DVec2::new(sp[i], sq[i]));
            *measure *= weight(&self.lamp_sketches, self.rays, (place, q));
        }
    }

    /// Adds the block's rays towards lamps to its samples.
    pub fn aim_at_lamps(&mut self, sobol: &SobolSet, aim: &PixelAim, first: usize) {
        let each = rays_per_sketch(self.rays);
        for (k, sketch) in self.lamp_sketches.iter().enumerate() {
            let begin = self.rays + k * each;
            for (dim, s) in self.samples.iter_mut().enumerate() {
                s.resize(begin + each, 0.0);
                sobol.fill(dim, lamp_key(aim.key, k, first), 0, &mut s[begin..]);
            }
            for i in begin..begin + each {
                let (place, q) = sketch.ray(std::array::from_fn(|dim| self.samples[dim][i]));
                let ray = [place.x, place.y, q.x, q.y];
                (self.samples.iter_mut().zip(ray)).for_each(|(s, value)| s[i] = value);
            }
        }
    }

    /// Draws where the rays start that lens diffraction takes to the aimed places, if the camera has it.
    pub fn diffract(&mut self, camera: &Camera, sobol: &SobolSet, aim: &PixelAim, first: usize) {
        let Some(diffraction) = camera.lens_diffraction() else {
            self.displacements.iter_mut().for_each(Vec::clear);
            return;
        };
        let n = self.measure.len();
        let [x, y] = &mut self.displacements;
        x.resize(n, 0.0);
        y.resize(n, 0.0);
        let (uniform, to_lamps) = x.split_at_mut(self.rays);
        sobol.fill(4, aim.key, first, uniform);
        let each = rays_per_sketch(self.rays);
        for (k, x) in to_lamps.chunks_mut(each).enumerate() {
            sobol.fill(4, lamp_key(aim.key, k, first), 0, x);
        }
        let here = diffraction.at(aim.position_mm, aim.key);
        let [_, _, _, dx, dy, _] = &self.aimed;
        for (i, (x, y)) in x.iter_mut().zip(y).enumerate() {
            let d = here.displacement(first + i, DVec2::new(dx[i], dy[i]), *x);
            (*x, *y) = (d.x, d.y);
        }
    }

    /// The response's weight of each ray on each sub-pixel, times its measure.
    pub fn respond(&mut self, response: &ResponseLookup, aim: &PixelAim, n_sub: usize) {
        let n = self.measure.len();
        self.u.resize(n, 0.0);
        self.v.resize(n, 0.0);
        let [_, _, _, dx, dy, _] = &self.aimed;
        let (dx, dy) = (&dx[..n], &dy[..n]);
        for i in 0..n {
            let (u, v) = uv_from_traced_direction(dx[i], dy[i]);
            (self.u[i], self.v[i]) = (u as f32, v as f32);
        }
        self.weights.resize(n * n_sub, 0.0);
        response.weights_under(
            aim.shift_um.to_array(),
            &mut self.u,
            &mut self.v,
            &mut self.weights,
        );
    }

    /// Traces the aimed rays from the sensor into the scene, by a map where there is one, and counts them.
    pub fn trace(&mut self, colour: &TracedColour<'_>, aim: &PixelAim, execution: &Execution) {
        let b = &mut self.batch;
        let targets = [
            &mut b.ox, &mut b.oy, &mut b.oz, &mut b.dx, &mut b.dy, &mut b.dz,
        ];
        for (target, source) in targets.into_iter().zip(&self.aimed) {
            target.clone_from(source);
        }
        self.displace(colour.wavelength_mm, execution.simd);
        let b = &mut self.batch;
        self.tally.exact_rays += match colour.map {
            None => {
                colour.tracer.trace_backward(b, execution.simd);
                b.len()
            }
            Some((number, map)) => {
                if self.maps.len() <= number {
                    self.maps.resize_with(number + 1, PlaceBuffers::default);
                }
                map.trace_backward(b, aim.position_mm, &mut self.maps[number], execution.simd)
            }
        } as u64;
        self.tally.rays += b.len() as u64;
        let lost = (0..b.len()).filter_map(|i| b.failure(i));
        lost.for_each(|f| self.tally.lost.count(f));
    }

    /// Moves the rays of the batch to where diffraction at a wavelength displaces them from, each towards the point of
    /// the pupil that it was aimed at.
    pub fn displace(&mut self, wavelength_mm: f64, simd: SimdLevel) {
        displace(
            &mut self.batch,
            &self.displacements,
            [wavelength_mm, self.pupil_z_mm],
            simd,
        );
    }

    /// The radiance of the channels along the traced rays.
    pub fn look(&mut self, scene: &Scene, channels: Range<usize>, key: &PathKey) {
        let rays = RaySlices::from_batch(&self.batch);
        scene.intersect(rays, &mut self.hits);
        scene.radiance(rays, &mut self.hits, channels, key, &mut self.radiance);
    }

    /// Takes the radiance of a channel from a record; no ray is lost any more, those that were are dark.
    pub fn recall(&mut self, channel: usize, radiance: &[f32]) {
        self.radiance[channel].copy_from_slice(radiance);
        self.batch.status.clear();
        self.batch.status.resize(radiance.len(), 0);
    }

    /// Writes the radiance of a channel into a record.
    pub fn keep(&self, channel: usize, out: &mut [f32]) {
        let rays = self.radiance[channel].iter().zip(&self.batch.status);
        for (out, (&radiance, &status)) in out.iter_mut().zip(rays) {
            *out = if status == 0 { radiance } else { 0.0 };
        }
    }

    /// out[s] += Σ radiance · weight · measure over the rays that passed.
    pub fn splat(&mut self, channel: usize, n_sub: usize, out: &mut [f64]) {
        let rays = self.radiance[channel]
            .iter()
            .zip(&self.measure)
            .zip(self.weights.chunks_exact(n_sub))
            .zip(&self.batch.status);
        for (((&radiance, &measure), weights), &status) in rays {
            // A lost ray carries nothing; its radiance may be that of a meaningless hit.
            let value = if status == 0 {
                f64::from(radiance) * measure
            } else {
                0.0
            };
            for (o, &w) in out.iter_mut().zip(weights) {
                *o += value * f64::from(w);
            }
        }
    }

    /// How much of the pupil sees another surface than the ray of sight.
    pub fn count_others(&self, occlusion: &mut Occlusion) {
        for ((&surface, &measure), &status) in self
            .hits
            .surface
            .iter()
            .zip(&self.measure)
            .zip(&self.batch.status)
        {
            if status == 0 {
                occlusion.all += measure;
                if surface != occlusion.chief_surface {
                    occlusion.other += measure;
                }
            }
        }
    }
}
