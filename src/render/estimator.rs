//! One pixel: aim rays, weigh them by the response, trace them, splat their radiance on all sub-pixels.

use glam::{DVec2, DVec3};

use super::camera::Camera;
use super::stats::Tally;
use super::tracer::Tracer;
use super::{Execution, RenderSettings};
use crate::frames::camera_from_sensor_mm;
use crate::lens::PupilEllipse;
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
    /// Origins on the sensor and unit directions away from it, camera frame.
    aimed: [Vec<f64>; 6],
    /// cos θ dω of each ray per area on the pupil's plane, Δz²/ℓ⁴, sr/mm².
    measure: Vec<f64>,
    u: Vec<f32>,
    v: Vec<f32>,
    weights: Vec<f32>,
    batch: RayBatch,
    hits: Hits,
    /// One list a channel.
    radiance: [Vec<f32>; 3],
}

/// The pixel's own data that its rays share.
pub(super) struct PixelAim {
    pub position_mm: DVec2,
    pub pupil: PupilEllipse,
    pub shift_um: DVec2,
    pub key: u64,
}

/// What is asked of a pixel beside its image.
pub(super) struct Occlusion {
    /// Surface that the chief ray meets.
    pub chief_surface: u16,
    /// Solid-angle-weighted sum over rays that meet another one, and over all that pass.
    pub other: f64,
    pub all: f64,
}

/// Radiance of a pixel's rays, one entry a channel and ray (channels outermost, lost rays 0): not kept, written, or read.
pub(super) enum Kept<'a> {
    No,
    Write(&'a mut [f32]),
    Read(&'a [f32]),
}

/// Rays of one pixel at one wavelength of each channel.
struct Block {
    /// Which of the channel's wavelengths.
    wavelength: usize,
    /// Number of the first ray.
    first: usize,
    rays: usize,
}

/// What every pixel of a render shares.
pub(super) struct Estimator<'a> {
    pub camera: &'a Camera,
    /// `None`: the radiance of each ray comes from a record.
    pub scene: Option<&'a Scene>,
    pub settings: &'a RenderSettings,
    pub execution: &'a Execution,
    pub sobol: SobolSet,
    /// See [`PathKey::spread`].
    pub spread: f32,
}

impl Estimator<'_> {
    /// Writes the pixel's estimate to `out[channel * subpixels + subpixel]`, counts its rays in `tally`, and adds to
    /// `occlusion` what it asks for.
    pub fn pixel(
        &self,
        aim: &PixelAim,
        mut occlusion: Option<&mut Occlusion>,
        mut kept: Kept<'_>,
        work: &mut Workspace,
        tally: &mut Tally,
        out: &mut [f64],
    ) {
        out.fill(0.0);
        let rays = self.settings.rays_per_pixel;
        let colours = self.camera.colours();
        let mut first = 0;
        for wavelength in 0..colours.count() {
            let end = colours.end_of_share(wavelength, rays, aim.key);
            while first < end {
                let block = Block {
                    wavelength,
                    first,
                    rays: (end - first).min(BLOCK),
                };
                let occlusion = occlusion.as_deref_mut();
                self.block(&block, aim, occlusion, &mut kept, work, tally, out);
                first += block.rays;
            }
        }
        let scale = aim.pupil.area_mm2() / rays as f64;
        out.iter_mut().for_each(|x| *x *= scale);
    }

    /// Adds the rays of a block, before they are scaled.
    #[allow(clippy::too_many_arguments)] // because it is the inside of `pixel`
    fn block(
        &self,
        block: &Block,
        aim: &PixelAim,
        mut occlusion: Option<&mut Occlusion>,
        kept: &mut Kept<'_>,
        work: &mut Workspace,
        tally: &mut Tally,
        out: &mut [f64],
    ) {
        let n_sub = self.camera.sensor().subpixels().count();
        let colours = self.camera.colours();
        let &Block {
            wavelength,
            first,
            rays: n,
        } = block;
        work.aim(self.camera, &self.sobol, aim, first, n);
        work.radiance.iter_mut().for_each(|l| l.resize(n, 0.0));
        let mut responded = None;
        for channel in 0..3 {
            let number = colours.response_number(channel, wavelength);
            if responded != Some(number) {
                work.respond(colours.response(number), aim, n_sub);
                responded = Some(number);
            }
            let own = channel * self.settings.rays_per_pixel + first;
            if let Kept::Read(radiance) = kept {
                work.recall(channel, &radiance[own..][..n]);
            } else if let Some(tracer) = colours.own_tracer(channel, wavelength) {
                work.trace(tracer, self.execution);
                tally.rays += n as u64;
                let lost = (0..n).filter_map(|i| work.batch.failure(i));
                lost.for_each(|f| tally.lost.count(f));
                let Workspace {
                    batch,
                    hits,
                    radiance,
                    ..
                } = &mut *work;
                let rays = RaySlices::from_batch(batch);
                let Some(scene) = self.scene else { continue };
                scene.intersect(rays, hits);
                let served = match self.camera.is_dispersive() {
                    true => channel..channel + 1,
                    false => 0..3,
                };
                let key = PathKey {
                    key: aim.key,
                    first: first as u32,
                    spread: self.spread,
                };
                scene.radiance(rays, hits, served, &key, radiance);
            }
            if let Kept::Write(radiance) = kept {
                work.keep(channel, &mut radiance[own..][..n]);
            }
            work.splat(channel, n_sub, &mut out[channel * n_sub..][..n_sub]);
            if channel == ChannelWavelengths::REFERENCE
                && let Some(occlusion) = occlusion.as_deref_mut()
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
        let start = camera_from_sensor_mm(corner, z);
        let PupilEllipse {
            centre_mm: c,
            axis_a_mm: a,
            axis_b_mm: b,
        } = aim.pupil;
        let delta_z = c.z - z;
        let [sx, sy, sp, sq] = &self.samples;
        let [ox, oy, oz, dx, dy, dz] = &mut self.aimed;
        let (sx, sy, sp, sq) = (&sx[..n], &sy[..n], &sp[..n], &sq[..n]);
        let (ox, oy, oz) = (&mut ox[..n], &mut oy[..n], &mut oz[..n]);
        let (dx, dy, dz) = (&mut dx[..n], &mut dy[..n], &mut dz[..n]);
        let measure = &mut self.measure[..n];
        for i in 0..n {
            // The sensor frame's x runs against the camera frame's.
            let (x, y) = (start.x - pitch * sx[i], start.y + pitch * sy[i]);
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

    /// The response's weight of each ray on each sub-pixel, times its measure.
    fn respond(&mut self, response: &ResponseLookup, aim: &PixelAim, n_sub: usize) {
        let n = self.measure.len();
        self.u.resize(n, 0.0);
        self.v.resize(n, 0.0);
        let [_, _, _, dx, dy, _] = &self.aimed;
        let (dx, dy) = (&dx[..n], &dy[..n]);
        // Light travels against the traced direction; see `frames::uv_from_camera_direction`.
        for i in 0..n {
            self.u[i] = dx[i] as f32;
            self.v[i] = -dy[i] as f32;
        }
        self.weights.resize(n * n_sub, 0.0);
        response.weights_under(
            aim.shift_um.to_array(),
            &mut self.u,
            &mut self.v,
            &mut self.weights,
        );
    }

    /// Traces the aimed rays from the sensor into the scene.
    fn trace(&mut self, tracer: &Tracer, execution: &Execution) {
        let b = &mut self.batch;
        let targets = [
            &mut b.ox, &mut b.oy, &mut b.oz, &mut b.dx, &mut b.dy, &mut b.dz,
        ];
        for (target, source) in targets.into_iter().zip(&self.aimed) {
            target.clone_from(source);
        }
        tracer.trace_backward(b, execution.simd);
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

    /// How much of the pupil sees another surface than the chief ray.
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
