//! The parts of a surface at one place: their values, and drawing directions from them.

use glam::Vec3A as Vec3;

use super::description::Material;
use super::microfacet::{AlbedoTable, Ggx, fresnel, schlick};
use super::sampler::SurfaceNumbers;

/// A surface at one place ([`super::material`]). Directions point away from the surface.
#[derive(Clone, Debug)]
pub(super) struct Bsdf {
    pub table: &'static AlbedoTable,
    /// x, y and the shading normal on the viewer's side.
    pub frame: [Vec3; 3],
    /// The geometric normal on the viewer's side.
    pub normal: Vec3,
    pub view: Vec3,
    /// `view` in the frame; z above 0.
    pub o: Vec3,
    /// Straight on.
    pub pass: Vec3,
    /// Solid glass: weight, tint, index beyond over index here.
    pub clear: Vec3,
    pub tint: Vec3,
    pub eta: f32,
    /// A thin pane's mirror image.
    pub pane: Vec3,
    /// Weight of the layered part.
    pub layered: f32,
    /// (1 − metallic) base/π (1 − E(θ_o))/(1 − Ē).
    pub diffuse: Vec3,
    pub f0: Vec3,
    pub f90: f32,
    pub roughness: f32,
    /// Chances of drawing [pass, clear, pane, gloss, diffuse].
    pub chances: [f32; 5],
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

impl Bsdf {
    #[inline(always)]
    fn is_mirror(&self) -> bool {
        self.roughness < Material::SMOOTH_ROUGHNESS
    }

    /// Light that leaves the layer again below, off a body of this albedo, and the chances of all parts.
    pub fn set_diffuse(&mut self, body: Vec3, throughput: Vec3) {
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

    #[inline(always)]
    fn fresnel(&self, cos: f32) -> Vec3 {
        self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick(cos)
    }

    #[inline(always)]
    fn to_world(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.frame;
        x * v.x + y * v.y + z * v.z
    }

    #[inline(always)]
    fn to_local(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.frame;
        Vec3::new(x.dot(v), y.dot(v), z.dot(v))
    }

    /// Whether light can be connected to: some part spreads it.
    #[inline(always)]
    pub fn is_spread(&self) -> bool {
        self.chances[4] > 0.0 || (self.chances[3] > 0.0 && !self.is_mirror())
    }

    /// f cos θ_i towards `direction` and the density of drawing it, of the parts that spread.
    #[inline(always)]
    pub fn value(&self, direction: Vec3) -> (Vec3, f32) {
        if self.f90 == 0.0 {
            return self.diffuse_value(direction);
        }
        let i = self.to_local(direction);
        // Behind the surface itself, whatever its shading normal says.
        if i.z <= 0.0 || self.normal.dot(direction) <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let mut value = self.diffuse * (Vec3::ONE - self.own_reflectance(i.z)) * i.z;
        let mut density = self.chances[4] * i.z * std::f32::consts::FRAC_1_PI;
        if !self.is_mirror() {
            let ggx = Ggx::new(self.roughness);
            let h = (self.o + i).normalize();
            value += self.fresnel(self.o.dot(h)) * ggx.reflected(self.o, i, h);
            density += self.chances[3] * ggx.density(self.o, h);
        }
        (self.layered * value, density)
    }

    /// Of a surface without a layer.
    #[inline(always)]
    fn diffuse_value(&self, direction: Vec3) -> (Vec3, f32) {
        let cos = self.frame[2].dot(direction);
        if cos <= 0.0 || self.normal.dot(direction) <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let density = self.chances[4] * cos * std::f32::consts::FRAC_1_PI;
        (self.layered * self.diffuse * cos, density)
    }

    /// Draws a direction; `None` where the light is absorbed or the drawn direction is not possible.
    #[inline(always)]
    pub fn sample(&self, numbers: &SurfaceNumbers) -> Option<Scattered> {
        let [pass, clear, pane, gloss, diffuse] = self.chances;
        let mirrored = |direction: Vec3, weight: Vec3, denser: f32| {
            Some(Scattered {
                direction,
                weight,
                kind: Kind::Mirrored { denser },
            })
        };
        let mirror_image = || self.to_world(Vec3::new(-self.o.x, -self.o.y, self.o.z));
        let mut left = numbers.choice;
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
            let [x, y] = numbers.disk;
            self.to_world(Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()))
        } else if self.is_mirror() {
            let direction = mirror_image();
            if self.normal.dot(direction) <= 0.0 {
                return None;
            }
            let weight = self.layered * self.fresnel(self.o.z) / gloss;
            return mirrored(direction, weight, 1.0);
        } else {
            let h = Ggx::new(self.roughness).sample_normal(self.o, numbers.scatter);
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
