//! Relative illumination by real rays.
//!
//! A point of the sensor that sees a uniform radiance L through the lens receives the irradiance
//!
//! ```text
//! E = L ∫ cos θ dΩ = L ∫∫ du dv
//! ```
//!
//! over the directions that come through, with u, v their direction cosines in the plane of the sensor: cos θ dΩ = du
//! dv (the projected solid angle; Nicodemus, Appl. Opt. 9, 1474 (1970)). So E is L times the area in the (u, v) plane
//! whose rays pass when traced back from the point, found on a regular grid.

use glam::{DVec2, DVec3};

use super::aim::{Aim, Field};
use super::analysis::pupil_grid;
use super::error::LensError;
use super::placed::Lens;
use super::surface::Travel;
use super::system::OpticalSystem;
use super::trace::{Clipping, trace_backward, trace_forward, trace_visiting};
use crate::rays::Ray;

/// Directions along each side of the grid.
const GRID: usize = 160;
/// By how much the grid is larger than the box of the stop's rim in (u, v): the sensor point sees the pupil from one
/// place, the rim's rays land beside it by their aberrations.
const MARGIN: f64 = 1.1;

/// A rectangle of the (u, v) plane: direction cosines in the camera frame of light that travels towards the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvBox {
    /// Smallest u and v.
    pub low: DVec2,
    /// Largest u and v.
    pub high: DVec2,
}

/// ∫∫ du dv in sr over the directions within `bounds` that come through the system to the point (x, y) of the sensor
/// (camera frame, mm).
pub fn projected_solid_angle(system: &OpticalSystem, point_mm: DVec2, bounds: UvBox) -> f64 {
    let step = (bounds.high - bounds.low) / GRID as f64;
    let passes = |i: usize, j: usize| {
        let uv = bounds.low + step * DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
        let w2 = 1.0 - uv.length_squared();
        let back = Ray {
            origin_mm: point_mm.extend(system.sensor_z_mm),
            direction: DVec3::new(-uv.x, -uv.y, -w2.max(0.0).sqrt()),
        };
        w2 > 0.0 && trace_backward(system, back).is_ok()
    };
    let count = (0..GRID * GRID)
        .filter(|&k| passes(k % GRID, k / GRID))
        .count();
    count as f64 * step.x * step.y
}

impl Lens {
    /// Irradiance where the field's chief ray lands over that on the axis, for a scene of uniform radiance; `None`
    /// where the chief ray is clipped.
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees, or a wavelength out of range.
    pub fn relative_illumination(
        &self,
        field: Field,
        wavelength_nm: f64,
    ) -> Result<Option<f64>, LensError> {
        self.check_field(field)?;
        let system = self.at(wavelength_nm)?;
        let paraxial = self.paraxial(wavelength_nm)?;
        let irradiance = |field: Field| {
            let aim = Aim::new(&system, &paraxial, field, self.focus_distance_mm())?;
            let chief = trace_forward(&system, aim.chief_ray()).ok()?;
            let bounds = seen_pupil(&system, &aim)?;
            let point = chief.origin_mm.truncate();
            Some(projected_solid_angle(&system, point, bounds))
        };
        let axis = Field {
            angle_deg: 0.0,
            ..field
        };
        Ok(irradiance(field).and_then(|e| Some(e / irradiance(axis)?)))
    }
}

/// The box in (u, v) that holds the whole stop as the field's image point sees it, vignetting left aside.
fn seen_pupil(system: &OpticalSystem, aim: &Aim) -> Option<UvBox> {
    let directions: Vec<DVec2> = pupil_grid()
        .into_iter()
        .filter_map(|unit| {
            let ray = aim.ray_at(unit)?;
            trace_visiting(system, ray, Travel::Forward, Clipping::Off, |_, _| {}).ok()
        })
        .map(|ray| ray.direction.truncate())
        .collect();
    let low = directions.iter().copied().reduce(DVec2::min)?;
    let high = directions.iter().copied().reduce(DVec2::max)?;
    let (middle, half) = (0.5 * (low + high), 0.5 * MARGIN * (high - low));
    Some(UvBox {
        low: middle - half,
        high: middle + half,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Aperture, OpticalSurface, Pose, SurfaceKind};

    #[test]
    fn bare_stop_lights_the_sensor_as_a_lambertian_disk_does() {
        // E / (π L) = ½ [1 − (d² + ρ² − a²) / √((d² + ρ² + a²)² − 4 a² ρ²)] at ρ from the axis of a disk of radius a,
        // distance d.
        let (a, d) = (1.0_f64, 2.5_f64);
        let stop = OpticalSurface {
            pose: Pose {
                vertex_mm: DVec3::ZERO,
                rotation: None,
            },
            curvature: 0.0,
            conic: 0.0,
            aspheric: [0.0; 10],
            aspheric_terms: 0,
            aperture: Aperture { semi_mm: a },
            kind: SurfaceKind::Stop,
            index_before: 1.0,
            index_after: 1.0,
        };
        let system = OpticalSystem {
            surfaces: vec![stop],
            stop: 0,
            sensor_z_mm: d,
            wavelength_nm: 550.0,
        };
        let bounds = UvBox {
            low: DVec2::new(-0.4, -0.4),
            high: DVec2::new(0.4, 0.9),
        };
        for rho in [0.0, 0.8, 2.0] {
            let sum = d * d + rho * rho + a * a;
            let root = (sum * sum - 4.0 * a * a * rho * rho).sqrt();
            let exact = std::f64::consts::FRAC_PI_2 * (1.0 - (sum - 2.0 * a * a) / root);
            let found = projected_solid_angle(&system, DVec2::new(0.0, rho), bounds);
            assert!((found / exact - 1.0).abs() < 5e-3, "{rho}: {found} {exact}");
        }
    }
}
