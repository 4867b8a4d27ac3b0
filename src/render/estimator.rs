//! One pixel: aim rays, weigh them by the response, trace them, splat their radiance on all sub-pixels.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::camera::Camera;
use super::stats::Tally;
use super::tracer::Tracer;
use super::{Execution, RenderSettings};
use crate::frames::{camera_from_sensor_mm, uv_from_traced_direction};
use crate::lens::{LensMap, PlaceBuffers, PupilEllipse};
use crate::rays::RayBatch;
use crate::rays::RaySlices;
use crate::response::ResponseLookup;
use crate::sampling::{SobolSet, concentric_disk, hash};
use crate::scene::world::PathKey;
use crate::scene::{Hits, Scene};
use crate::spectrum::ChannelWavelengths;

/// Rays handled together: their arrays stay in the L1 and L2 caches.
const BLOCK: usize = 256;

/// Buffers that a thread reuses from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    samples: [Vec<f64>; 4],
    /// Displacement of each origin by lens diffraction over wavelength, camera frame; without it empty.
    displacements: [Vec<f64>; 2],
    /// Origins on the sensor and unit directions away from it, camera frame.
    aimed: [Vec<f64>; 6],
    /// From the sensor to the plane of the pupil, mm.
    pupil_z_mm: f64,
    /// cos θ dω of each ray per area on the pupil's plane, Δz²/ℓ⁴, sr/mm².
    measure: Vec<f64>,
    u: Vec<f32>,
    v: Vec<f32>,
    weights: Vec<f32>,
    batch: RayBatch,
    /// One per wavelength that has a map.
    maps: Vec<PlaceBuffers>,
    hits: Hits,
    /// One list per channel.
    radiance: [Vec<f32>; 3],
    /// Of all that was rendered with these buffers.
    pub tally: Tally,
}

/// The pixel's own data that its rays share.
pub(super) struct PixelAim {
    pub position_mm: DVec2,
    pub pupil: PupilEllipse,
    pub shift_um: DVec2,
    pub key: u64,
}

/// How much of the pupil sees another surface than the ray of sight.
pub(super) struct Occlusion {
    /// Surface that the ray of sight meets.
    chief_surface: u16,
    /// Solid-angle-weighted sum over rays that meet another one, and over all that pass.
    other: f64,
    all: f64,
}

impl Occlusion {
    /// Beside this surface, which the ray of sight meets.
    pub fn beside(chief_surface: u16) -> Self {
        Self {
            chief_surface,
            other: 0.0,
            all: 0.0,
        }
    }

    /// The other surfaces' share; `None` where no ray passed.
    pub fn share(&self) -> Option<f32> {
        (self.all > 0.0).then(|| (self.other / self.all) as f32)
    }
}

/// Radiance of rays, one entry per pixel, channel and ray (pixels outermost, lost rays 0): not kept, written, or read.
pub(super) enum RadianceRecord<'a> {
    None,
    Write(&'a mut [f32]),
    Read(&'a [f32]),
}

impl<'a> RadianceRecord<'a> {
    /// `count` parts of `len` entries each.
    pub fn split(self, len: usize, count: usize) -> Vec<RadianceRecord<'a>> {
        match self {
            Self::None => (0..count).map(|_| Self::None).collect(),
            Self::Write(all) => (all.chunks_mut(len).take(count).map(Self::Write)).collect(),
            Self::Read(all) => (all.chunks(len).take(count).map(Self::Read)).collect(),
        }
    }
}

/// A pixel to be rendered, and what is asked for beside its image.
pub(super) struct PixelTask<'a> {
    pub aim: &'a PixelAim,
    pub occlusion: Option<Occlusion>,
    pub record: RadianceRecord<'a>,
}

impl<'a> PixelTask<'a> {
    /// Nothing but the image.
    pub fn image_only(aim: &'a PixelAim) -> Self {
        Self {
            aim,
            occlusion: None,
            record: RadianceRecord::None,
        }
    }
}

/// Rays of one pixel at one wavelength of each channel.
struct Block {
    /// Which of the channel's wavelengths.
    wavelength: usize,
    /// Number of the first ray.
    first: usize,
    rays: usize,
}

/// With what a block is traced.
struct TracedColour<'a> {
    tracer: &'a Tracer,
    /// In its place, with its number.
    map: Option<(usize, &'a LensMap)>,
    wavelength_mm: f64,
}

/// What every pixel of a render shares.
pub(super) struct Estimator<'a> {
    pub camera: &'a Camera,
    /// `None`: the radiance of each ray comes from a record.
    pub scene: Option<&'a Scene>,
    pub settings: &'a RenderSettings,
    execution: Execution,
    sobol: SobolSet,
    /// See [`PathKey::spread`].
    spread: f32,
}

impl<'a> Estimator<'a> {
    pub fn new(
        camera: &'a Camera,
        scene: Option<&'a Scene>,
        settings: &'a RenderSettings,
        execution: Execution,
    ) -> Self {
        Self {
            camera,
            scene,
            settings,
            execution,
            sobol: SobolSet::new(settings.rays_per_pixel),
            spread: camera.ray_spread(settings.rays_per_pixel),
        }
    }

    /// Entries of a [`RadianceRecord`] per pixel.
    pub fn record_len(&self) -> usize {
        3 * self.settings.rays_per_pixel
    }

    /// Writes the pixel's estimate to `out[channel * subpixels + subpixel]` and counts its rays in the workspace's
    /// tally.
    pub fn pixel(&self, task: &mut PixelTask<'_>, work: &mut Workspace, out: &mut [f64]) {
        out.fill(0.0);
        let rays = self.settings.rays_per_pixel;
        let colours = self.camera.colours();
        let mut first = 0;
        for wavelength in 0..colours.count() {
            let end = colours.end_of_share(wavelength, rays, task.aim.key);
            while first < end {
                let block = Block {
                    wavelength,
                    first,
                    rays: (end - first).min(BLOCK),
                };
                self.block(&block, task, work, out);
                first += block.rays;
            }
        }
        let scale = task.aim.pupil.area_mm2() / rays as f64;
        out.iter_mut().for_each(|x| *x *= scale);
    }

    /// Adds the rays of a block, before they are scaled.
    fn block(
        &self,
        block: &Block,
        task: &mut PixelTask<'_>,
        work: &mut Workspace,
        out: &mut [f64],
    ) {
        let n_sub = self.camera.sensor().subpixels().count();
        let colours = self.camera.colours();
        let &Block {
            wavelength,
            first,
            rays: n,
        } = block;
        work.aim(self.camera, &self.sobol, task.aim, first, n);
        work.diffract(self.camera, &self.sobol, task.aim, first);
        work.radiance.iter_mut().for_each(|l| l.resize(n, 0.0));
        let mut responded = None;
        for channel in 0..3 {
            let number = colours.response_number(channel, wavelength);
            if responded != Some(number) {
                work.respond(colours.response(number), task.aim, n_sub);
                responded = Some(number);
            }
            let start = channel * self.settings.rays_per_pixel + first;
            if let RadianceRecord::Read(radiance) = &task.record {
                work.recall(channel, &radiance[start..][..n]);
            } else if let Some(tracer) = colours.own_tracer(channel, wavelength) {
                let colour = TracedColour {
                    tracer,
                    map: colours.map(channel, wavelength),
                    wavelength_mm: colours.traced_nm(channel, wavelength) * 1e-6,
                };
                work.trace(&colour, task.aim, &self.execution);
                let Some(scene) = self.scene else { continue };
                let served = match self.camera.is_dispersive() {
                    true => channel..channel + 1,
                    false => 0..3,
                };
                let key = PathKey {
                    key: task.aim.key,
                    first: first as u32,
                    spread: self.spread,
                };
                work.look(scene, served, &key);
            }
            if let RadianceRecord::Write(radiance) = &mut task.record {
                work.keep(channel, &mut radiance[start..][..n]);
            }
            work.splat(channel, n_sub, &mut out[channel * n_sub..][..n_sub]);
            if channel == ChannelWavelengths::REFERENCE
                && let Some(occlusion) = &mut task.occlusion
            {
                work.count_others(occlusion);
            }
        }
    }
}

impl Workspace {
    /// Rays `first .. first + n` of the pixel: origins, directions, measure.
    fn aim(&mut self, camera: &Camera, sobol: &SobolSet, aim: &PixelAim, first: usize, n: usize) {
        for (dim, s) in self.samples.iter_mut().enumerate() {
            s.resize(n, 0.0);
            sobol.fill(dim, aim.key, first, s);
        }
        self.aimed.iter_mut().for_each(|a| a.resize(n, 0.0));
        self.measure.resize(n, 0.0);
        let pitch = camera.sensor().pitch_mm();
        let z = camera.sensor_z_mm();
        let corner = aim.position_mm - DVec2::splat(0.5 * pitch);
        let PupilEllipse {
            centre_mm: c,
            axis_a_mm: a,
            axis_b_mm: b,
        } = aim.pupil;
        let delta_z = c.z - z;
        self.pupil_z_mm = delta_z;
        let [sx, sy, sp, sq] = &self.samples;
        let [ox, oy, oz, dx, dy, dz] = &mut self.aimed;
        let (sx, sy, sp, sq) = (&sx[..n], &sy[..n], &sp[..n], &sq[..n]);
        let (ox, oy, oz) = (&mut ox[..n], &mut oy[..n], &mut oz[..n]);
        let (dx, dy, dz) = (&mut dx[..n], &mut dy[..n], &mut dz[..n]);
        let measure = &mut self.measure[..n];
        for i in 0..n {
            let on_sensor = corner + DVec2::new(pitch * sx[i], pitch * sy[i]);
            let DVec3 { x, y, .. } = camera_from_sensor_mm(on_sensor, z);
            let (p, q) = concentric_disk(sp[i], sq[i]);
            let ex = c.x + p * a.x + q * b.x - x;
            let ey = c.y + p * a.y + q * b.y - y;
            let squared = ex * ex + ey * ey + delta_z * delta_z;
            let inverse = 1.0 / squared.sqrt();
            (ox[i], oy[i], oz[i]) = (x, y, z);
            (dx[i], dy[i], dz[i]) = (ex * inverse, ey * inverse, delta_z * inverse);
            measure[i] = delta_z * delta_z / (squared * squared);
        }
    }

    /// Draws where the rays start that lens diffraction takes to the aimed places, if the camera has it.
    fn diffract(&mut self, camera: &Camera, sobol: &SobolSet, aim: &PixelAim, first: usize) {
        let Some(diffraction) = camera.lens_diffraction() else {
            self.displacements.iter_mut().for_each(Vec::clear);
            return;
        };
        let n = self.measure.len();
        let [x, y] = &mut self.displacements;
        x.resize(n, 0.0);
        y.resize(n, 0.0);
        sobol.fill(4, aim.key, first, x);
        let here = diffraction.at(aim.position_mm, aim.key);
        let [_, _, _, dx, dy, _] = &self.aimed;
        for (i, (x, y)) in x.iter_mut().zip(y).enumerate() {
            let d = here.displacement(first + i, DVec2::new(dx[i], dy[i]), *x);
            (*x, *y) = (d.x, d.y);
        }
    }

    /// The response's weight of each ray on each sub-pixel, times its measure.
    fn respond(&mut self, response: &ResponseLookup, aim: &PixelAim, n_sub: usize) {
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
    fn trace(&mut self, colour: &TracedColour<'_>, aim: &PixelAim, execution: &Execution) {
        let b = &mut self.batch;
        let targets = [
            &mut b.ox, &mut b.oy, &mut b.oz, &mut b.dx, &mut b.dy, &mut b.dz,
        ];
        for (target, source) in targets.into_iter().zip(&self.aimed) {
            target.clone_from(source);
        }
        self.displace(colour.wavelength_mm);
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
    fn displace(&mut self, wavelength_mm: f64) {
        let b = &mut self.batch;
        let [x, y] = &self.displacements;
        let (ox, oy) = (&mut b.ox[..x.len()], &mut b.oy[..x.len()]);
        let (dx, dy, dz) = (
            &mut b.dx[..x.len()],
            &mut b.dy[..x.len()],
            &mut b.dz[..x.len()],
        );
        let y = &y[..x.len()];
        for i in 0..x.len() {
            let (x, y) = (wavelength_mm * x[i], wavelength_mm * y[i]);
            let length = self.pupil_z_mm / dz[i];
            let (ex, ey) = (dx[i] * length - x, dy[i] * length - y);
            let inverse = 1.0 / (ex * ex + ey * ey + self.pupil_z_mm * self.pupil_z_mm).sqrt();
            (ox[i], oy[i]) = (ox[i] + x, oy[i] + y);
            (dx[i], dy[i], dz[i]) = (ex * inverse, ey * inverse, self.pupil_z_mm * inverse);
        }
    }

    /// The radiance of the channels along the traced rays.
    fn look(&mut self, scene: &Scene, channels: Range<usize>, key: &PathKey) {
        let rays = RaySlices::from_batch(&self.batch);
        scene.intersect(rays, &mut self.hits);
        scene.radiance(rays, &mut self.hits, channels, key, &mut self.radiance);
    }

    /// Takes the radiance of a channel from a record; no ray is lost any more, those that were are dark.
    fn recall(&mut self, channel: usize, radiance: &[f32]) {
        self.radiance[channel].copy_from_slice(radiance);
        self.batch.status.clear();
        self.batch.status.resize(radiance.len(), 0);
    }

    /// Writes the radiance of a channel into a record.
    fn keep(&self, channel: usize, out: &mut [f32]) {
        let rays = self.radiance[channel].iter().zip(&self.batch.status);
        for (out, (&radiance, &status)) in out.iter_mut().zip(rays) {
            *out = if status == 0 { radiance } else { 0.0 };
        }
    }

    /// out[s] += Σ radiance · weight · measure over the rays that passed.
    fn splat(&mut self, channel: usize, n_sub: usize, out: &mut [f64]) {
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
    fn count_others(&self, occlusion: &mut Occlusion) {
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

impl PixelAim {
    /// The aim of pixel (column, row); `None` where the lens lets no light through.
    pub fn new(camera: &Camera, seed: u64, column: usize, row: usize) -> Option<Self> {
        let position_mm = camera.sensor().position_mm(column as f64, row as f64);
        Some(Self {
            position_mm,
            pupil: camera.pupil_at(position_mm)?,
            shift_um: camera.shift_at_um(position_mm),
            key: hash(seed, &[column as u64, row as u64]),
        })
    }
}

/// Origin of the ray through the middle of a pixel, camera frame, mm.
pub(super) fn pixel_origin_mm(camera: &Camera, column: f64, row: f64) -> DVec3 {
    camera_from_sensor_mm(
        camera.sensor().position_mm(column, row),
        camera.sensor_z_mm(),
    )
}
