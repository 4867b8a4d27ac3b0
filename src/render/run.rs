//! All pixels, row by row, on all threads; the result does not depend on how many there are.

use rayon::prelude::*;

use super::camera::Camera;
use super::estimator::{Estimator, Kept, Occlusion, PixelAim, Workspace};
use super::stats::Tally;
use super::{Execution, RenderSettings, RenderStats, SubPixelImage};
use crate::image::Image;
use crate::sampling::{SobolSet, hash};
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

/// Renders the camera's window. `chief_surfaces` (row-major, one a pixel, from [`super::truth`]) asks for the occlusion map;
/// `progress` hears of the rays of each finished row, from any thread.
pub fn render(
    camera: &Camera,
    scene: &Scene,
    settings: &RenderSettings,
    execution: &Execution,
    chief_surfaces: Option<&[u16]>,
    progress: &(dyn Fn(u64) + Sync),
) -> Rendered {
    let rows = Rows::new(camera, chief_surfaces, Record::No);
    let scene = Some(scene);
    run(camera, scene, settings, execution, rows, progress)
}

/// What becomes of the radiance of every ray.
pub(super) enum Record<'a> {
    No,
    /// W·H·3·rays values: see [`super::RayRecord`].
    Write(&'a mut [f32]),
    Read(&'a [f32]),
}

/// What is asked of a render beside its image.
pub(super) struct Rows<'a> {
    chief_surfaces: Option<&'a [u16]>,
    occlusion: Option<Image>,
    record: Record<'a>,
}

impl<'a> Rows<'a> {
    pub fn new(camera: &Camera, chief_surfaces: Option<&'a [u16]>, record: Record<'a>) -> Self {
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        Self {
            chief_surfaces,
            occlusion: chief_surfaces.map(|_| Image::zeros(width, height, 1)),
            record,
        }
    }
}

/// A row of the image, its part of the occlusion map (or nothing) and of the record.
struct Row<'a> {
    mosaic: &'a mut [f32],
    occlusion: &'a mut [f32],
    kept: Vec<Kept<'a>>,
}

/// Renders all rows; without a scene, from the record.
pub(super) fn run(
    camera: &Camera,
    scene: Option<&Scene>,
    settings: &RenderSettings,
    execution: &Execution,
    mut asked: Rows<'_>,
    progress: &(dyn Fn(u64) + Sync),
) -> Rendered {
    let sensor = camera.sensor();
    let (width, height, sub) = (sensor.width(), sensor.height(), sensor.subpixels());
    let (m, n) = (sub.m(), sub.n());
    let sobol = SobolSet::new(settings.rays_per_pixel);
    let estimator = Estimator {
        camera,
        scene,
        settings,
        execution,
        sobol,
        spread: camera.ray_spread(settings.rays_per_pixel),
    };
    let mut mosaic = Image::zeros(width * m, height * n, 3);
    let second_seed = hash(settings.seed, &[0x5EC0_11D0]);

    let render_row = |(row, out): (usize, Row<'_>)| {
        let mut work = Workspace::default();
        let mut tally = Tally::default();
        let mut values = vec![0.0; 3 * sub.count()];
        let mut again = values.clone();
        for (column, kept) in out.kept.into_iter().enumerate() {
            let Some(aim) = PixelAim::new(camera, settings.seed, column, row) else {
                continue;
            };
            let mut others = asked.chief_surfaces.map(|s| Occlusion {
                chief_surface: s[row * width + column],
                other: 0.0,
                all: 0.0,
            });
            estimator.pixel(
                &aim,
                others.as_mut(),
                kept,
                &mut work,
                &mut tally,
                &mut values,
            );
            if let Some(others) = others.filter(|o| o.all > 0.0) {
                out.occlusion[column] = (others.other / others.all) as f32;
            }
            if scene.is_some() && row % SPREAD_STRIDE == 0 && column % SPREAD_STRIDE == 0 {
                let aim = PixelAim {
                    key: hash(second_seed, &[column as u64, row as u64]),
                    ..aim
                };
                estimator.pixel(&aim, None, Kept::No, &mut work, &mut tally, &mut again);
                let squares = values.iter().zip(&again).map(|(a, b)| (a - b) * (a - b));
                tally.squared_difference += squares.sum::<f64>();
                tally.pairs += values.len() as u64;
            }
            for (channel, of_channel) in values.chunks_exact(sub.count()).enumerate() {
                for (index, &value) in of_channel.iter().enumerate() {
                    let (x, y) = (column * m + index % m, index / m);
                    out.mosaic[(y * width * m + x) * 3 + channel] = value as f32;
                }
            }
        }
        progress(tally.rays);
        tally
    };

    let of_pixel = 3 * settings.rays_per_pixel;
    let mut kept: Vec<Vec<Kept<'_>>> = match &mut asked.record {
        Record::No => (0..height)
            .map(|_| (0..width).map(|_| Kept::No).collect())
            .collect(),
        Record::Write(all) => (all.chunks_mut(of_pixel * width))
            .map(|row| row.chunks_mut(of_pixel).map(Kept::Write).collect())
            .collect(),
        Record::Read(all) => (all.chunks(of_pixel * width))
            .map(|row| row.chunks(of_pixel).map(Kept::Read).collect())
            .collect(),
    };
    kept.truncate(height);
    let mut occlusion: Vec<&mut [f32]> = match &mut asked.occlusion {
        Some(map) => map.data_mut().chunks_mut(width).collect(),
        None => (0..height).map(|_| &mut [][..]).collect(),
    };
    let rows: Vec<Row<'_>> = (mosaic.data_mut().chunks_mut(width * m * n * 3))
        .zip(occlusion.drain(..))
        .zip(kept)
        .map(|((mosaic, occlusion), kept)| Row {
            mosaic,
            occlusion,
            kept,
        })
        .collect();
    // Collected in row order and summed in it, so that even the sums' rounding does not depend on the threads.
    let tallies: Vec<Tally> = rows.into_par_iter().enumerate().map(render_row).collect();
    let tally = tallies.into_iter().fold(Tally::default(), Tally::merge);
    let mean =
        mosaic.data().iter().map(|&x| f64::from(x)).sum::<f64>() / mosaic.data().len() as f64;
    let relative_spread = (mean > 0.0 && tally.pairs > 0)
        .then(|| (tally.squared_difference / (2.0 * tally.pairs as f64)).sqrt() / mean);
    Rendered {
        image: SubPixelImage {
            subpixels: sub,
            mosaic,
        },
        stats: RenderStats {
            rays: tally.rays,
            lost: tally.lost,
            relative_spread,
        },
        occlusion: asked.occlusion,
    }
}
