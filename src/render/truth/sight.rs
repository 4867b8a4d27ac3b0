//! What each pixel of the maps refers to: depth, distance, the surface seen.
//!
//! One ray of sight per pixel, of one of two kinds. By the **chief ray**: through the centre of the stop at the
//! reference wavelength, or, where the lens clips it (a strongly vignetted field), through the middle of the passing
//! bundle. By the **centroid**: the line of the mean of what the sum of the sub-pixels sees at each depth
//! ([`SightLine`]), so that the maps and the target stand where the sum stands, coma and clipped pupils included.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::disparity::{DisparityField, shift_to_sum};
use super::sight_field::SightLines;
use super::sight_line::SightLine;
use crate::field::FieldGrid;
use crate::frames::camera_from_sensor_mm;
use crate::image::Image;
use crate::rays::{RayBatch, RaySlices, RayStatus};
use crate::render::Camera;
use crate::render::pixel_aim::pixel_origin_mm;
use crate::scene::{Hits, NO_SURFACE, Scene};
use crate::simd::SimdLevel;
use crate::spectrum::ChannelWavelengths;

/// Rays of sight over the window; see the module.
#[derive(Clone, Debug)]
pub struct SightRays {
    by: By,
}

#[derive(Clone, Debug)]
enum By {
    /// Slopes (dx/dz, dy/dz) of the chief rays at the sensor, and their lines in front of the lens.
    ChiefRay { slopes: FieldGrid, lines: FieldGrid },
    /// One for all channels, or one each.
    Centroid(Vec<DisparityField>),
}

/// What the rays of sight meet: W × H maps.
#[derive(Clone, Debug)]
pub struct GeometryTruth {
    /// Depth −z, mm, 1 channel; +∞ where the ray of sight meets nothing, NaN where there is none.
    pub depth_mm: Image,
    /// Distance of the point seen from the first lens vertex (the origin), mm, 1 channel; as depth.
    pub distance_mm: Image,
    /// Index of the surface that the ray of sight meets, row-major; [`NO_SURFACE`] where none.
    pub surfaces: Vec<u16>,
    /// Unit normal of a world's surface on the camera's side, camera frame, 3 channels; 0 where nothing (or a card) is
    /// met, NaN where there is no ray of sight.
    pub normals: Image,
}

impl SightRays {
    /// The chief rays of the camera's window.
    pub fn chief_rays(camera: &Camera) -> Self {
        let sensor = camera.sensor();
        let window = sensor.window_mm();
        let size = (
            FieldGrid::nodes_for(sensor.width()),
            FieldGrid::nodes_for(sensor.height()),
        );
        let places = (0..size.0 * size.1)
            .map(|k| FieldGrid::node_mm(window, size, (k % size.0, k / size.0)));
        let places: Vec<DVec2> = places.collect();
        let slope = |(p, chief): (&DVec2, Option<DVec2>)| match (chief, camera.pupil_at(*p)) {
            (Some(slope), _) => slope,
            (None, Some(pupil)) => {
                let e = pupil.centre_mm - camera_from_sensor_mm(*p, camera.sensor_z_mm());
                e.truncate() / e.z
            }
            (None, None) => DVec2::NAN,
        };
        let slopes: Vec<DVec2> = (places.par_chunks(size.0))
            .flat_map_iter(|row| row.iter().zip(camera.chief_slopes(row)).map(slope))
            .collect();
        let mut batch = RayBatch::default();
        for (place, slope) in places.iter().zip(&slopes) {
            let origin = camera_from_sensor_mm(*place, camera.sensor_z_mm());
            batch.push(origin, away(*slope));
        }
        (camera.reference_tracer()).trace_backward(&mut batch, SimdLevel::detect());
        let lines = (0..batch.len()).flat_map(|k| {
            let line = batch.get(k).map(|ray| SightLine::from_ray(&ray));
            let [q0, q1] = line.map_or([DVec2::NAN; 2], |line| [line.q0, line.q1_mm]);
            [q0.x, q0.y, q1.x, q1.y]
        });
        let grid = |components: usize, data: Vec<f64>| {
            FieldGrid::new(window, size, components, data)
                .unwrap_or_else(|| unreachable!("components a node"))
        };
        Self {
            by: By::ChiefRay {
                lines: grid(4, lines.collect()),
                slopes: grid(2, slopes.iter().flat_map(|s| [s.x, s.y]).collect()),
            },
        }
    }

    /// The lines of the sum's centroids, of the fields of each channel ([`DisparityField::of_channels`]).
    pub fn centroids(fields: &[DisparityField]) -> Self {
        Self {
            by: By::Centroid(fields.to_vec()),
        }
    }

    /// Traces the ray of sight of each pixel centre, in the reference channel.
    pub fn geometry(&self, camera: &Camera, scene: &Scene) -> GeometryTruth {
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let mut depth = Image::zeros(width, height, 1);
        let mut distance = Image::zeros(width, height, 1);
        let mut normals = Image::zeros(width, height, 3);
        let mut surfaces = vec![NO_SURFACE; width * height];
        let rows = depth
            .data_mut()
            .par_chunks_mut(width)
            .zip(distance.data_mut().par_chunks_mut(width));
        let others = surfaces
            .par_chunks_mut(width)
            .zip(normals.data_mut().par_chunks_mut(3 * width));
        rows.zip(others)
            .enumerate()
            .for_each(|(row, ((depth, distance), (surfaces, normals)))| {
                let batch = self.rays_of_row(camera, row);
                let hits = met(scene, &batch);
                for i in 0..width {
                    let (z, d) = match (batch.get(i), hits.surface[i]) {
                        (Ok(_), NO_SURFACE) => (f64::INFINITY, f64::INFINITY),
                        (Ok(ray), _) => {
                            let point = ray.origin_mm + hits.distance_mm[i] * ray.direction;
                            (-point.z, point.length())
                        }
                        _ => (f64::NAN, f64::NAN),
                    };
                    (depth[i], distance[i]) = (z as f32, d as f32);
                    let lost = if batch.status[i] == 0 { 0.0 } else { f32::NAN };
                    let normal = hits
                        .world
                        .normal
                        .get(i)
                        .copied()
                        .unwrap_or_default()
                        .as_vec3();
                    normals[3 * i..][..3].copy_from_slice(&(normal + lost).to_array());
                    surfaces[i] = if batch.status[i] == 0 {
                        hits.surface[i]
                    } else {
                        NO_SURFACE
                    };
                }
            });
        GeometryTruth {
            depth_mm: depth,
            distance_mm: distance,
            surfaces,
            normals,
        }
    }

    /// The line of sight of a sensor position in the reference channel; `None` where there is none.
    pub fn line(&self, camera: &Camera, xy_mm: DVec2) -> Option<SightLine> {
        let sensor = camera.sensor();
        let window = sensor.window_mm();
        let corner = window.centre - DVec2::new(window.half_width, window.half_height);
        let place = (xy_mm - corner) / sensor.pitch_mm() - 0.5;
        let places = std::iter::once((place.x, place.y));
        let batch = self.rays(camera, ChannelWavelengths::REFERENCE, places);
        Some(SightLine::from_ray(&batch.get(0).ok()?))
    }

    /// What the rays of sight of each pixel centre see of known depths, a W × H × 1 map in mm (NaN: not valid).
    pub fn geometry_at(&self, camera: &Camera, depth_mm: Image) -> GeometryTruth {
        let (width, height) = (depth_mm.width(), depth_mm.height());
        let mut distance = Image::zeros(width, height, 1);
        let rows = distance.data_mut().par_chunks_mut(width).enumerate();
        rows.for_each(|(row, out)| {
            let batch = self.rays_of_row(camera, row);
            for (column, out) in out.iter_mut().enumerate() {
                let depth = f64::from(depth_mm.pixel(column, row)[0]);
                *out = batch.get(column).map_or(f32::NAN, |ray| {
                    let line = SightLine::from_ray(&ray);
                    match depth.is_infinite() {
                        true => f32::INFINITY,
                        false => (line.q0 * depth + line.q1_mm).extend(depth).length() as f32,
                    }
                });
            }
        });
        GeometryTruth {
            surfaces: vec![NO_SURFACE; width * height],
            normals: Image::zeros(width, height, 3),
            distance_mm: distance,
            depth_mm,
        }
    }

    /// Whether each channel has rays of sight of its own.
    pub(super) fn has_channels(&self) -> bool {
        matches!(&self.by, By::Centroid(fields) if fields.len() == 3)
    }

    /// Rays of sight of stored-image places (column, row), in front of the lens.
    pub(super) fn rays(
        &self,
        camera: &Camera,
        channel: usize,
        places: impl Iterator<Item = (f64, f64)>,
    ) -> RayBatch {
        let mut batch = RayBatch::default();
        match &self.by {
            By::ChiefRay { slopes, .. } => {
                for (column, row) in places {
                    let mut slope = [0.0; 2];
                    slopes.sample(camera.sensor().position_mm(column, row), &mut slope);
                    let origin = pixel_origin_mm(camera, column, row);
                    batch.push(origin, away(DVec2::from(slope)));
                }
                let tracer = camera.reference_tracer();
                tracer.trace_backward(&mut batch, SimdLevel::detect());
            }
            By::Centroid(fields) => {
                let field = &fields[channel.min(fields.len() - 1)];
                let count = places.size_hint().0;
                let places = places.map(|(column, row)| camera.sensor().position_mm(column, row));
                batch = along(places.map(|place| field.sight_line(place)), count);
            }
        }
        batch
    }

    /// Rays of sight, in front of the lens, of rows of places a pixel apart, each from a column and row on over the
    /// sensor's width.
    pub(super) fn rays_of_rows(
        &self,
        camera: &Camera,
        channel: usize,
        rows: impl Iterator<Item = (f64, f64)>,
    ) -> RayBatch {
        let columns = |first: f64| (0..camera.sensor().width()).map(move |c| c as f64 + first);
        match &self.by {
            By::ChiefRay { .. } => {
                let places = rows.flat_map(|(first, row)| columns(first).map(move |c| (c, row)));
                self.rays(camera, channel, places)
            }
            By::Centroid(fields) => {
                let sight = fields[channel.min(fields.len() - 1)].sight();
                let count = rows.size_hint().0 * camera.sensor().width();
                let lines = rows.flat_map(|(first, row)| {
                    let lines = sight.lines(camera.sensor().position_mm(first, row).y);
                    let places = columns(first).map(move |c| camera.sensor().position_mm(c, row));
                    places.map(move |place| lines.at(place.x))
                });
                along(lines, count)
            }
        }
    }

    /// Those of the pixels of a row in the reference channel.
    fn rays_of_row(&self, camera: &Camera, row: usize) -> RayBatch {
        let row = std::iter::once((0.0, row as f64));
        self.rays_of_rows(camera, ChannelWavelengths::REFERENCE, row)
    }

    /// Where the sum shows, at each pixel, the point that the chief ray meets there at the depths of a W × H × 1 map in
    /// mm, from that pixel: W × H × 2 (ΔX right, ΔY down), px, NaN where not valid. `field` is the reference channel's.
    /// Chief rays are taken between nodes as the sum's lines are, so that what both err by falls out.
    pub fn chief_to_sum_px(
        &self,
        camera: &Camera,
        field: &DisparityField,
        depth_mm: &Image,
    ) -> Image {
        let (width, height) = (depth_mm.width(), depth_mm.height());
        let mut shifts = Image::zeros(width, height, 2);
        (shifts.data_mut().par_chunks_mut(2 * width).enumerate()).for_each(|(row, out)| {
            let first = camera.sensor().position_mm(0.0, row as f64);
            let (along, lines) = (field.sight().row(first.y), self.lines(first.y));
            let mut seen = along.at(first.x);
            for (column, out) in out.chunks_exact_mut(2).enumerate() {
                let place = camera.sensor().position_mm(column as f64, row as f64);
                let depth = f64::from(depth_mm.pixel(column, row)[0]);
                along.read(place.x, &mut seen);
                let shift = shift_to_sum(&seen, depth, lines.at(place.x));
                out.copy_from_slice(&shift.as_vec2().to_array());
            }
        });
        shifts
    }

    /// The lines of sight along a line of one y, in the reference channel, between nodes.
    fn lines(&self, y_mm: f64) -> SightLines {
        match &self.by {
            By::ChiefRay { lines, .. } => SightLines::of(lines, y_mm),
            By::Centroid(fields) => {
                let channel = ChannelWavelengths::REFERENCE.min(fields.len() - 1);
                fields[channel].sight().lines(y_mm)
            }
        }
    }
}

/// The direction of a slope away from the sensor, towards negative z.
fn away(slope: DVec2) -> DVec3 {
    -slope.extend(1.0).normalize()
}

/// Rays along `count` lines of sight; those that are not finite are lost.
fn along(lines: impl Iterator<Item = SightLine>, count: usize) -> RayBatch {
    let mut batch = RayBatch::with_capacity(count);
    for line in lines {
        batch.ox.push(line.q1_mm.x);
        batch.oy.push(line.q1_mm.y);
        batch.dx.push(line.q0.x);
        batch.dy.push(line.q0.y);
    }
    let count = batch.ox.len();
    batch.oz.resize(count, 0.0);
    batch.dz.resize(count, -1.0);
    batch.surface.resize(count, 0);
    let slopes = batch.dx.iter_mut().zip(&mut batch.dy);
    for ((x, y), z) in slopes.zip(&mut batch.dz) {
        let inverse = 1.0 / (*x * *x + *y * *y + 1.0).sqrt();
        (*x, *y, *z) = (*x * inverse, *y * inverse, -inverse);
    }
    let status = |x: &f64| match x.is_finite() {
        true => RayStatus::Ok as u8,
        false => RayStatus::Vignetted as u8,
    };
    batch.status.extend(batch.dx.iter().map(status));
    batch
}

/// What a batch of rays meets.
fn met(scene: &Scene, batch: &RayBatch) -> Hits {
    let mut hits = Hits::default();
    scene.intersect(RaySlices::from_batch(batch), &mut hits);
    hits
}
