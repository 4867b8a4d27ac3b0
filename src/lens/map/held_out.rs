//! The error of a map, by rays that took no part in its fit.
//!
//! A ray's error is referred to the sensor: with e and e' the errors of its place and slopes in the scene, and J, J' how
//! both change with the place on the sensor, it is |(J + z J')⁻¹ (e + z e')| at the depth z along the middle chief ray.
//! It is taken at half the depth in focus and at infinity, and the larger counts; between them it is smaller.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::LensMap;
use super::edge::{self, DIRECTIONS};
use super::frame::{PupilFrame, SceneFrame};
use super::kernel::OUTPUTS;
use super::node::passing;
use super::place::PlaceBuffers;
use super::task::{MapBound, MapTask};
use crate::frames::camera_from_sensor_mm;
use crate::lens::PacketTracer;
use crate::rays::RayBatch;
use crate::sampling::{concentric_disk, uniform};
use crate::simd::SimdLevel;

/// Places along each side: in the middle of cells of four nodes, where a map is at its worst.
const PLACES: usize = 5;
/// Rays of each place, and directions in which its edge is found.
const RAYS: u64 = 256;
const EDGES: usize = 64;
/// Factor of the largest error of the edge that was found.
const EDGE_ROOM: f64 = 1.5;
/// Least half width of the band: what bisection leaves.
const LEAST_BAND: f64 = 5e-5;
/// A lens that is focused farther away is checked from half of this on, mm.
const FAR_MM: f64 = 1e6;

/// Errors of rays, px.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RayErrors {
    rays: f64,
    squares: f64,
    worst: f64,
}

impl RayErrors {
    fn count(&mut self, px: f64) {
        // What is no number is no map.
        let px = if px.is_finite() { px } else { f64::MAX.sqrt() };
        self.rays += 1.0;
        self.squares += px * px;
        self.worst = self.worst.max(px);
    }

    pub fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.squares += other.squares;
        self.worst = self.worst.max(other.worst);
    }

    pub fn rms_px(&self) -> f64 {
        (self.squares / self.rays.max(1.0)).sqrt()
    }

    pub fn worst_px(&self) -> f64 {
        self.worst
    }

    /// Whether they are within this part of the bound.
    pub fn meet(&self, bound: &MapBound, share: f64) -> bool {
        let (rms, worst) = (share * bound.rms_px, share * bound.worst_px);
        self.rays > 0.0 && self.rms_px() <= rms && self.worst <= worst
    }
}

/// What the edge needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Band {
    /// Half width, in units of [`edge`].
    pub half_width: f64,
    /// Its part of the bundle.
    pub share: f64,
}

/// Traces held-out rays of a lens.
pub(super) struct HeldOut<'a> {
    pub task: &'a MapTask<'a>,
    pub exact: &'a PacketTracer,
    pub pupil: &'a PupilFrame,
    pub scene: &'a SceneFrame,
}

impl HeldOut<'_> {
    /// Errors and edge in the middle of cells all over the window.
    pub fn over_window(&self, map: &LensMap) -> (RayErrors, Band) {
        let (nx, ny) = map.nodes;
        let (px, py) = (PLACES.min(nx - 1), PLACES.min(ny - 1));
        let middle = |k: usize, places: usize, nodes: usize| {
            let cell = k * (nodes - 2) / (places - 1).max(1);
            (2 * cell + 1) as f64 / (nodes - 1) as f64 - 1.0
        };
        let each: Vec<_> = (0..px * py)
            .into_par_iter()
            .map(|k| {
                let part = DVec2::new(middle(k % px, px, nx), middle(k / px, py, ny));
                let place = self.task.place_mm(part);
                (self.at(map, place, true), self.edge_at(map, place))
            })
            .collect();
        let (mut errors, mut off, mut length) = (RayErrors::default(), 0.0_f64, 0.0);
        for (e, (largest, per_area)) in &each {
            errors.add(*e);
            off = off.max(*largest);
            length += per_area / each.len() as f64;
        }
        let half_width = EDGE_ROOM * off + LEAST_BAND;
        let share = 2.0 * half_width * length;
        (errors, Band { half_width, share })
    }

    /// Errors of rays that pass, of one place; `beside`: from where the map still holds around it.
    pub fn at(&self, map: &LensMap, place: DVec2, beside: bool) -> RayErrors {
        let disk = self.pupil.at(place);
        let reach = if beside { 0.999 * map.reach_mm } else { 0.0 };
        let key = place.x.to_bits() ^ place.y.to_bits().rotate_left(17);
        let middle = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let mut batch = RayBatch::with_capacity(RAYS as usize);
        for i in 0..RAYS {
            let u = |k: u64| uniform(key, &[i, k]);
            let (p, q) = concentric_disk(u(0), u(1));
            let off = DVec2::new(2.0 * u(2) - 1.0, 2.0 * u(3) - 1.0) * reach;
            let target = disk.target(DVec2::new(p, q), off).extend(self.pupil.z_mm);
            let start = middle + off.extend(0.0);
            batch.push(start, (target - start).normalize());
        }
        let mut exact = batch.clone();
        self.exact.trace_backward(&mut exact, SimdLevel::detect());
        let mut buffers = PlaceBuffers::default();
        map.trace_unbounded(&mut batch, place, &mut buffers);
        let near_mm =
            0.5 * self.task.focus_mm.min(FAR_MM) / self.scene.axes.z_axis.z.abs().max(0.1);
        let changes = &buffers.place.constants[OUTPUTS..];
        let mut errors = RayErrors::default();
        for i in 0..RAYS as usize {
            let Ok(exact) = exact.get(i) else { continue };
            let exact = self.scene.coordinates(exact).unwrap_or([f64::NAN; OUTPUTS]);
            let ray = self
                .scene
                .coordinates(batch.ray(i))
                .unwrap_or([f64::NAN; OUTPUTS]);
            let e: [f64; OUTPUTS] = std::array::from_fn(|k| ray[k] - exact[k]);
            let at = |place: f64, slope: f64| {
                let shift =
                    |e: &[f64]| DVec2::new(e[0], e[1]) * place + DVec2::new(e[2], e[3]) * slope;
                let jacobian =
                    DMat2::from_cols(shift(&changes[..OUTPUTS]), shift(&changes[OUTPUTS..]));
                (jacobian.inverse() * shift(&e)).length() / self.task.pitch_mm
            };
            errors.count(at(1.0, near_mm).max(at(0.0, 1.0)));
        }
        errors
    }

    /// The largest error of the outline in directions between those that were traced, and its length over the area
    /// that it holds.
    fn edge_at(&self, map: &LensMap, place: DVec2) -> (f64, f64) {
        let mut buffers = PlaceBuffers::default();
        buffers.go(map, place);
        let outline = &buffers.place.edge;
        let disk = self.pupil.at(place);
        let origin = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let key = place.y.to_bits() ^ place.x.to_bits().rotate_left(17);
        let u = |k: u64| uniform(key, &[k]);
        // All from one side of the place, another for each.
        let off = DVec2::new(2.0 * u(0) - 1.0, 2.0 * u(1) - 1.0) * (0.999 * map.reach_mm);
        let step = DIRECTIONS as f64 / EDGES as f64;
        let t: Vec<f64> = (0..EDGES)
            .map(|k| (k as f64 + u(k as u64 + 2)) * step)
            .collect();
        let directions: Vec<DVec2> = t.iter().map(|&t| edge::on_square(t)).collect();
        let true_reach = edge::reach(&directions, |points| {
            let targets: Vec<DVec2> = points.iter().map(|p| disk.target(*p, off)).collect();
            passing(
                self.exact,
                origin + off.extend(0.0),
                self.pupil.z_mm,
                &targets,
            )
        });
        let (mut largest, mut perimeter, mut area) = (0.0_f64, 0.0, 0.0);
        for (&t, reach) in t.iter().zip(true_reach) {
            let k = (t as usize).min(DIRECTIONS - 1);
            let value = |k: usize| f64::from(outline.reach[k]);
            let found = value(k) + (t - k as f64) * (value(k + 1) - value(k));
            let beyond = reach - found - f64::from(outline.corner[k]);
            largest = largest.max(beyond).max(found - reach);
            // Per direction: a strip of the width 1 in its units, and a triangle.
            perimeter += reach;
            area += 0.5 * reach * reach;
        }
        (largest, perimeter / area)
    }
}
