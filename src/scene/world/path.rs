//! Radiance along a ray: a path that is scattered from surface to surface, connected to a light at each.
//!
//! Light reaches a place by two techniques, a connection to a drawn light and the scattered ray itself; each is weighed
//! by the square of its density over the sum of both squares (E. Veach, L. Guibas, SIGGRAPH 1995: multiple importance
//! sampling, power heuristic). What scattering alone can find (an even environment, lights seen in mirrors) counts
//! whole, and so does what connections alone can (points, parallel light). After a few surfaces, paths end by chance
//! and the survivors weigh more (Russian roulette), so nothing is cut off but by `max_bounces`.
//!
//! Texture lookups are filtered by a cone around the path (T. Akenine-Möller et al., *Ray Tracing Gems* (2019), ch.
//! 20): as wide as the sampling of the image asks for, wider after each rough surface.

use glam::Vec3A as Vec3;

use super::World;
use super::found_light::power_share;
use super::light_sampling::LightSample;
use super::path_state::{Path, Paths, leave};
use super::sampler::{NumberColumns, SurfaceNumbers};
use super::surface::Surface;
use super::trace::{QueryResult, RayQuery};
use super::walk::Walks;
use crate::rays::Ray;
use crate::simd::SimdLevel;

/// How paths are followed. Part of what changes the image: it is recorded with it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathSettings {
    /// Surfaces at which a path is scattered at most: 0 sees lights only, 1 direct light, … Light of longer paths is
    /// missing.
    pub max_bounces: u32,
    /// Surfaces after which Russian roulette begins: a path goes on with a chance of √w, 0.95 at most, w the largest
    /// of its weights of R, G and B, refractions' squeezing of radiance taken out.
    pub roulette_after: u32,
    /// Largest radiance, of any channel, that one path may add beyond what its ray sees directly; `None` (the default)
    /// cuts nothing. It removes bright speckles and with them light: an image rendered with it is too dark.
    pub clamp: Option<f32>,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            max_bounces: 16,
            roulette_after: 3,
            clamp: None,
        }
    }
}

/// Room for paths and their rays, used again and again.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct PathWorkspace {
    pub(super) paths: Paths,
    pub(super) queries: Vec<RayQuery>,
    pub(super) walks: Walks,
    numbers: NumberColumns,
}

impl World {
    /// Follows the paths that have been started to their ends; `visit` hears of each one's number and radiance.
    pub(super) fn radiance(
        &self,
        settings: &PathSettings,
        workspace: &mut PathWorkspace,
        visit: impl FnMut(usize, Vec3),
    ) {
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe {
                self.follow_avx2(settings, workspace, visit);
            },
            _ => self.follow(settings, workspace, visit),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn follow_avx2(
        &self,
        settings: &PathSettings,
        workspace: &mut PathWorkspace,
        visit: impl FnMut(usize, Vec3),
    ) {
        self.follow(settings, workspace, visit);
    }

    /// The same by the instructions of the caller.
    #[inline(always)]
    pub(super) fn follow(
        &self,
        settings: &PathSettings,
        workspace: &mut PathWorkspace,
        mut visit: impl FnMut(usize, Vec3),
    ) {
        let PathWorkspace {
            paths: Paths(paths),
            queries,
            walks,
            numbers,
        } = workspace;
        while !paths.is_empty() {
            queries.clear();
            numbers.draw(paths.iter_mut().map(|path| &mut path.samples));
            for (i, path) in paths.iter_mut().enumerate() {
                self.advance(i, path, (settings, &numbers.of(i)), queries);
            }
            self.trace(queries, walks);
            // A path that asked for nothing more is at its end.
            paths.iter_mut().for_each(|path| path.is_open = false);
            for query in queries.iter() {
                let path = &mut paths[query.number];
                match query.result {
                    QueryResult::Nearest(hit) => {
                        path.hit = hit;
                        path.is_open = true;
                    }
                    QueryResult::Transmittance(share) => path.indirect += path.expected * share,
                }
            }
            paths.retain(|path| {
                if !path.is_open {
                    let indirect = match settings.clamp {
                        Some(most) => path.indirect.min(Vec3::splat(most)),
                        None => path.indirect,
                    };
                    visit(path.number, path.direct + indirect);
                }
                path.is_open
            });
        }
    }

    /// Follows a path over the surface that it has met, and asks for what it needs next: whether a light arrives there,
    /// what it meets then.
    #[inline(always)]
    fn advance(
        &self,
        number: usize,
        path: &mut Path,
        (settings, numbers): (&PathSettings, &SurfaceNumbers),
        queries: &mut Vec<RayQuery>,
    ) {
        let found = match path.bounces {
            0 => &mut path.direct,
            _ => &mut path.indirect,
        };
        let ray = path.ray;
        let direction = ray.direction.as_vec3a();
        let Some(element) = path.hit else {
            *found += path.throughput * self.background(direction, &path.last);
            return;
        };
        let surface = self.surface(element, &ray);
        path.cone.width_mm += path.cone.spread * surface.distance as f32;
        // What is seen directly or in mirrors is worth the sharper filter.
        let is_sharp = path.last.density.is_none();
        let footprint = surface.footprint(path.cone.width_mm, direction, is_sharp);
        let shine = self.shine(element, &surface, direction, &path.last, &footprint);
        *found += path.throughput * shine;
        if path.bounces == settings.max_bounces && !self.traits[surface.material].lets_through {
            return;
        }
        let bsdf = self.bsdf(&surface, &ray, &footprint, path.throughput);
        if bsdf.is_spread()
            && path.bounces < settings.max_bounces
            && let Some(light) = self.sample_light(
                surface.position,
                bsdf.normal,
                numbers.light_choice,
                numbers.light,
            )
        {
            let (value, density) = bsdf.value(light.direction);
            if value != Vec3::ZERO {
                let share = light.density.map_or(1.0, |d| power_share(d, density));
                path.expected = path.throughput * value * light.weight * share;
                let (to_light, reach) = connection(&surface, &light);
                queries.push(RayQuery::transmittance(number, to_light, reach));
            }
        }
        if let Some(next) = bsdf.sample(numbers)
            && path.turn(&surface, bsdf.normal, &next, settings)
            // At its last surface a path takes only what that sends itself.
            && (path.bounces < settings.max_bounces || self.may_shine_along(&path.ray))
        {
            queries.push(RayQuery::nearest(number, path.ray));
        }
    }
}

/// A ray to a light, and how far it goes, mm.
#[inline(always)]
fn connection(surface: &Surface, light: &LightSample) -> (Ray, f32) {
    let Some(place) = light.place else {
        return (leave(surface, light.direction), f32::INFINITY);
    };
    // From beside the surface to beside the light: neither may stand in the way, however near they are.
    let origin_mm = surface.beside(light.direction);
    let way = place - origin_mm;
    let distance = way.length();
    let direction = match distance > 0.0 {
        true => way / distance,
        false => light.direction.as_dvec3(),
    };
    let ray = Ray {
        origin_mm,
        direction,
    };
    (ray, distance as f32)
}
