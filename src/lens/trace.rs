//! The plain sequential ray tracer, one ray at a time in f64: the oracle of the packet tracer.
//!
//! At each surface: into the surface's frame, intersect, clip, refract, back to the camera frame. Snell's law in vector
//! form, with D the unit direction, m = (−x h, −y h, 1) the (not normalised) normal, g = D·m, η = n/n' and σ = ±1 the
//! sense of travel (Spencer & Murty, J. Opt. Soc. Am. 52, 672 (1962)):
//!
//! ```text
//! D' = η D + (σ √(m² (1 − η²) + η² g²) − η g) m / m²
//! ```
//!
//! A negative radicand is total internal reflection. A surface may stand in front of the one before it (the stop of a
//! phone lens often stands behind the first vertex): propagation then runs backwards along the ray, which needs no
//! special case.

use glam::DVec3;

use super::surface::Travel;
use super::system::{OpticalSurface, OpticalSystem, Pose, SurfaceKind};
use crate::rays::{Ray, RayFailure};

/// Which apertures stop a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clipping {
    /// Every clear aperture and the stop: the real lens.
    All,
    /// The aperture stop alone.
    StopOnly,
    /// None: for aiming, and for paraxial data from real rays.
    Off,
}

/// Traces a ray from the scene to the sensor plane z = `sensor_z_mm`, clipped by every aperture. The direction returned
/// is that of the light on the sensor.
///
/// # Errors
/// Where the ray was lost, and why.
pub fn trace_forward(system: &OpticalSystem, ray: Ray) -> Result<Ray, RayFailure> {
    trace_visiting(system, ray, Travel::Forward, Clipping::All, |_, _| {})
}

/// Traces a ray from the sensor into the scene, clipped by every aperture: `ray` starts on or near the sensor with
/// `direction.z < 0`; the result starts on surface 0 and points into the scene.
///
/// # Errors
/// Where the ray was lost, and why.
pub fn trace_backward(system: &OpticalSystem, ray: Ray) -> Result<Ray, RayFailure> {
    trace_visiting(system, ray, Travel::Backward, Clipping::All, |_, _| {})
}

/// The general form of [`trace_forward`] and [`trace_backward`]: chooses the apertures, and calls
/// `visit(surface, point)` with the index of each surface met and the point on it in the surface's own frame (mm),
/// before clipping. The camera-frame point is [`Pose::camera_point_mm`] of it.
///
/// # Errors
/// Where the ray was lost, and why. A ray that runs parallel to the sensor plane is lost at the last surface.
pub fn trace_visiting(
    system: &OpticalSystem,
    ray: Ray,
    travel: Travel,
    clipping: Clipping,
    mut visit: impl FnMut(usize, DVec3),
) -> Result<Ray, RayFailure> {
    let count = system.surfaces.len();
    let mut ray = ray;
    for step in 0..count {
        let index = match travel {
            Travel::Forward => step,
            Travel::Backward => count - 1 - step,
        };
        let surface = &system.surfaces[index];
        let clips = match clipping {
            Clipping::All => true,
            Clipping::StopOnly => index == system.stop,
            Clipping::Off => false,
        };
        let local = surface.pose.local_ray(ray);
        let point = surface
            .intersect(local, travel)
            .ok_or(RayFailure::Missed { surface: index })?;
        visit(index, point);
        let semi = surface.aperture.semi_mm;
        if clips && point.x * point.x + point.y * point.y > semi * semi {
            return Err(RayFailure::Vignetted { surface: index });
        }
        let direction = refract(surface, point, local.direction, travel)
            .ok_or(RayFailure::TotalInternalReflection { surface: index })?;
        ray = surface.pose.camera_ray(Ray {
            origin_mm: point,
            direction,
        });
    }
    if travel == Travel::Forward {
        let t = (system.sensor_z_mm - ray.origin_mm.z) / ray.direction.z;
        if !t.is_finite() {
            return Err(RayFailure::Missed {
                surface: count.saturating_sub(1),
            });
        }
        ray.origin_mm += ray.direction * t;
    }
    Ok(ray)
}

/// Direction behind the surface of a ray that crosses it at the local `point`; `None` if it is totally reflected.
fn refract(
    surface: &OpticalSurface,
    point: DVec3,
    direction: DVec3,
    travel: Travel,
) -> Option<DVec3> {
    if surface.kind == SurfaceKind::Stop {
        return Some(direction);
    }
    let eta = match travel {
        Travel::Forward => surface.index_before / surface.index_after,
        Travel::Backward => surface.index_after / surface.index_before,
    };
    let h = surface.slope_over_radius(point.x * point.x + point.y * point.y)?;
    let m = DVec3::new(-point.x * h, -point.y * h, 1.0);
    let (m2, g) = (m.length_squared(), direction.dot(m));
    let radicand = m2 * (1.0 - eta * eta) + eta * eta * g * g;
    (radicand >= 0.0)
        .then(|| direction * eta + m * ((travel.sign() * radicand.sqrt() - eta * g) / m2))
}

impl Pose {
    /// Camera-frame point of a point in the surface's frame, mm.
    pub fn camera_point_mm(&self, local_mm: DVec3) -> DVec3 {
        match self.rotation {
            Some(r) => r * local_mm + self.vertex_mm,
            None => local_mm + self.vertex_mm,
        }
    }

    /// Point in the surface's frame of a camera-frame point, mm.
    pub fn local_point_mm(&self, camera_mm: DVec3) -> DVec3 {
        let offset = camera_mm - self.vertex_mm;
        match self.rotation {
            Some(r) => r.transpose() * offset,
            None => offset,
        }
    }

    pub(super) fn local_ray(&self, ray: Ray) -> Ray {
        Ray {
            origin_mm: self.local_point_mm(ray.origin_mm),
            direction: match self.rotation {
                Some(r) => r.transpose() * ray.direction,
                None => ray.direction,
            },
        }
    }

    pub(super) fn camera_ray(&self, ray: Ray) -> Ray {
        Ray {
            origin_mm: self.camera_point_mm(ray.origin_mm),
            direction: match self.rotation {
                Some(r) => r * ray.direction,
                None => ray.direction,
            },
        }
    }
}
