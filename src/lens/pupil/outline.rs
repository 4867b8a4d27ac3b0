//! The outline of the bundle that passes the lens from one sensor position, in a plane z = const in front of the
//! sensor.
//!
//! A grid of rays around the chief ray finds the bundle; it is widened until no ray on its rim passes and narrowed
//! until the bundle fills it. From the middle of the bundle the edge is then sought along evenly spread directions.

use glam::DVec2;

use super::super::chief::chief_ray;
use super::super::packet::PacketTracer;
use super::super::system::OpticalSystem;
use super::edge::last_that_pass;
use crate::frames::camera_from_sensor_mm;
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Rays along each side of the search grid.
const GRID: usize = 24;
/// Rays along each side of the wide search for a bundle that the chief ray is not part of.
const WIDE_GRID: usize = 64;
/// Directions in which the edge is sought.
const DIRECTIONS: usize = 160;
/// The edge is known to 2⁻¹¹ of the way out.
const BISECTIONS: u32 = 11;
const REGRIDS: usize = 12;

/// Rays aimed at a plane through the lens at one or more wavelengths.
pub(super) struct Aim<'a> {
    pub systems: Vec<&'a OpticalSystem>,
    pub tracers: Vec<PacketTracer>,
    /// The plane, camera frame, mm.
    pub plane_z_mm: f64,
    /// Semi-diameter of the paraxial exit pupil seen from the sensor in that plane, mm.
    pub pupil_semi_mm: f64,
    pub level: SimdLevel,
    /// Places mirrored in the axis have mirrored bundles.
    pub is_mirrored: bool,
}

/// Rectangle of the plane: centre and half sides.
#[derive(Clone, Copy)]
struct Patch {
    centre: DVec2,
    half: DVec2,
}

impl Patch {
    fn grid(&self, side: usize) -> Vec<DVec2> {
        let at = |i: usize| 2.0 * i as f64 / (side - 1) as f64 - 1.0;
        (0..side * side)
            .map(|i| self.centre + DVec2::new(at(i % side), at(i / side)) * self.half)
            .collect()
    }
}

/// The outline of the place that mirrors another's; `signs`: of x and y. It begins in the direction of x and goes
/// around the same way.
pub(super) fn mirrored(edge: &[DVec2], signs: DVec2) -> Vec<DVec2> {
    let count = edge.len();
    let from = |i: usize| match (signs.x < 0.0, signs.y < 0.0) {
        (false, false) => i,
        (true, false) => count + count / 2 - i,
        (false, true) => count - i,
        (true, true) => i + count / 2,
    };
    (0..count).map(|i| signs * edge[from(i) % count]).collect()
}

impl Aim<'_> {
    /// Points just outside the edge of the bundle from `sensor_mm` (sensor frame) that passes at any of the
    /// wavelengths, in order around it; empty when nothing passes.
    pub(super) fn outline(&self, sensor_mm: DVec2) -> Vec<DVec2> {
        let Some((patch, inside)) = self
            .near_chief_ray(sensor_mm)
            .and_then(|patch| self.fitted(sensor_mm, patch, GRID))
            .or_else(|| self.fitted(sensor_mm, self.whole_last_surface(sensor_mm), WIDE_GRID))
        else {
            return Vec::new();
        };
        let directions: Vec<DVec2> = (0..DIRECTIONS)
            .map(|i| {
                let angle = std::f64::consts::TAU * i as f64 / DIRECTIONS as f64;
                DVec2::from_angle(angle) * patch.half
            })
            .collect();
        // Out to a circle around the patch, which lets nothing pass on its rim.
        let end = 1 << BISECTIONS;
        let place = |number: u32| 3.0 * f64::from(number) / f64::from(end);
        let last = last_that_pass(vec![None; DIRECTIONS], end, &mut |questions| {
            let points = questions.iter();
            let points: Vec<DVec2> = points
                .map(|&(i, number)| inside + directions[i] * place(number))
                .collect();
            self.pass(sensor_mm, &points)
        });
        let edge = directions.iter().zip(&last);
        edge.map(|(d, last)| inside + *d * place(last + 1))
            .collect()
    }

    fn near_chief_ray(&self, sensor_mm: DVec2) -> Option<Patch> {
        let chief = chief_ray(self.systems.first()?, sensor_mm.x, sensor_mm.y).ok()?;
        let t = (self.plane_z_mm - chief.origin_mm.z) / chief.direction.z;
        Some(Patch {
            centre: (chief.origin_mm + chief.direction * t).truncate(),
            half: DVec2::splat(1.5 * self.pupil_semi_mm),
        })
    }

    /// What a ray through the last surface's clear aperture can reach in the plane, with some room for its sag.
    fn whole_last_surface(&self, sensor_mm: DVec2) -> Patch {
        let mut half = 4.0 * self.pupil_semi_mm;
        let mut centre = DVec2::ZERO;
        if let Some((system, last)) = self
            .systems
            .first()
            .and_then(|s| Some((s, s.surfaces.last()?)))
        {
            let vertex = last.pose.vertex_mm;
            let origin = camera_from_sensor_mm(sensor_mm, system.sensor_z_mm);
            let scale = (self.plane_z_mm - origin.z) / (vertex.z - origin.z);
            if last.aperture.semi_mm.is_finite() && scale.is_finite() {
                half = 1.3 * last.aperture.semi_mm * scale;
                centre = (origin + (vertex - origin) * scale).truncate();
            }
        }
        Patch {
            centre,
            half: DVec2::splat(half),
        }
    }

    /// The patch around the bundle, and a point of the bundle near its middle; `None` if nothing passes.
    fn fitted(&self, sensor_mm: DVec2, start: Patch, side: usize) -> Option<(Patch, DVec2)> {
        let mut patch = start;
        let mut side = side;
        for _ in 0..REGRIDS {
            let points = patch.grid(side);
            let hits: Vec<DVec2> = points
                .iter()
                .zip(self.pass(sensor_mm, &points))
                .filter_map(|(p, passes)| passes.then_some(*p))
                .collect();
            let first = *hits.first()?;
            let low = hits.iter().fold(first, |m, p| m.min(*p));
            let high = hits.iter().fold(first, |m, p| m.max(*p));
            let cell = patch.half * (2.0 / (side - 1) as f64);
            let at_rim = (high - patch.centre + 0.5 * cell).cmpge(patch.half).any()
                || (patch.centre - low + 0.5 * cell).cmpge(patch.half).any();
            let extent = 0.5 * (high - low) + cell;
            if !at_rim && extent.cmpge(0.5 * patch.half).all() {
                let mean = hits.iter().sum::<DVec2>() / hits.len() as f64;
                let inside = hits.iter().copied().min_by(|a, b| {
                    a.distance_squared(mean)
                        .total_cmp(&b.distance_squared(mean))
                })?;
                return Some((patch, inside));
            }
            let half = if at_rim {
                1.7 * patch.half.max(extent)
            } else {
                1.1 * extent
            };
            patch = Patch {
                centre: 0.5 * (low + high),
                half,
            };
            side = GRID;
        }
        None
    }

    /// Which of the rays from `sensor_mm` to `points` of the plane pass at any wavelength.
    pub(super) fn pass(&self, sensor_mm: DVec2, points: &[DVec2]) -> Vec<bool> {
        let mut passed = vec![false; points.len()];
        // A ray that passes at one wavelength needs no other.
        let mut left: Vec<usize> = (0..points.len()).collect();
        for (system, tracer) in self.systems.iter().zip(&self.tracers) {
            let origin = camera_from_sensor_mm(sensor_mm, system.sensor_z_mm);
            let mut batch = RayBatch::with_capacity(left.len());
            for &i in &left {
                let target = points[i].extend(self.plane_z_mm);
                batch.push(origin, (target - origin).normalize());
            }
            tracer.trace_backward(&mut batch, self.level);
            for (&i, status) in left.iter().zip(&batch.status) {
                passed[i] = *status == 0;
            }
            left.retain(|i| !passed[*i]);
        }
        passed
    }
}
