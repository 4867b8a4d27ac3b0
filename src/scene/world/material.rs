//! What a surface does with light at one place, by its material; values and drawn directions are in [`super::bsdf`].
//!
//! A share t of a non-metal's body is clear (Fresnel reflection and refraction, smooth), the rest is a glossy layer
//! over a diffuse body:
//!
//! ```text
//! f = f_GGX(F₀, F₉₀) + (1 − metallic) base/π · (1 − E(θ_o))(1 − E(θ_i)) / (1 − Ē)
//! F₀ = mix(((n − 1)/(n + 1))², base, metallic),   F₉₀ = min(1, 50 F₀)
//! ```
//!
//! with E the layer's own reflectance ([`AlbedoTable`]). That coupling (C. Kelemen, L. Szirmay-Kalos,
//! Eurographics 2001) is reciprocal, and what the layer does not reflect the body gets: a white body returns all light.
//! glTF's own mixture, which it replaces, is neither. Light that passes straight on, through veils and thin panes, is a
//! part of its own: shadow rays follow it too.

use glam::Vec3A as Vec3;

use super::World;
use super::bsdf::Bsdf;
use super::description::Material;
use super::geometry::Element;
use super::microfacet::{AlbedoTable, fresnel};
use super::surface::{Footprint, Surface};
use crate::rays::Ray;

/// The smallest cosine to the shading normal that a viewing direction is given.
const LEAST_COSINE: f32 = 1e-3;

impl World {
    /// The material at a place seen along `ray` by light of the colour `throughput`, which weighs the chances of its
    /// parts.
    #[inline(always)]
    pub(super) fn bsdf(
        &self,
        surface: &Surface,
        ray: &Ray,
        footprint: &Footprint,
        throughput: Vec3,
    ) -> Bsdf {
        let m = &self.materials[surface.material];
        let view = -ray.direction.as_vec3a();
        let is_front = surface.normal.dot(view) >= 0.0;
        let side = if is_front { 1.0 } else { -1.0 };
        let normal = surface.normal * side;
        let n = facing(self.bumped(m, surface, footprint) * side, view);
        let (x, y) = n.any_orthonormal_pair();
        let base = texel3(self.texel(m.base_colour_texture, surface.uv, footprint))
            * Vec3::from(m.base_colour)
            * texel3(surface.colour);
        let matt = Bsdf {
            table: AlbedoTable::shared(),
            frame: [x, y, n],
            normal,
            view,
            // Only a layer asks for it.
            o: Vec3::Z,
            pass: Vec3::ZERO,
            clear: Vec3::ZERO,
            tint: base,
            eta: 1.0,
            pane: Vec3::ZERO,
            layered: 1.0,
            diffuse: base * std::f32::consts::FRAC_1_PI,
            f0: Vec3::ZERO,
            f90: 0.0,
            roughness: 1.0,
            chances: [0.0, 0.0, 0.0, 0.0, f32::from(base.dot(throughput) > 0.0)],
        };
        if self.traits[surface.material].is_matt {
            return matt;
        }
        let [_, g, b, _] = self.texel(m.metallic_roughness_texture, surface.uv, footprint);
        let (metallic, roughness) = (m.metallic * b, m.roughness * g);
        let opacity = self.opacity(m, surface, footprint);
        let clear = opacity * m.transmission * (1.0 - metallic);
        let layered = opacity - clear;
        let single = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2);
        let f0 = Vec3::splat(single).lerp(base, metallic);
        let f90 = (50.0 * f0.max_element()).min(1.0);
        let o = Vec3::new(x.dot(view), y.dot(view), n.dot(view).max(LEAST_COSINE)).normalize();
        let mut pass = Vec3::splat(1.0 - opacity);
        let (mut pane, mut solid) = (Vec3::ZERO, Vec3::ZERO);
        if clear > 0.0 && m.thin_walled {
            let reflected = pane_reflectance(o.z, m.ior);
            pane = Vec3::splat(clear * reflected);
            pass += clear * (1.0 - reflected) * base;
        } else {
            solid = Vec3::splat(clear);
        }
        let mut bsdf = Bsdf {
            o,
            pass,
            clear: solid,
            eta: if is_front { m.ior } else { 1.0 / m.ior },
            pane,
            layered,
            f0,
            f90,
            roughness,
            ..matt
        };
        bsdf.set_diffuse((1.0 - metallic) * base, throughput);
        bsdf
    }

    /// Share of light that a material passes straight on along a ray.
    pub(super) fn passes(&self, element: Element, ray: &Ray) -> Vec3 {
        if !self.traits[self.material_of(element)].lets_through {
            return Vec3::ZERO;
        }
        let surface = self.surface(element, ray);
        self.bsdf(&surface, ray, &Footprint::POINT, Vec3::ONE).pass
    }

    /// The shading normal on the front's side, with the normal map.
    #[inline(always)]
    fn bumped(&self, m: &Material, surface: &Surface, footprint: &Footprint) -> Vec3 {
        let Some(map) = m.normal_map else {
            return surface.shading;
        };
        let n = surface.shading;
        let flat = |v: Vec3| (v - n * n.dot(v)).normalize_or_zero();
        let [along_u, along_v] = surface.along_uv.map(flat);
        let [r, g, b, _] = self.texel(Some(map.texture), surface.uv, footprint);
        let local = Vec3::new(r, g, b) * 2.0 - Vec3::ONE;
        // The picture's green points up, v down.
        let bent = along_u * (local.x * map.scale) - along_v * (local.y * map.scale) + n * local.z;
        let bent = bent.normalize_or(n);
        if bent.dot(surface.normal) > 0.0 {
            bent
        } else {
            n
        }
    }
}

#[inline(always)]
fn texel3([r, g, b, _]: [f32; 4]) -> Vec3 {
    Vec3::new(r, g, b)
}

/// A normal bent as little as needed for the viewer to be above it.
#[inline(always)]
fn facing(n: Vec3, view: Vec3) -> Vec3 {
    let c = n.dot(view);
    if c >= LEAST_COSINE {
        n
    } else {
        (n + view * (LEAST_COSINE - c)).normalize()
    }
}

/// Reflectance of a parallel plate, all its inner reflections added.
fn pane_reflectance(cos: f32, ior: f32) -> f32 {
    let (r, _) = fresnel(cos, ior);
    2.0 * r / (1.0 + r)
}
