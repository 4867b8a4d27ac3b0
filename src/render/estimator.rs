//! One pixel: aim rays, weigh them by the response, trace them, splat their radiance on all sub-pixels.

use super::camera::Camera;
use super::lamp_rays::lamp_sketches;
use super::occlusion::Occlusion;
use super::pixel_aim::PixelAim;
use super::workspace::{TracedColour, Workspace};
use super::{Execution, RenderSettings};
use crate::sampling::SobolSet;
use crate::scene::Scene;
use crate::scene::world::{Lamp, PathKey};
use crate::spectrum::ChannelWavelengths;

/// Rays handled together: their arrays stay in the L1 and L2 caches.
const BLOCK: usize = 256;

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
    /// Of the scene.
    lamps: &'a [Lamp],
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
            lamps: scene
                .and_then(Scene::world)
                .map_or(&[], |(world, _)| world.lamps()),
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
            self.find_lamps(wavelength, task, work);
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

    /// The lamps of which few rays would meet any. Rays towards them have no place in a record.
    fn find_lamps(&self, wavelength: usize, task: &PixelTask<'_>, work: &mut Workspace) {
        work.lamp_sketches.clear();
        if !self.lamps.is_empty() && matches!(task.record, RadianceRecord::None) {
            let colours = self.camera.colours();
            let tracers = (0..3).filter_map(|channel| colours.own_tracer(channel, wavelength));
            work.lamp_sketches = lamp_sketches(self.camera, tracers, task.aim, self.lamps);
        }
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
        let rays = (first, n);
        work.aim(self.camera, &self.sobol, task.aim, rays, &self.execution);
        work.diffract(self.camera, &self.sobol, task.aim, first);
        let n = work.measure.len();
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
