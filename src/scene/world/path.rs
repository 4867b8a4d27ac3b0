//! Radiance along a ray: a path that is scattered from surface to surface, connected to a light at each.
//!
//! Light reaches a place by two techniques, a connection to a drawn light and the scattered ray itself; each is weighed by the square of its density over
//! the sum of both squares (E. Veach, L. Guibas, SIGGRAPH 1995: multiple importance sampling, power heuristic). What scattering alone
//! can find (an even environment, lights seen in mirrors) counts whole, and so does what connections alone can (points, parallel light). After a
//! few surfaces, paths end by chance and the survivors weigh more (Russian roulette), so nothing is cut off but by `max_bounces`.
//!
//! Texture lookups are filtered by a cone around the path (T. Akenine-Möller et al., *Ray Tracing Gems* (2019), ch. 20): as wide as the sampling of the image
//! asks for, wider after each rough surface.

use glam::{DVec3, Vec3};

use super::World;
use super::bvh::Stack;
use super::material::Kind;
use super::sampler::PathSamples;
use super::surface::Surface;
use super::trace::{Element, Ray};

/// How paths are followed. Part of what changes the image: it is recorded with it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathSettings {
    /// Surfaces at which a path is scattered at most: 0 sees lights only, 1 direct light, … Light of longer paths is missing.
    pub max_bounces: u32,
    /// Surfaces after which Russian roulette begins.
    pub roulette_after: u32,
    /// Largest radiance, of any channel, that one path may add beyond what its ray sees directly; `None` (the default) cuts nothing. It removes
    /// bright speckles and with them light: an image rendered with it is too dark.
    pub clamp: Option<f32>,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            max_bounces: 16,
            roulette_after: 4,
            clamp: None,
        }
    }
}

/// How often a path may pass straight through veils and panes, beside its bounces.
const MAX_PASSES: u32 = 64;
/// Survival in Russian roulette, at most.
const MOST_SURVIVAL: f32 = 0.95;
/// Half width of the cone of a path after a diffuse surface, rad.
const DIFFUSE_SPREAD: f32 = 0.2;

/// The cone of the texture filter: its width and growth.
#[derive(Clone, Copy, Debug)]
struct Cone {
    width_mm: f32,
    spread: f32,
}

/// What the next hit of a path needs to know of the last scattering.
#[derive(Clone, Copy, Debug)]
struct Last {
    /// Density of its direction; `None` if connections could not have found it (the camera's ray, mirrors).
    density: Option<f32>,
    origin: DVec3,
}

/// A ray of the camera and what it meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub ray: Ray,
    pub hit: Option<Element>,
    /// Growth of the camera ray's share of the image, mm a mm.
    pub spread: f32,
    /// 1 for channels that are wanted, else 0.
    pub channels: Vec3,
}

impl World {
    /// Radiance that arrives along a ray of the camera, by one path.
    pub(super) fn radiance(
        &self,
        start: &Start,
        settings: &PathSettings,
        mut samples: PathSamples,
        stack: &mut Stack,
    ) -> Vec3 {
        let (mut ray, mut hit) = (start.ray, start.hit);
        let mut throughput = start.channels;
        let (mut direct, mut indirect) = (Vec3::ZERO, Vec3::ZERO);
        let mut last = Last {
            density: None,
            origin: ray.origin,
        };
        let mut cone = Cone {
            width_mm: 0.0,
            spread: start.spread,
        };
        let (mut bounces, mut passes) = (0, 0);
        // Radiance beyond refractions, over that here.
        let mut denser = 1.0;
        loop {
            let found = if bounces == 0 {
                &mut direct
            } else {
                &mut indirect
            };
            let Some(element) = hit else {
                *found += throughput * self.background(ray.direction.as_vec3(), &last);
                break;
            };
            let surface = self.surface(element, &ray);
            cone.width_mm += cone.spread * surface.distance as f32;
            let direction = ray.direction.as_vec3();
            let slant = surface.normal.dot(direction).abs().max(0.05);
            let footprint_mm = cone.width_mm / slant;
            *found += throughput * self.shine(&surface, direction, &last, footprint_mm);
            if bounces == settings.max_bounces && !self.lets_through[surface.material] {
                break;
            }
            let bsdf = self.bsdf(&surface, &ray, footprint_mm, throughput);
            let [choice, light_choice] = samples.pair();
            let (scatter_pair, light_pair) = (samples.pair(), samples.pair());
            if bsdf.is_spread() && bounces < settings.max_bounces {
                let light = self.sample_light(surface.position, light_choice, light_pair);
                if let Some(light) = light {
                    let (value, density) = bsdf.value(light.direction);
                    if value != Vec3::ZERO {
                        let share = light.density.map_or(1.0, |d| power_share(d, density));
                        let to_light = leave(&surface, light.direction);
                        let arriving = self.transmittance(&to_light, light.distance, stack);
                        indirect += throughput * value * light.weight * arriving * share;
                    }
                }
            }
            let Some(next) = bsdf.sample(choice, scatter_pair) else {
                break;
            };
            throughput *= next.weight;
            match next.kind {
                Kind::Passed => {
                    passes += 1;
                    if passes > MAX_PASSES {
                        break;
                    }
                }
                Kind::Mirrored { denser: d } => {
                    bounces += 1;
                    denser *= d;
                    last.density = None;
                }
                Kind::Spread {
                    density,
                    is_diffuse,
                } => {
                    bounces += 1;
                    last.density = Some(density);
                    if is_diffuse {
                        cone.spread = cone.spread.max(DIFFUSE_SPREAD);
                    } else {
                        // About the lobe's own half width, 1/√(π density).
                        let lobe = (std::f32::consts::PI * density).sqrt().recip();
                        cone.spread = (cone.spread + lobe).min(DIFFUSE_SPREAD);
                    }
                }
            }
            if next.kind != Kind::Passed {
                if bounces > settings.max_bounces {
                    break;
                }
                last.origin = surface.position;
                if bounces > settings.roulette_after {
                    let survival = (throughput.max_element() * denser).min(MOST_SURVIVAL);
                    if samples.pair()[0] >= survival {
                        break;
                    }
                    throughput /= survival;
                }
            }
            ray = leave(&surface, next.direction);
            hit = self.closest(&ray, stack);
        }
        if let Some(most) = settings.clamp {
            indirect = indirect.min(Vec3::splat(most));
        }
        direct + indirect
    }

    /// Radiance from beyond everything, weighed as scattering's share.
    fn background(&self, direction: Vec3, last: &Last) -> Vec3 {
        let sky = self.sky.radiance(direction);
        let (disc, disc_density) = self.lights.sun_disc(direction);
        let Some(density) = last.density else {
            return sky + disc;
        };
        sky * power_share(density, self.sky_density(direction))
            + disc * power_share(density, disc_density)
    }

    /// Radiance that a surface itself sends against the ray, weighed as scattering's share.
    fn shine(&self, surface: &Surface, direction: Vec3, last: &Last, footprint_mm: f32) -> Vec3 {
        let is_front = surface.normal.dot(direction) < 0.0;
        let radiance = self.emission(surface, is_front, footprint_mm * surface.uv_per_mm);
        match last.density {
            Some(density) if radiance != Vec3::ZERO => {
                let distance = (surface.position - last.origin).length() as f32;
                let as_light = self.lights.triangle_density(surface, direction, distance);
                radiance * power_share(density, as_light)
            }
            _ => radiance,
        }
    }
}

/// Share of the technique of density `a` beside one of density `b`; `a` > 0.
fn power_share(a: f32, b: f32) -> f32 {
    // As a ratio, so that large densities do not overflow.
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

/// A ray away from a surface, from so far beside it that rounding to f32 leaves it on the same side.
fn leave(surface: &Surface, direction: Vec3) -> Ray {
    let reach = surface.position.abs().max_element();
    let step = reach * (8.0 * f64::from(f32::EPSILON));
    let side = if surface.normal.dot(direction) < 0.0 {
        -1.0
    } else {
        1.0
    };
    Ray {
        origin: surface.position + surface.normal.as_dvec3() * (side * step),
        direction: direction.as_dvec3(),
    }
}
