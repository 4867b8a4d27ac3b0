//! One pixel: aim rays, weigh them by the response, trace them, splat their radiance on all sub-pixels.

use super::camera::Camera;
use super::control::Control;
use super::diffraction::PlaceDiffraction;
use super::far;
use super::footprints::Footprints;
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
const BLOCK: usize = 1024;
/// Pixels handled together, at most, where a wavelength's share of a pixel's rays is less than a block.
const RUN: usize = 128;

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
    control: Option<Control<'a>>,
    footprints: Option<&'a Footprints>,
    tells_far: bool,
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
            control: None,
            footprints: None,
            tells_far: false,
        }
    }

    /// With what a white wall is known to give.
    pub fn control(self, control: Option<Control<'a>>) -> Self {
        Self { control, ..self }
    }

    /// With what rays stand for on the scene's cards; `far`: rays that diffraction displaces far are told from others
    /// ([`Workspace::far`]).
    pub fn footprints(self, footprints: Option<&'a Footprints>, far: bool) -> Self {
        Self {
            scene: match (self.scene, footprints) {
                (Some(_), Some(footprints)) => Some(footprints.scene()),
                (scene, _) => scene,
            },
            footprints,
            tells_far: far && footprints.is_some() && self.camera.lens_diffraction().is_some(),
            ..self
        }
    }

    /// See [`Self::footprints`].
    pub fn tells_far(&self) -> bool {
        self.tells_far
    }

    /// Entries of a [`RadianceRecord`] per pixel.
    pub fn record_len(&self) -> usize {
        3 * self.settings.rays_per_pixel
    }

    /// Pixels next to each other in a row that are best handled together. Those of a world are not: their rays towards
    /// lamps, and the random numbers of their paths, are each pixel's own.
    pub fn run_length(&self) -> usize {
        if self.scene.is_some_and(|scene| scene.world().is_some()) {
            return 1;
        }
        let colours = self.camera.colours();
        let share = self.settings.rays_per_pixel.div_ceil(colours.count());
        (BLOCK / share.max(1)).clamp(1, RUN)
    }

    /// Writes the estimate of each of a run of pixels to its part of `out`, `[channel * subpixels + subpixel]`, and
    /// counts the rays in the workspace's tally.
    pub fn run(&self, tasks: &mut [PixelTask<'_>], work: &mut Workspace, out: &mut [f64]) {
        if tasks.is_empty() {
            return;
        }
        out.fill(0.0);
        work.stand_for(
            self.footprints,
            tasks.iter().map(|task| task.aim.position_mm),
        );
        work.walls.clear();
        if self.control.is_some() {
            work.walls.resize(out.len(), 0.0);
        }
        work.far.iter_mut().for_each(Vec::clear);
        if self.tells_far {
            work.far
                .iter_mut()
                .for_each(|far| far.resize(out.len(), 0.0));
        }
        let rays = self.settings.rays_per_pixel;
        let colours = self.camera.colours();
        let most = match tasks.len() {
            1 => BLOCK,
            pixels => BLOCK / pixels + 1,
        };
        let mut next = [0; RUN];
        let diffraction = self.camera.lens_diffraction();
        let draws: Vec<PlaceDiffraction<'_>> = (tasks.iter())
            .filter_map(|task| Some(diffraction?.at(task.aim.position_mm, task.aim.key)))
            .collect();
        for wavelength in 0..colours.count() {
            self.find_lamps(wavelength, tasks, work);
            loop {
                work.clear();
                for (number, (task, next)) in tasks.iter().zip(&mut next).enumerate() {
                    let left = colours.end_of_share(wavelength, rays, task.aim.key) - *next;
                    let part = (*next, left.min(most));
                    work.aim(self.camera, &self.sobol, task.aim, part, &self.execution);
                    if let Some(here) = draws.get(number) {
                        work.diffract(here, &self.sobol, task.aim);
                    }
                    *next += part.1;
                }
                if work.measure.is_empty() {
                    break;
                }
                self.block(wavelength, tasks, work, out);
            }
        }
        let each = out.len() / tasks.len();
        for (pixel, (task, values)) in tasks.iter().zip(out.chunks_exact_mut(each)).enumerate() {
            let scale = task.aim.pupil.area_mm2() / rays as f64;
            let [light, whites] = (work.far.each_mut()).map(|all| {
                all.get_mut(pixel * each..(pixel + 1) * each)
                    .unwrap_or_default()
            });
            let sums = [values, light, whites];
            let mut sums = sums.map(|sum| {
                sum.iter_mut().for_each(|x| *x *= scale);
                sum
            });
            if let Some(control) = &self.control {
                let walls = &mut work.walls[pixel * each..][..each];
                walls.iter_mut().for_each(|x| *x *= scale);
                control.apply(
                    task.aim.position_mm,
                    walls,
                    sums.each_mut().map(|s| &mut **s),
                    &mut work.known,
                );
            }
        }
    }

    /// The lamps of which few rays would meet any. Rays towards them have no place in a record.
    fn find_lamps(&self, wavelength: usize, tasks: &[PixelTask<'_>], work: &mut Workspace) {
        work.lamp_sketches.clear();
        if let ([task], false) = (tasks, self.lamps.is_empty())
            && matches!(task.record, RadianceRecord::None)
        {
            let colours = self.camera.colours();
            let tracers = (0..3).filter_map(|channel| colours.own_tracer(channel, wavelength));
            work.lamp_sketches = lamp_sketches(self.camera, tracers, task.aim, self.lamps);
        }
    }

    /// Adds the rays of a block, which are aimed, before they are scaled.
    fn block(
        &self,
        wavelength: usize,
        tasks: &mut [PixelTask<'_>],
        work: &mut Workspace,
        out: &mut [f64],
    ) {
        let sensor = self.camera.sensor();
        let n_sub = sensor.subpixels().count();
        let colours = self.camera.colours();
        let n = work.measure.len();
        work.radiance.iter_mut().for_each(|l| l.resize(n, 0.0));
        let mut responded = None;
        for channel in 0..3 {
            let number = colours.response_number(channel, wavelength);
            if responded != Some(number) {
                let shifts_um = tasks.iter().map(|task| task.aim.shift_um);
                work.respond(colours.response(number), shifts_um, n_sub);
                responded = Some(number);
            }
            if self.scene.is_none() {
                work.find_none_lost();
            } else if let Some(tracer) = colours.own_tracer(channel, wavelength) {
                let colour = TracedColour {
                    tracer,
                    map: colours.map(channel, wavelength),
                    wavelength_mm: colours.traced_nm(channel, wavelength) * 1e-6,
                };
                work.trace(&colour, sensor.pitch_mm(), &self.execution);
                self.look(channel, tasks, work);
            }
            for (pixel, task) in tasks.iter_mut().enumerate() {
                let (first, rays) = {
                    let segment = &work.segments[pixel];
                    (segment.first, segment.rays.len())
                };
                let start = channel * self.settings.rays_per_pixel + first;
                match &mut task.record {
                    RadianceRecord::None => {}
                    RadianceRecord::Read(all) => {
                        work.recall(channel, pixel, &all[start..][..rays]);
                    }
                    RadianceRecord::Write(all) => {
                        work.keep(channel, pixel, &mut all[start..][..rays]);
                    }
                }
                let sums = (pixel * 3 + channel) * n_sub..(pixel * 3 + channel + 1) * n_sub;
                let wavelength_mm = colours.traced_nm(channel, wavelength) * 1e-6;
                let far_from =
                    far::from(work.segments[pixel].phase, wavelength_mm, sensor.pitch_mm());
                work.splat((channel, pixel), far_from, &mut out[sums.clone()], sums);
                if channel == ChannelWavelengths::REFERENCE
                    && let Some(occlusion) = &mut task.occlusion
                {
                    work.count_others(pixel, occlusion);
                }
            }
        }
    }

    /// The radiance along the traced rays, of one channel or of all that they serve.
    fn look(&self, channel: usize, tasks: &[PixelTask<'_>], work: &mut Workspace) {
        let (Some(scene), Some(task)) = (self.scene, tasks.first()) else {
            return;
        };
        let served = match self.camera.is_dispersive() {
            true => channel..channel + 1,
            false => 0..3,
        };
        let first = work.segments[0].first;
        let key = |ray| PathKey {
            key: task.aim.key,
            number: (first + ray) as u32,
            spread: self.spread,
        };
        match self.footprints {
            Some(footprints) => work.look_around(footprints, served, key),
            None => work.look(scene, served, key),
        }
    }
}
