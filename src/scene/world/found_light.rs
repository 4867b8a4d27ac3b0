//! Light that a scattered ray finds, weighed as scattering's share beside connections.

use glam::{DVec3, Vec3A as Vec3};

use super::World;
use super::geometry::Element;
use super::light_node::Receiver;
use super::surface::{Footprint, Surface};
use super::triangles::WalkRay;
use crate::rays::Ray;

/// What the next hit of a path needs to know of the last scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastScattering {
    /// Density of its direction; `None` if connections could not have found it (the camera's ray, mirrors).
    pub density: Option<f32>,
    pub origin: DVec3,
    /// Of the side from which it went out.
    pub normal: Vec3,
}

impl World {
    /// Whether a ray may find light that is sent to it, and not scattered; if not, it finds none.
    #[inline(always)]
    pub(super) fn may_shine_along(&self, ray: &Ray) -> bool {
        if !self.is_dark_beyond {
            return true;
        }
        let ray = WalkRay::new(ray.origin_mm.as_vec3(), ray.direction.as_vec3());
        self.lights.triangle_tree.may_be_met(&ray)
    }

    /// Radiance from beyond everything, weighed as scattering's share.
    #[inline(always)]
    pub(super) fn background(&self, direction: Vec3, last: &LastScattering) -> Vec3 {
        let sky = self.sky.radiance(direction);
        let (disc, disc_density) = self.lights.sun_disc(direction);
        let Some(density) = last.density else {
            return sky + disc;
        };
        sky * power_share(density, self.sky_density(direction))
            + disc * power_share(density, disc_density)
    }

    /// Radiance that a surface itself sends against the ray, weighed as scattering's share.
    #[inline(always)]
    pub(super) fn shine(
        &self,
        element: Element,
        surface: &Surface,
        direction: Vec3,
        last: &LastScattering,
        footprint: &Footprint,
    ) -> Vec3 {
        if !self.traits[surface.material].shines {
            return Vec3::ZERO;
        }
        let is_front = surface.normal.dot(direction) < 0.0;
        let radiance = self.emission(surface, is_front, footprint);
        match last.density {
            Some(density) if radiance != Vec3::ZERO => {
                let distance = (surface.position - last.origin).length() as f32;
                let receiver = Receiver::new(last.origin, last.normal);
                let cos = surface.normal.dot(direction);
                let as_light = (self.lights).triangle_density(element, &receiver, cos, distance);
                radiance * power_share(density, as_light)
            }
            _ => radiance,
        }
    }
}

/// Share of the technique of density `a` beside one of density `b`; `a` > 0.
#[inline(always)]
pub(super) fn power_share(a: f32, b: f32) -> f32 {
    // As a ratio, so that large densities do not overflow.
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}
