//! The rays of a block, step by step: aimed, weighed by the response, traced, looked along, splatted.

use std::ops::Range;

use glam::DVec2;

use super::Execution;
use super::aiming::{Target, displace, sample};
use super::camera::Camera;
use super::diffraction::PlaceDiffraction;
use super::lamp_rays::{LampSketch, lamp_key, rays_per_sketch, weight};
use super::look::Areas;
use super::occlusion::Occlusion;
use super::pixel_aim::PixelAim;
use super::stats::Tally;
use super::tracer::Tracer;
use crate::frames::uv_from_traced_direction;
use crate::lens::{LensMap, PlaceBuffers};
use crate::rays::RayBatch;
use crate::response::ResponseLookup;
use crate::sampling::SobolSet;
use crate::scene::Hits;
use crate::simd::SimdLevel;

/// One pixel's part of a block.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Its rays in the block's columns.
    pub rays: Range<usize>,
    /// So many of them go anywhere; behind them are those towards lamps.
    pub uniform: usize,
    /// Number of the first among the pixel's.
    pub first: usize,
    pub position_mm: DVec2,
    /// From the sensor to the plane of the pupil, mm.
    pupil_z_mm: f64,
    /// Displacement over wavelength of phase 1 at the pupil's edge; 0 without diffraction.
    pub phase: f64,
}

/// Buffers that a thread reuses from block to block. The columns hold the rays of all pixels of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    /// The block's pixels.
    pub segments: Vec<Segment>,
    /// Place in the pixel, 0 to 1, and point of the pupil's unit disk.
    pub samples: [Vec<f64>; 4],
    /// Lamps of which few rays would meet any: of a block of one pixel.
    pub lamp_sketches: Vec<LampSketch>,
    /// Displacement of each origin by lens diffraction over wavelength, camera frame; without it empty.
    pub displacements: [Vec<f64>; 2],
    /// Origins on the sensor and unit directions away from it, camera frame.
    pub aimed: [Vec<f64>; 6],
    /// Of each ray, from the sensor to the plane of its pixel's pupil, mm; without displacements empty.
    pub pupil_z_mm: Vec<f64>,
    /// cos θ dω of each ray per area on the pupil's plane, Δz²/ℓ⁴, sr/mm².
    pub measure: Vec<f64>,
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    pub weights: Vec<f32>,
    pub batch: RayBatch,
    /// What is looked up where rays stand for areas.
    pub areas: Areas,
    /// Of a run of pixels, light of rays that are displaced far, and what they would bring from a white wall: as the
    /// run's own values. Empty where they are not told from others.
    pub far: [Vec<f64>; 2],
    /// One per wavelength that has a map.
    pub maps: Vec<PlaceBuffers>,
    pub hits: Hits,
    /// One list per channel.
    pub radiance: [Vec<f32>; 3],
    /// Sums of a run of pixels over a white wall, where those are asked for: as the run's own values.
    pub walls: Vec<f64>,
    /// What a white wall is known to give a pixel.
    pub known: Vec<f64>,
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
    /// Begins a block.
    pub fn clear(&mut self) {
        self.segments.clear();
        self.samples.iter_mut().for_each(Vec::clear);
        self.displacements.iter_mut().for_each(Vec::clear);
        self.pupil_z_mm.clear();
        self.aimed.iter_mut().for_each(Vec::clear);
        self.measure.clear();
    }

    /// Adds rays `first .. first + n` of a pixel: origins, directions, measure.
    pub fn aim(
        &mut self,
        camera: &Camera,
        sobol: &SobolSet,
        aim: &PixelAim,
        (first, n): (usize, usize),
        execution: &Execution,
    ) {
        let begin = self.measure.len();
        let end = begin + n + self.lamp_sketches.len() * rays_per_sketch(n);
        self.samples.iter_mut().for_each(|s| s.resize(end, 0.0));
        self.aimed.iter_mut().for_each(|a| a.resize(end, 0.0));
        self.measure.resize(end, 0.0);
        let target = Target::new(camera, aim);
        self.segments.push(Segment {
            rays: begin..end,
            uniform: n,
            first,
            position_mm: aim.position_mm,
            pupil_z_mm: target.pupil.centre_mm.z - target.sensor_z_mm,
            phase: 0.0,
        });
        let uniform = (self.samples.each_mut()).map(|s| &mut s[begin..begin + n]);
        sample(sobol, aim.key, first, uniform, execution.simd);
        self.aim_at_lamps(sobol, aim);
        target.aim(
            self.samples.each_ref().map(|s| &s[begin..]),
            self.aimed.each_mut().map(|a| &mut a[begin..]),
            &mut self.measure[begin..],
            execution.simd,
        );
        if self.lamp_sketches.is_empty() {
            return;
        }
        let [sx, sy, sp, sq] = &self.samples;
        for (i, measure) in self.measure.iter_mut().enumerate().skip(begin) {
            let (place, q) = (DVec2::new(sx[i], sy[i]), DVec2::new(sp[i], sq[i]));
            *measure *= weight(&self.lamp_sketches, n, (place, q));
        }
    }

    /// Fills in the samples of the last pixel's rays towards lamps.
    fn aim_at_lamps(&mut self, sobol: &SobolSet, aim: &PixelAim) {
        let Some(segment) = self.segments.last() else {
            return;
        };
        let each = rays_per_sketch(segment.uniform);
        let lamps = segment.rays.start + segment.uniform;
        for (k, sketch) in self.lamp_sketches.iter().enumerate() {
            let rays = lamps + k * each..lamps + (k + 1) * each;
            for (dim, s) in self.samples.iter_mut().enumerate() {
                let key = lamp_key(aim.key, k, segment.first);
                sobol.fill(dim, key, 0, &mut s[rays.clone()]);
            }
            for i in rays {
                let (place, q) = sketch.ray(std::array::from_fn(|dim| self.samples[dim][i]));
                let ray = [place.x, place.y, q.x, q.y];
                (self.samples.iter_mut().zip(ray)).for_each(|(s, value)| s[i] = value);
            }
        }
    }

    /// Draws where the rays of the last pixel start that lens diffraction takes to the aimed places.
    pub fn diffract(&mut self, here: &PlaceDiffraction<'_>, sobol: &SobolSet, aim: &PixelAim) {
        let Some(segment) = self.segments.last_mut() else {
            return;
        };
        segment.phase = here.phase();
        let Segment {
            rays,
            uniform,
            first,
            ..
        } = &*segment;
        self.pupil_z_mm.resize(rays.end, segment.pupil_z_mm);
        let [x, y] = &mut self.displacements;
        x.resize(rays.end, 0.0);
        y.resize(rays.end, 0.0);
        let (x, y) = (&mut x[rays.clone()], &mut y[rays.clone()]);
        let (uniform, to_lamps) = x.split_at_mut(*uniform);
        sobol.fill(4, aim.key, *first, uniform);
        let each = rays_per_sketch(uniform.len());
        for (k, x) in to_lamps.chunks_mut(each.max(1)).enumerate() {
            sobol.fill(4, lamp_key(aim.key, k, *first), 0, x);
        }
        let [_, _, _, dx, dy, _] = &self.aimed;
        let (dx, dy) = (&dx[rays.clone()], &dy[rays.clone()]);
        here.displacements(*first, [dx, dy], [x, y]);
    }

    /// The response's weight of each ray on each sub-pixel; `shifts_um`: of each pixel's microlens.
    pub fn respond(
        &mut self,
        response: &ResponseLookup,
        shifts_um: impl Iterator<Item = DVec2>,
        n_sub: usize,
    ) {
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
        let parts = (self.segments.iter().zip(shifts_um))
            .map(|(segment, shift_um)| (segment.rays.clone(), shift_um.to_array()));
        response.weights_of_parts(parts, [&mut self.u, &mut self.v], &mut self.weights);
    }

    /// Traces the aimed rays from the sensor into the scene, by a map where there is one, and counts them.
    pub fn trace(&mut self, colour: &TracedColour<'_>, pitch_mm: f64, execution: &Execution) {
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
                let pixels = (self.segments.iter()).map(|s| (s.position_mm, s.rays.clone()));
                let places = map.places(pixels, pitch_mm);
                map.trace_places(b, places, &mut self.maps[number], execution.simd)
            }
        } as u64;
        self.tally.rays += b.len() as u64;
        let lost = (0..b.len()).filter_map(|i| b.failure(i));
        lost.for_each(|f| self.tally.lost.count(f));
    }

    /// Moves the rays of the batch to where diffraction at a wavelength displaces them from, each towards the point of
    /// the pupil that it was aimed at.
    pub fn displace(&mut self, wavelength_mm: f64, simd: SimdLevel) {
        if self.displacements[0].is_empty() {
            return;
        }
        let displacements = self.displacements.each_ref().map(Vec::as_slice);
        displace(
            &mut self.batch,
            displacements,
            &self.pupil_z_mm,
            wavelength_mm,
            simd,
        );
    }

    /// Takes the radiance of a channel along a pixel's rays from a record.
    pub fn recall(&mut self, channel: usize, pixel: usize, radiance: &[f32]) {
        let rays = self.segments[pixel].rays.clone();
        self.radiance[channel][rays].copy_from_slice(radiance);
    }

    /// None of the block's rays is lost: of a record those that were are dark.
    pub fn find_none_lost(&mut self) {
        self.batch.status.clear();
        self.batch.status.resize(self.measure.len(), 0);
    }

    /// Writes the radiance of a channel along a pixel's rays into a record.
    pub fn keep(&self, channel: usize, pixel: usize, out: &mut [f32]) {
        let each = self.segments[pixel].rays.clone();
        for (out, i) in out.iter_mut().zip(each) {
            let passed = self.batch.status[i] == 0;
            *out = if passed {
                self.radiance[channel][i]
            } else {
                0.0
            };
        }
    }

    /// How much of a pixel's pupil sees another surface than the ray of sight.
    pub fn count_others(&self, pixel: usize, occlusion: &mut Occlusion) {
        for i in self.segments[pixel].rays.clone() {
            if self.batch.status[i] == 0 {
                occlusion.all += self.measure[i];
                if self.hits.surface[i] != occlusion.chief_surface {
                    occlusion.other += self.measure[i];
                }
            }
        }
    }
}
