//! The error of a map, by rays that took no part in its fit.
//!
//! A ray's error is referred to the sensor: with e and e' the errors of its place and slopes in the scene, and J, J'
//! how both change with the place on the sensor, it is |(J + z J')⁻¹ (e + z e')| at the depth z along the middle chief
//! ray. It is taken at half the depth in focus and at infinity, and the larger counts; between them it is smaller.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::edge::{self, DIRECTIONS};
use super::frame::{OUTPUTS, PupilFrame, SceneFrame};
use super::lens_map::LensMap;
use super::node::passing;
use super::place::PlaceBuffers;
use super::task::{MapBound, MapTask};
use crate::frames::camera_from_sensor_mm;
use crate::lens::PacketTracer;
use crate::rays::RayBatch;
use crate::sampling::{concentric_disk, uniform};
use crate::simd::SimdLevel;

/// Rays of each place, and directions in which its edge is found.
const RAYS: u64 = 256;
const EDGES: usize = 64;
/// Factor of the largest error of the edge that was found.
const EDGE_ROOM: f64 = 1.5;
/// How far beyond its reach a map is asked to serve rays that diffraction displaces, in units of its reach.
const FAR: [f64; 4] = [16.0, 8.0, 4.0, 2.0];
/// By what part of that way they may err.
const FAR_ERRORS: MapBound = MapBound {
    rms_px: 0.01,
    worst_px: 0.1,
};
/// Places a side at which that is tried, and rays of each.
const FAR_PLACES: usize = 3;
const FAR_RAYS: u64 = 64;
/// Where rays start on average, of the map's reach.
const USUAL_REACH: f64 = 0.25;
/// Least half width of the band: what bisection leaves.
const LEAST_BAND: f64 = 5e-5;
/// A lens that is focused farther away is checked from half of this on, mm.
const FAR_MM: f64 = 1e6;

/// Rays that are traced exactly in a cell.
pub(super) const RAYS_PER_CELL: f64 = (RAYS as usize + 2 * edge::RAYS_NEAR) as f64;

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

    /// Of all rays.
    pub fn sum(each: impl Iterator<Item = Self>) -> Self {
        each.fold(Self::default(), |a, b| Self {
            rays: a.rays + b.rays,
            squares: a.squares + b.squares,
            worst: a.worst.max(b.worst),
        })
    }

    /// Above 1 where they are beyond the bound.
    pub fn badness(&self, bound: &MapBound) -> f64 {
        (self.rms_px() / bound.rms_px).max(self.worst / bound.worst_px)
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

/// What was found in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub errors: RayErrors,
    /// Largest error of the outline, in units of [`edge`], of rays from the place and from the end of its reach.
    pub edge: [f64; 2],
    perimeter_over_area: f64,
}

/// Half widths of the band at the edge that is traced exactly, for each of the cells in rows of so many: of rays from
/// the place, and from the end of its reach; and the part of the bundle that rays usually leave to it. By the largest
/// errors of the cell and of those around it.
pub(super) fn edge_bands(cells: &[Cell], columns: usize) -> Vec<([f64; 2], f64)> {
    let rows = cells.len() / columns;
    let around = |k: usize, n: usize| k.saturating_sub(1)..(k + 2).min(n);
    let each = (0..cells.len()).map(|k| {
        let (column, row) = (k % columns, k / columns);
        let beside =
            around(row, rows).flat_map(|r| around(column, columns).map(move |c| r * columns + c));
        let [here, far] = beside.fold([0.0_f64; 2], |[m, n], k| {
            let [here, far] = cells[k].edge;
            [m.max(here), n.max(far)]
        });
        let half_width = |largest: f64| EDGE_ROOM * largest + LEAST_BAND;
        let widths = [half_width(here), half_width(far.max(here))];
        let usual = widths[0] + USUAL_REACH * (widths[1] - widths[0]);
        (widths, 2.0 * usual * cells[k].perimeter_over_area)
    });
    each.collect()
}

/// Traces held-out rays of a lens.
pub(super) struct HeldOut<'a> {
    pub task: &'a MapTask<'a>,
    pub exact: &'a PacketTracer,
    pub pupil: &'a PupilFrame,
    pub scene: &'a SceneFrame,
}

impl HeldOut<'_> {
    /// Errors and edge in the middle of every cell of four nodes, where a map is at its worst.
    pub fn cells(&self, map: &LensMap) -> Vec<Cell> {
        let (nx, ny) = (map.nodes.0 - 1, map.nodes.1 - 1);
        let middle = |k: usize, cells: usize| (2 * k + 1) as f64 / cells as f64 - 1.0;
        let cells = (0..nx * ny).into_par_iter().map(|k| {
            let part = DVec2::new(middle(k % nx, nx), middle(k / nx, ny));
            let place = self.task.place_mm(part);
            let errors = self.at(map, place, true);
            let (edge, perimeter_over_area) = self.edge_at(map, place);
            Cell {
                errors,
                edge,
                perimeter_over_area,
            }
        });
        cells.collect()
    }

    /// Errors of rays that pass, of one place; `beside`: from where the map still holds around it.
    pub fn at(&self, map: &LensMap, place: DVec2, beside: bool) -> RayErrors {
        let reach = if beside { 0.999 * map.reach_mm } else { 0.0 };
        let mut errors = RayErrors::default();
        self.each(map, place, (RAYS, reach), |_, px| errors.count(px));
        errors
    }

    /// How far rays may start from the place that they are said to start at, mm, if the place that they are mapped from
    /// errs by no more than a part of that way ([`FAR_ERRORS`]): the map's reach at least. By some rays of some places.
    pub fn far_mm(&self, map: &LensMap) -> f64 {
        let does = |far: &f64| {
            let far_mm = far * map.reach_mm;
            let places = self.task.places_mm(FAR_PLACES);
            let all = places.par_iter().map(|place| {
                let mut errors = RayErrors::default();
                self.each(map, *place, (FAR_RAYS, far_mm), |off, px| {
                    let way_px = off.length() / self.task.pitch_mm;
                    errors.count(px / way_px);
                });
                errors
            });
            let all: Vec<RayErrors> = all.collect();
            RayErrors::sum(all.into_iter()).meet(&FAR_ERRORS, 1.0)
        };
        FAR.iter().find(|far| does(far)).unwrap_or(&1.0) * map.reach_mm
    }

    /// The ways from the place to the starts, mm, and the errors, px, of those of so many rays that pass.
    fn each(
        &self,
        map: &LensMap,
        place: DVec2,
        (rays, reach): (u64, f64),
        mut take: impl FnMut(DVec2, f64),
    ) {
        let disk = self.pupil.at(place);
        let key = place.x.to_bits() ^ place.y.to_bits().rotate_left(17);
        let middle = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let mut batch = RayBatch::with_capacity(rays as usize);
        let mut starts = Vec::with_capacity(rays as usize);
        for i in 0..rays {
            let u = |k: u64| uniform(key, &[i, k]);
            let (p, q) = concentric_disk(u(0), u(1));
            let off = DVec2::new(2.0 * u(2) - 1.0, 2.0 * u(3) - 1.0) * reach;
            let target = disk.target(DVec2::new(p, q), off).extend(self.pupil.z_mm);
            let start = middle + off.extend(0.0);
            batch.push(start, (target - start).normalize());
            starts.push(off);
        }
        let mut exact = batch.clone();
        self.exact.trace_backward(&mut exact, SimdLevel::detect());
        let mut buffers = PlaceBuffers::default();
        map.trace_unbounded(&mut batch, place, &mut buffers);
        let near_mm =
            0.5 * self.task.focus_mm.min(FAR_MM) / self.scene.axes.z_axis.z.abs().max(0.1);
        let changes = &buffers.place.constants[OUTPUTS..];
        for (i, off) in starts.into_iter().enumerate() {
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
            take(off, at(1.0, near_mm).max(at(0.0, 1.0)));
        }
    }

    /// The largest errors of the outline in directions between those that were traced, for rays from the place and from
    /// a corner of its reach; and its length over the area that it holds.
    fn edge_at(&self, map: &LensMap, place: DVec2) -> ([f64; 2], f64) {
        let mut buffers = PlaceBuffers::default();
        buffers.go(map, place, SimdLevel::detect());
        let outline = &buffers.place.edge;
        let disk = self.pupil.at(place);
        let origin = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let key = place.y.to_bits() ^ place.x.to_bits().rotate_left(17);
        let u = |k: u64| uniform(key, &[k]);
        let step = DIRECTIONS as f64 / EDGES as f64;
        let t: Vec<f64> = (0..EDGES)
            .map(|k| (k as f64 + u(k as u64 + 2)) * step)
            .collect();
        let along: Vec<(DVec2, f64, f64)> = t
            .iter()
            .map(|&t| {
                let k = (t as usize).min(DIRECTIONS - 1);
                let value = |k: usize| f64::from(outline.reach[k]);
                let found = value(k) + (t - k as f64) * (value(k + 1) - value(k));
                (edge::on_square(t), found, f64::from(outline.corner[k]))
            })
            .collect();
        let (mut perimeter, mut area) = (0.0, 0.0);
        let mut error = |off: DVec2| {
            let directions = along
                .iter()
                .map(|(direction, found, _)| (*direction, *found));
            let true_reach = edge::reach_near(directions, |points| {
                let targets: Vec<DVec2> = points.iter().map(|p| disk.target(*p, off)).collect();
                let start = origin + off.extend(0.0);
                passing(self.exact, start, self.pupil.z_mm, &targets)
            });
            let mut largest = 0.0_f64;
            for ((_, found, corner), reach) in along.iter().zip(true_reach) {
                largest = largest.max(reach - found - corner).max(found - reach);
                // Per direction: a strip of the width 1 in its units, and a triangle.
                perimeter += reach;
                area += 0.5 * reach * reach;
            }
            largest
        };
        let corner = DVec2::new(u(0) - 0.5, u(1) - 0.5).map(f64::signum) * (0.999 * map.reach_mm);
        ([error(DVec2::ZERO), error(corner)], perimeter / area)
    }
}
