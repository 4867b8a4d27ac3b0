//! What a surface does with light at one place: its parts, their values, and drawing directions from them.
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

use glam::Vec3;

use super::World;
use super::description::Material;
use super::geometry::Element;
use super::microfacet::{AlbedoTable, Ggx, fresnel, schlick};
use super::surface::{Footprint, Surface};
use crate::rays::Ray;

/// The smallest cosine to the shading normal that a viewing direction is given.
const LEAST_COSINE: f32 = 1e-3;

/// See the module. Directions point away from the surface.
#[derive(Clone, Debug)]
pub(super) struct Bsdf {
    table: &'static AlbedoTable,
    /// x, y and the shading normal on the viewer's side.
    frame: [Vec3; 3],
    /// The geometric normal on the viewer's side.
    normal: Vec3,
    view: Vec3,
    /// `view` in the frame; z ≥ LEAST_COSINE.
    o: Vec3,
    /// Straight on.
    pass: Vec3,
    /// Solid glass: weight, tint, index beyond over index here.
    clear: Vec3,
    tint: Vec3,
    eta: f32,
    /// A thin pane's mirror image.
    pane: Vec3,
    /// Weight of the layered part.
    layered: f32,
    /// (1 − metallic) base/π (1 − E(θ_o))/(1 − Ē).
    diffuse: Vec3,
    f0: Vec3,
    f90: f32,
    roughness: f32,
    /// Chances of drawing [pass, clear, pane, gloss, diffuse].
    chances: [f32; 5],
}

/// A drawn direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered {
    pub direction: Vec3,
    /// f cos θ / density.
    pub weight: Vec3,
    pub kind: Kind,
}

/// How a direction was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Straight on: the ray was not scattered.
    Passed,
    /// From a mirror or a refraction, with the square of the ratio of indices, by which radiance is denser beyond.
    Mirrored { denser: f32 },
    /// With this density per solid angle.
    Spread { density: f32, is_diffuse: bool },
}

impl World {
    /// The material at a place seen along `ray` by light of the colour `throughput`, which weighs the chances of its
    /// parts.
    pub(super) fn bsdf(
        &self,
        surface: &Surface,
        ray: &Ray,
        footprint: &Footprint,
        throughput: Vec3,
    ) -> Bsdf {
        let m = &self.materials[surface.material];
        let view = -ray.direction.as_vec3();
        let is_front = surface.normal.dot(view) >= 0.0;
        let side = if is_front { 1.0 } else { -1.0 };
        let normal = surface.normal * side;
        let n = facing(self.bumped(m, surface, footprint) * side, view);
        let (x, y) = n.any_orthonormal_pair();
        let o = Vec3::new(x.dot(view), y.dot(view), n.dot(view).max(LEAST_COSINE)).normalize();

        let base = texel3(self.texel(m.base_colour_texture, surface.uv, footprint))
            * Vec3::from(m.base_colour)
            * texel3(surface.colour);
        let matt = Bsdf {
            table: AlbedoTable::shared(),
            frame: [x, y, n],
            normal,
            view,
            o,
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
        if self.is_matt[surface.material] {
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
        if !self.lets_through[self.material_of(element)] {
            return Vec3::ZERO;
        }
        let surface = self.surface(element, ray);
        self.bsdf(&surface, ray, &Footprint::POINT, Vec3::ONE).pass
    }

    /// The shading normal on the front's side, with the normal map.
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

fn texel3([r, g, b, _]: [f32; 4]) -> Vec3 {
    Vec3::new(r, g, b)
}

/// A normal bent as little as needed for the viewer to be above it.
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

impl Bsdf {
    fn is_mirror(&self) -> bool {
        self.roughness < Material::SMOOTH_ROUGHNESS
    }

    /// Light that leaves the layer again below, off a body of this albedo, and the chances of all parts.
    fn set_diffuse(&mut self, body: Vec3, throughput: Vec3) {
        let reflected = self.own_reflectance(self.o.z);
        let mean = if self.f90 > 0.0 {
            self.mean_reflectance()
        } else {
            Vec3::ZERO
        };
        // A layer that reflects all (a white metal) leaves nothing to couple.
        let remaining = (Vec3::ONE - mean).max(Vec3::splat(1e-6));
        self.diffuse = body * (Vec3::ONE - reflected) / (remaining * std::f32::consts::PI);
        let albedos = [
            self.pass,
            self.clear,
            self.pane,
            self.layered * reflected,
            self.layered * body * (Vec3::ONE - reflected),
        ];
        let shares = albedos.map(|a| a.dot(throughput).max(0.0));
        let sum: f32 = shares.iter().sum();
        self.chances = match sum > 0.0 {
            true => shares.map(|s| s / sum),
            false => [0.0; 5],
        };
    }

    /// Reflectance of the layer from a direction of this cosine.
    fn own_reflectance(&self, cos: f32) -> Vec3 {
        if self.f90 == 0.0 {
            Vec3::ZERO
        } else if self.is_mirror() {
            self.fresnel(cos)
        } else {
            self.table
                .reflectance(cos, self.roughness, self.f0, self.f90)
        }
    }

    /// Its mean; a mirror's is ∫ 2c (F₀ + (F₉₀ − F₀)(1 − c)⁵) dc = F₀ + (F₉₀ − F₀)/21.
    fn mean_reflectance(&self) -> Vec3 {
        if self.is_mirror() {
            self.f0 + (Vec3::splat(self.f90) - self.f0) / 21.0
        } else {
            self.table.mean(self.roughness, self.f0, self.f90)
        }
    }

    fn fresnel(&self, cos: f32) -> Vec3 {
        self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick(cos)
    }

    fn to_world(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.frame;
        x * v.x + y * v.y + z * v.z
    }

    fn to_local(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.frame;
        Vec3::new(x.dot(v), y.dot(v), z.dot(v))
    }

    /// Whether light can be connected to: some part spreads it.
    pub fn is_spread(&self) -> bool {
        self.chances[4] > 0.0 || (self.chances[3] > 0.0 && !self.is_mirror())
    }

    /// f cos θ_i towards `direction` and the density of drawing it, of the parts that spread.
    pub fn value(&self, direction: Vec3) -> (Vec3, f32) {
        let i = self.to_local(direction);
        // Behind the surface itself, whatever its shading normal says.
        if i.z <= 0.0 || self.normal.dot(direction) <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let mut value = self.diffuse * (Vec3::ONE - self.own_reflectance(i.z)) * i.z;
        let mut density = self.chances[4] * i.z * std::f32::consts::FRAC_1_PI;
        if !self.is_mirror() && self.f90 > 0.0 {
            let ggx = Ggx::new(self.roughness);
            let h = (self.o + i).normalize();
            value += self.fresnel(self.o.dot(h)) * ggx.reflected(self.o, i, h);
            density += self.chances[3] * ggx.density(self.o, h);
        }
        (self.layered * value, density)
    }

    /// Draws a direction by three numbers; `None` where the light is absorbed or the drawn direction is not possible.
    pub fn sample(&self, choice: f32, pair: [f32; 2]) -> Option<Scattered> {
        let [pass, clear, pane, gloss, diffuse] = self.chances;
        let mirrored = |direction: Vec3, weight: Vec3, denser: f32| {
            Some(Scattered {
                direction,
                weight,
                kind: Kind::Mirrored { denser },
            })
        };
        let mirror_image = || self.to_world(Vec3::new(-self.o.x, -self.o.y, self.o.z));
        let mut left = choice;
        if left < pass {
            return Some(Scattered {
                direction: -self.view,
                weight: self.pass / pass,
                kind: Kind::Passed,
            });
        }
        left -= pass;
        if left < clear {
            let (r, beyond) = fresnel(self.o.z, self.eta);
            let weight = self.clear / clear;
            if left < r * clear {
                let direction = mirror_image();
                if self.normal.dot(direction) <= 0.0 {
                    return None;
                }
                return mirrored(direction, weight, 1.0);
            }
            let local = Vec3::new(-self.o.x / self.eta, -self.o.y / self.eta, -beyond);
            let direction = self.to_world(local);
            // Radiance grows with the square of the index: less of it here than beyond.
            let denser = self.eta * self.eta;
            if self.normal.dot(direction) >= 0.0 {
                return None;
            }
            return mirrored(direction, weight * self.tint / denser, denser);
        }
        left -= clear;
        if left < pane {
            let direction = mirror_image();
            if self.normal.dot(direction) <= 0.0 {
                return None;
            }
            return mirrored(direction, self.pane / pane, 1.0);
        }
        left -= pane;
        let is_diffuse = left >= gloss || gloss == 0.0;
        if is_diffuse && diffuse == 0.0 {
            return None;
        }
        let direction = if is_diffuse {
            let (x, y) = disk(pair);
            self.to_world(Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()))
        } else if self.is_mirror() {
            let direction = mirror_image();
            if self.normal.dot(direction) <= 0.0 {
                return None;
            }
            let weight = self.layered * self.fresnel(self.o.z) / gloss;
            return mirrored(direction, weight, 1.0);
        } else {
            let h = Ggx::new(self.roughness).sample_normal(self.o, pair);
            self.to_world(2.0 * self.o.dot(h) * h - self.o)
        };
        let (value, density) = self.value(direction);
        (density > 0.0).then_some(Scattered {
            direction,
            weight: value / density,
            kind: Kind::Spread {
                density,
                is_diffuse,
            },
        })
    }
}

/// Evenly over the unit disk.
fn disk([s, t]: [f32; 2]) -> (f32, f32) {
    let (x, y) = crate::sampling::concentric_disk(f64::from(s), f64::from(t));
    (x as f32, y as f32)
}
