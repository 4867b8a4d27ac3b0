//! Drawing a light to connect a place to: a direction, the radiance from there over its density, and the density.
//!
//! A kind of light is drawn first, then one of its lights, then a place on it ([`super::lights`]).

use glam::{DVec3, Vec3A as Vec3};

use super::World;
use super::environment::Sky;
use super::facet::even_weights;
use super::light_node::Receiver;
use super::lights::LightKind;
use super::surface::{Footprint, beside};

/// A way to a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSample {
    pub direction: Vec3,
    /// On the light, moved off its surface by what rounding asks for, camera frame, mm; `None` for one at infinity.
    pub place: Option<DVec3>,
    /// Radiance / density.
    pub weight: Vec3,
    /// Per solid angle, the light's choice included; `None` for a light that scattering cannot find.
    pub density: Option<f32>,
}

/// The entry that `u` in 0..1 falls on, its chance, and `u` stretched over it.
fn draw(sums: &[f64], u: f64) -> Option<(usize, f64, f64)> {
    let total = *sums.last()?;
    let target = u * total;
    let i = sums.partition_point(|s| *s <= target).min(sums.len() - 1);
    let start = if i == 0 { 0.0 } else { sums[i - 1] };
    let width = sums[i] - start;
    (width > 0.0).then(|| (i, width / total, ((target - start) / width).clamp(0.0, 1.0)))
}

impl World {
    /// The density of drawing an environment direction as a light.
    pub(super) fn sky_density(&self, direction: Vec3) -> f32 {
        match &self.sky {
            Sky::Even(_) => 0.0,
            Sky::Map(panorama) => panorama.density(direction) * self.lights.kind_chance,
        }
    }

    /// A light for the place `from`, which receives on the side of `normal`; `None` if there is none, or none of it
    /// arrives.
    #[inline(always)]
    pub(super) fn sample_light(
        &self,
        from: DVec3,
        normal: Vec3,
        choice: f32,
        pair: [f32; 2],
    ) -> Option<LightSample> {
        let lights = &self.lights;
        let scaled = f64::from(choice) * lights.kinds.len() as f64;
        // Also `None` for the kind of a `choice` of 1, which is not drawn.
        let kind = lights.kinds.get(scaled as usize)?;
        let rest = scaled - (scaled as u32) as f64;
        let receiver = Receiver::new(from, normal);
        match kind {
            LightKind::Triangles => self.sample_triangle(from, &receiver, rest, pair),
            LightKind::Suns => self.sample_sun(rest, pair),
            LightKind::Points => self.sample_point(from, &receiver, rest),
            LightKind::Panorama => self.sample_panorama(pair),
        }
    }

    #[inline(always)]
    fn sample_triangle(
        &self,
        from: DVec3,
        receiver: &Receiver,
        u: f64,
        pair: [f32; 2],
    ) -> Option<LightSample> {
        let lights = &self.lights;
        let (index, chance) = lights.triangle_tree.draw(receiver, u as f32)?;
        let light = &lights.triangles[index];
        let weights = even_weights(pair);
        let position = light.facet.place(weights);
        let way = position - from;
        let distance = way.length();
        let direction = (way / distance).as_vec3a();
        let cos = light.normal.dot(direction);
        let is_front = cos < 0.0;
        let radiance = light.radiance.map_or_else(
            || {
                let surface = self.surface_at(light.element, &light.facet, weights);
                self.emission(&surface, is_front, &Footprint::POINT)
            },
            |[front, back]| if is_front { front } else { back },
        );
        let density = lights.density_of(index, chance, cos, distance as f32);
        (radiance != Vec3::ZERO && density > 0.0 && direction.is_finite()).then(|| LightSample {
            direction,
            place: Some(beside(position, light.normal, -direction)),
            weight: radiance / density,
            density: Some(density),
        })
    }

    fn sample_sun(&self, u: f64, pair: [f32; 2]) -> Option<LightSample> {
        let lights = &self.lights;
        let (index, chance, _) = draw(&lights.sun_sums, u)?;
        let sun = &lights.suns[index];
        let chance = chance as f32 * self.lights.kind_chance;
        if !sun.is_disc() {
            return Some(LightSample {
                direction: sun.direction,
                place: None,
                weight: sun.irradiance / chance,
                density: None,
            });
        }
        // Evenly over the cone.
        let (sin_phi, cos_phi) = (std::f32::consts::TAU * pair[0]).sin_cos();
        let rise = pair[1] * sun.rise;
        let sin = (rise * (2.0 - rise)).max(0.0).sqrt();
        let (x, y) = sun.direction.any_orthonormal_pair();
        let direction = x * (sin * cos_phi) + y * (sin * sin_phi) + sun.direction * (1.0 - rise);
        let (radiance, density) = lights.sun_disc(direction);
        (density > 0.0).then(|| LightSample {
            direction,
            place: None,
            weight: radiance / density,
            density: Some(density),
        })
    }

    fn sample_point(&self, from: DVec3, receiver: &Receiver, u: f64) -> Option<LightSample> {
        let lights = &self.lights;
        let (index, chance) = lights.point_tree.draw(receiver, u as f32)?;
        let point = &lights.points[index];
        let way = point.position - from;
        let distance = way.length() as f32;
        let direction = (way / way.length()).as_vec3a();
        let share = point.cone.map_or(1.0, |(axis, inner, outer)| {
            // glTF's falloff: the square of a ramp in the cosine.
            let ramp = (-direction.dot(axis) - outer) / (inner - outer).max(1e-6);
            ramp.clamp(0.0, 1.0).powi(2)
        });
        (share > 0.0 && distance > 0.0).then(|| LightSample {
            direction,
            place: Some(point.position),
            weight: point.intensity
                * (share / (distance * distance * chance * self.lights.kind_chance)),
            density: None,
        })
    }

    fn sample_panorama(&self, pair: [f32; 2]) -> Option<LightSample> {
        let Sky::Map(panorama) = &self.sky else {
            return None;
        };
        let (direction, density) = panorama.sample(pair);
        let density = density * self.lights.kind_chance;
        (density > 0.0).then(|| LightSample {
            direction,
            place: None,
            weight: self.sky.radiance(direction) / density,
            density: Some(density),
        })
    }
}
