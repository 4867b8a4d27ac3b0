//! The waves that reach a place on the sensor: by direction, which pass the lens and with what phase.

use glam::{DMat2, DVec2, DVec3};
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{Clipping, OpticalSystem, Travel, chief_ray, trace_visiting};
use quadpixel::rays::Ray;

/// Directions (cosines against the chief ray's) on a square grid, and the path to a point of the scene for each.
pub struct Pupil {
    /// Directions along each side.
    pub side: usize,
    /// Distance of neighbours, direction cosine.
    pub step: f64,
    /// Optical path from the place to the point along the ray of each direction, mm, against the chief ray's; `None`
    /// where the lens stops it.
    pub path_mm: Vec<Option<f64>>,
}

impl Pupil {
    /// Of the place `sensor_mm` (sensor frame) and the point of its chief ray at `depth_mm`.
    ///
    /// The path is that of the ray from the point that arrives in each direction, to the foot of the place on it. It is
    /// found by going from the place along the direction, and from where that misses the point by so much the other
    /// way, twice more.
    pub fn new(system: &OpticalSystem, sensor_mm: DVec2, depth_mm: f64, side: usize) -> Self {
        let origin_mm = camera_from_sensor_mm(sensor_mm, system.sensor_z_mm);
        let chief = chief_ray(system, sensor_mm.x, sensor_mm.y)
            .unwrap()
            .direction;
        let (chief_exit, chief_path) = followed(
            system,
            Ray {
                origin_mm,
                direction: chief,
            },
        )
        .unwrap();
        let t = (-depth_mm - chief_exit.origin_mm.z) / chief_exit.direction.z;
        let point = chief_exit.origin_mm + t * chief_exit.direction;
        // The cone's width, by what passes along two lines.
        let passes = |w: DVec2| {
            let all = chief.truncate() + w;
            let direction = all.extend(-(1.0 - all.length_squared()).sqrt());
            followed(
                system,
                Ray {
                    origin_mm,
                    direction,
                },
            )
        };
        let half = (1..600)
            .map(|i| f64::from(i) * 1e-3)
            .filter(|r| {
                [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y]
                    .iter()
                    .any(|d| passes(*r * *d).is_some())
            })
            .fold(0.0, f64::max)
            + 2e-3;
        let step = 2.0 * half / side as f64;
        // mm in the plane of the point over mm on the sensor.
        let lands = |start: DVec2, w: DVec2| {
            let all = chief.truncate() + w;
            let direction = all.extend(-(1.0 - all.length_squared()).sqrt());
            let origin_mm = origin_mm + start.extend(0.0);
            let (exit, path) = followed(
                system,
                Ray {
                    origin_mm,
                    direction,
                },
            )?;
            let t = (point.z - exit.origin_mm.z) / exit.direction.z;
            let place = exit.origin_mm + t * exit.direction;
            Some(((place - point).truncate(), path + t + all.dot(start)))
        };
        let small = 1e-3;
        let scale = [DVec2::X, DVec2::Y].map(|axis| {
            let there = lands(small * axis, DVec2::ZERO).unwrap().0;
            there / small
        });
        let scale = DMat2::from_cols(scale[0], scale[1]).inverse();
        let path = |i: usize| {
            let place = DVec2::new((i % side) as f64 + 0.5, (i / side) as f64 + 0.5);
            let w = place * step - half;
            passes(w)?;
            let mut start = DVec2::ZERO;
            for _ in 0..3 {
                start -= scale * lands(start, w)?.0;
            }
            Some(lands(start, w)?.1 - chief_path - t)
        };
        Self {
            side,
            step,
            path_mm: (0..side * side).map(path).collect(),
        }
    }

    /// Optical transfer function at a frequency in cycles per mm that is a whole number of `cells` of the grid:
    /// `[waves, rays × aperture, aperture]` at a wavelength in mm, real and imaginary part each.
    ///
    /// ```text
    /// waves: Σ P(w + λν/2) P*(w − λν/2) / Σ |P|²
    /// rays:  ⟨exp(2πi ν·ε)⟩ over all that pass, ε = ∇W
    /// ```
    pub fn transfer(&self, (columns, rows): (usize, usize), wavelength_mm: f64) -> [DVec2; 3] {
        let n = self.side;
        let at = |i: usize, j: usize| (i < n && j < n).then(|| self.path_mm[j * n + i]).flatten();
        let turn = |path: f64| DVec2::from_angle(std::f64::consts::TAU * path / wavelength_mm);
        let (mut waves, mut rays, mut shared) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        let (mut all, mut sloped) = (0.0, 0.0);
        for j in 0..n {
            for i in 0..n {
                let Some(here) = at(i, j) else { continue };
                all += 1.0;
                if let Some(there) = at(i + columns, j + rows) {
                    waves += turn(there - here);
                    shared += 1.0;
                }
                // The slope by the neighbours on both sides.
                let around = |di: usize, dj: usize| {
                    let before = at(i.wrapping_sub(di), j.wrapping_sub(dj))?;
                    Some((at(i + di, j + dj)? - before) * 0.5)
                };
                if let (Some(x), Some(y)) = (around(1, 0), around(0, 1)) {
                    rays += turn(x * columns as f64 + y * rows as f64);
                    sloped += 1.0;
                }
            }
        }
        [
            waves / all,
            rays / sloped * shared / all,
            DVec2::new(shared / all, 0.0),
        ]
    }
}

/// A ray behind the lens (in the scene) and its optical path so far, mm.
fn followed(system: &OpticalSystem, ray: Ray) -> Option<(Ray, f64)> {
    let (mut last, mut path) = (ray.origin_mm, 0.0);
    let exit = trace_visiting(system, ray, Travel::Backward, Clipping::All, |i, local| {
        let surface = &system.surfaces[i];
        let point: DVec3 = surface.pose.camera_point_mm(local);
        // Towards the scene; a stop behind the glass's vertex is met the other way.
        path += surface.index_after * (point - last).length() * (last.z - point.z).signum();
        last = point;
    });
    Some((exit.ok()?, path))
}
