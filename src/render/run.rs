//! All pixels, row by row, on all threads; the result does not depend on how many there are.

use rayon::prelude::*;

use super::camera::Camera;
use super::control::Control;
use super::estimator::{Estimator, PixelTask, RadianceRecord};
use super::far::{FarLight, smoothed_pair};
use super::footprints::Footprints;
use super::ghosts::ghost_light;
use super::occlusion::Occlusion;
use super::pixel_aim::PixelAim;
use super::record::{RayRecord, RecordError};
use super::stats::Tally;
use super::truth::WhiteField;
use super::workspace::Workspace;
use super::{Execution, RenderSettings, RenderStats, SubPixelImage};
use crate::image::Image;
use crate::progress::Progress;
use crate::sampling::hash;
use crate::scene::Scene;

/// Every 8th pixel of every 8th row is rendered a second time with other samples, to measure the spread.
const SPREAD_STRIDE: usize = 8;

/// A render and what it says of itself.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The mosaic, in sr times the unit of radiance.
    pub image: SubPixelImage,
    /// Rays, lost rays, spread.
    pub stats: RenderStats,
    /// Per pixel, the fraction of the passing pupil that sees another surface than the chief ray: W × H × 1, where
    /// the surfaces of the chief rays were given.
    pub occlusion: Option<Image>,
}

/// Renders the camera's window. [`Render`] takes more: an occlusion map, a record of the rays, who hears of progress.
pub fn render(camera: &Camera, scene: &Scene, settings: &RenderSettings) -> Rendered {
    Render::new(camera, scene, settings).run()
}

/// A render to be: what [`render`] takes, and what may be asked for beside the image.
#[derive(Clone, Copy)]
pub struct Render<'a> {
    camera: &'a Camera,
    scene: &'a Scene,
    settings: &'a RenderSettings,
    execution: Execution,
    chief_surfaces: Option<&'a [u16]>,
    white: Option<&'a WhiteField>,
    footprints: Option<&'a Footprints>,
    progress: &'a dyn Progress,
}

impl<'a> Render<'a> {
    /// The image alone, with the best instructions of this processor.
    pub fn new(camera: &'a Camera, scene: &'a Scene, settings: &'a RenderSettings) -> Self {
        Self {
            camera,
            scene,
            settings,
            execution: Execution::default(),
            chief_surfaces: None,
            white: None,
            footprints: None,
            progress: &(),
        }
    }

    /// With other instructions, which changes no bit.
    pub fn execution(self, execution: Execution) -> Self {
        Self { execution, ..self }
    }

    /// With the occlusion map, for which the surfaces that the chief rays meet are needed: row-major, one per pixel,
    /// from [`super::truth`].
    pub fn occlusion(self, chief_surfaces: impl Into<Option<&'a [u16]>>) -> Self {
        Self {
            chief_surfaces: chief_surfaces.into(),
            ..self
        }
    }

    /// With less noise by what a white wall gives this camera: each sub-pixel is scaled by that over what its own rays
    /// give of such a wall. It changes nothing where there are fewer than
    /// [`LEAST_RAYS_PER_SUBPIXEL`](super::LEAST_RAYS_PER_SUBPIXEL), or rays are kept.
    pub fn white(self, white: &'a WhiteField) -> Self {
        Self {
            white: Some(white),
            ..self
        }
    }

    /// With less noise by what rays stand for on the cards of the scene, of which these are.
    pub fn footprints(self, footprints: impl Into<Option<&'a Footprints>>) -> Self {
        Self {
            footprints: footprints.into(),
            ..self
        }
    }

    /// `progress` hears of the rays of each finished row.
    pub fn progress(self, progress: &'a dyn Progress) -> Self {
        Self { progress, ..self }
    }

    /// Renders.
    pub fn run(self) -> Rendered {
        self.run_into(RadianceRecord::None)
    }

    /// Renders, and keeps the radiance of every ray. Without the additional rays towards small lamps, whose number
    /// differs from pixel to pixel: pictures of lamps have more noise. Without ghosts, too.
    ///
    /// # Errors
    /// [`RecordError::TooLarge`] for a window and ray count beyond [`RayRecord::MAX_BYTES`].
    pub fn run_recorded(self) -> Result<(Rendered, RayRecord), RecordError> {
        let mut radiance = RayRecord::space(self.camera, self.settings)?;
        let rendered = self.run_into(RadianceRecord::Write(&mut radiance));
        let summary = (rendered.occlusion.clone(), rendered.stats);
        let record = RayRecord::new(self.camera, self.settings, radiance, summary);
        Ok((rendered, record))
    }

    fn run_into(self, record: RadianceRecord<'_>) -> Rendered {
        let far = matches!(record, RadianceRecord::None);
        let (ghosts, control) = match record {
            RadianceRecord::None => (
                ghost_light(self.camera, self.scene, self.settings),
                (self.white).and_then(|w| Control::new(self.camera, self.settings, w)),
            ),
            _ => (None, None),
        };
        let estimator =
            Estimator::new(self.camera, Some(self.scene), self.settings, self.execution);
        let mut rendered = Job {
            estimator: estimator.control(control).footprints(self.footprints, far),
            chief_surfaces: self.chief_surfaces,
            progress: self.progress,
        }
        .run(record);
        let mosaic = rendered.image.mosaic.data_mut();
        for (value, ghost) in mosaic.iter_mut().zip(ghosts.iter().flatten()) {
            *value += *ghost as f32;
        }
        rendered
    }
}

impl RayRecord {
    /// The image of another pixel (response, sub-pixels, shift rule) under the same rays. Its `errors` are not
    /// known; rays and losses are those of the record.
    ///
    /// # Errors
    /// [`RecordError::OtherCamera`] for a camera with another window, pitch, lens or focus.
    pub fn develop(&self, camera: &Camera) -> Result<Rendered, RecordError> {
        self.check_camera(camera)?;
        let settings = self.settings();
        let job = Job {
            estimator: Estimator::new(camera, None, &settings, Execution::default()),
            chief_surfaces: None,
            progress: &(),
        };
        Ok(Rendered {
            stats: RenderStats {
                errors: None,
                ..*self.stats()
            },
            occlusion: self.occlusion().cloned(),
            ..job.run(RadianceRecord::Read(self.radiance()))
        })
    }
}

/// What all rows share.
struct Job<'a> {
    estimator: Estimator<'a>,
    chief_surfaces: Option<&'a [u16]>,
    progress: &'a dyn Progress,
}

/// A row of the image, its part of the occlusion map (or nothing) and of the record.
struct Row<'a> {
    number: usize,
    mosaic: &'a mut [f32],
    /// Light and walls of [`FarLight`]; empty without.
    far: [&'a mut [f32]; 2],
    occlusion: &'a mut [f32],
    record: RadianceRecord<'a>,
}

impl Job<'_> {
    fn run(&self, record: RadianceRecord<'_>) -> Rendered {
        let sensor = self.estimator.camera.sensor();
        let (width, height, subpixels) = (sensor.width(), sensor.height(), sensor.subpixels());
        let (m, n) = (subpixels.m(), subpixels.n());
        let mut mosaic = Image::zeros(width * m, height * n, 3);
        let mut occlusion = self.chief_surfaces.map(|_| Image::zeros(width, height, 1));
        let mut occlusion_rows: Vec<&mut [f32]> = match &mut occlusion {
            Some(map) => map.data_mut().chunks_mut(width).collect(),
            None => (0..height).map(|_| &mut [][..]).collect(),
        };
        let mut far = (self.estimator.tells_far()).then(|| FarLight::like(&mosaic));
        let line = width * m * n * 3;
        let mut far_rows: Vec<[&mut [f32]; 2]> = match &mut far {
            Some(far) => far.rows_mut(line).collect(),
            None => (0..height).map(|_| [&mut [][..], &mut []]).collect(),
        };
        let record_rows = record.split(self.estimator.record_len() * width, height);
        let rows: Vec<Row<'_>> = (mosaic.data_mut().chunks_mut(line))
            .zip(far_rows.drain(..))
            .zip(occlusion_rows.drain(..))
            .zip(record_rows)
            .enumerate()
            .map(|(number, (((mosaic, far), occlusion), record))| Row {
                number,
                mosaic,
                far,
                occlusion,
                record,
            })
            .collect();
        // Collected in row order and summed in it, so that even the sums' rounding does not depend on the threads.
        let tallies: Vec<Tally> = (rows.into_par_iter().map(|row| self.render_row(row))).collect();
        let tally = tallies.into_iter().fold(Tally::default(), Tally::merge);
        if let Some(far) = &far {
            far.add_to(&mut mosaic, (m, n));
        }
        let stats = tally.stats(mosaic.data());
        Rendered {
            image: SubPixelImage { subpixels, mosaic },
            stats,
            occlusion,
        }
    }

    fn render_row(&self, row: Row<'_>) -> Tally {
        let Row {
            number,
            mosaic,
            mut far,
            occlusion,
            record,
        } = row;
        let estimator = &self.estimator;
        let width = estimator.camera.sensor().width();
        let count = estimator.camera.sensor().subpixels().count();
        let mut work = Workspace::default();
        let mut values = Vec::new();
        let length = estimator.run_length();
        let mut records = record.split(estimator.record_len(), width).into_iter();
        for begin in (0..width).step_by(length) {
            let columns = begin..(begin + length).min(width);
            let lit: Vec<(usize, PixelAim)> = columns
                .clone()
                .filter_map(|column| {
                    let aim =
                        PixelAim::new(estimator.camera, estimator.settings.seed, column, number)?;
                    Some((column, aim))
                })
                .collect();
            let mut own: Vec<_> = records.by_ref().take(columns.len()).map(Some).collect();
            let mut tasks: Vec<PixelTask<'_>> = lit
                .iter()
                .map(|(column, aim)| PixelTask {
                    aim,
                    occlusion: self
                        .chief_surfaces
                        .map(|s| Occlusion::beside(s[number * width + column])),
                    record: own[column - begin].take().unwrap_or(RadianceRecord::None),
                })
                .collect();
            values.resize(tasks.len() * 3 * count, 0.0);
            estimator.run(&mut tasks, &mut work, &mut values);
            let shares: Vec<Option<f32>> = tasks
                .iter()
                .map(|task| task.occlusion.as_ref().and_then(Occlusion::share))
                .collect();
            let run_far = work.far.each_mut().map(std::mem::take);
            let each = lit.iter().zip(values.chunks_exact(3 * count)).zip(shares);
            for (pixel, (((column, aim), values), share)) in each.enumerate() {
                let own = pixel * 3 * count..(pixel + 1) * 3 * count;
                let own_far =
                    (run_far.each_ref()).map(|all| all.get(own.clone()).unwrap_or_default());
                if let Some(share) = share {
                    occlusion[*column] = share;
                }
                let is_repeated = number % SPREAD_STRIDE == 0 && column % SPREAD_STRIDE == 0;
                if estimator.scene.is_some() && is_repeated {
                    self.repeat((*column, number), aim, &mut work, (values, own_far));
                }
                self.store(*column, values, mosaic);
                for (far, own) in far.iter_mut().zip(own_far) {
                    self.store(*column, own, far);
                }
            }
            work.far = run_far;
        }
        self.progress.rays(work.tally.rays);
        work.tally
    }

    /// Renders a pixel with other samples and tallies the difference to its `values` and far light.
    fn repeat(
        &self,
        (column, row): (usize, usize),
        aim: &PixelAim,
        work: &mut Workspace,
        (values, far): (&[f64], [&[f64]; 2]),
    ) {
        let second_seed = hash(self.estimator.settings.seed, &[0x5EC0_11D0]);
        let aim = PixelAim {
            key: hash(second_seed, &[column as u64, row as u64]),
            ..*aim
        };
        let mut again = vec![0.0; values.len()];
        (self.estimator).run(&mut [PixelTask::image_only(&aim)], work, &mut again);
        for (i, (&a, &b)) in values.iter().zip(&again).enumerate() {
            let at = |far: &[f64]| far.get(i).copied().unwrap_or(0.0);
            let [first, second] = [far, work.far.each_ref().map(Vec::as_slice)]
                .map(|[light, walls]| (at(light), at(walls)));
            let (a, b) = smoothed_pair((a, first), (b, second));
            work.tally.count_pair(a, b);
        }
    }

    /// Writes a pixel's values, [channel][sub-pixel], into the row's part of the mosaic.
    fn store(&self, column: usize, values: &[f64], mosaic: &mut [f32]) {
        let sensor = self.estimator.camera.sensor();
        let (width, m) = (sensor.width(), sensor.subpixels().m());
        if values.is_empty() {
            return;
        }
        for (channel, subpixels) in values.chunks_exact(values.len() / 3).enumerate() {
            for (index, &value) in subpixels.iter().enumerate() {
                let (x, y) = (column * m + index % m, index / m);
                mosaic[(y * width * m + x) * 3 + channel] = value as f32;
            }
        }
    }
}
