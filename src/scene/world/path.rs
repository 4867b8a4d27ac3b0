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
use super::bsdf::{Kind, Scattered};
use super::found_light::{LastScattering, power_share};
use super::geometry::Element;
use super::light_sampling::LightSample;
use super::sampler::{NumberColumns, PathSamples, SurfaceNumbers};
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

/// A ray of the camera and what it meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// The caller's number of the ray.
    pub number: usize,
    pub ray: Ray,
    pub hit: Option<Element>,
    /// Growth of the camera ray's share of the image, mm per mm.
    pub spread: f32,
    /// The random numbers of its path.
    pub samples: PathSamples,
}

/// A path between two surfaces.
#[derive(Clone, Debug)]
struct Path {
    /// The caller's number of its ray.
    number: usize,
    ray: Ray,
    hit: Option<Element>,
    throughput: Vec3,
    /// What the camera's ray itself sees, and what comes to it beyond.
    direct: Vec3,
    indirect: Vec3,
    /// What a light sends if nothing stands in its way.
    expected: Vec3,
    last: LastScattering,
    cone: Cone,
    bounces: u32,
    passes: u32,
    /// Radiance beyond refractions, over that here.
    denser: f32,
    samples: PathSamples,
    /// Whether it goes on.
    is_open: bool,
}

/// Room for paths and their rays, used again and again.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct PathWorkspace {
    pub(super) paths: Paths,
    pub(super) queries: Vec<RayQuery>,
    pub(super) walks: Walks,
    numbers: NumberColumns,
}

/// Paths that are followed together.
#[derive(Clone, Debug, Default)]
pub(super) struct Paths(Vec<Path>);

impl Paths {
    /// Begins one path per ray; false if there is none.
    pub fn start(&mut self, starts: impl Iterator<Item = Start>) -> bool {
        self.0.clear();
        self.0.extend(starts.map(|s| Path::new(&s)));
        !self.0.is_empty()
    }
}

impl Path {
    fn new(start: &Start) -> Self {
        Self {
            number: start.number,
            ray: start.ray,
            hit: start.hit,
            throughput: Vec3::ONE,
            direct: Vec3::ZERO,
            indirect: Vec3::ZERO,
            expected: Vec3::ZERO,
            last: LastScattering {
                density: None,
                origin: start.ray.origin_mm,
                normal: Vec3::Z,
            },
            cone: Cone {
                width_mm: 0.0,
                spread: start.spread,
            },
            bounces: 0,
            passes: 0,
            denser: 1.0,
            samples: start.samples,
            is_open: true,
        }
    }

    /// Goes on in a scattered direction from the side of `normal`; false if the path is at its end.
    #[inline(always)]
    fn turn(
        &mut self,
        surface: &Surface,
        normal: Vec3,
        next: &Scattered,
        settings: &PathSettings,
    ) -> bool {
        self.throughput *= next.weight;
        match next.kind {
            Kind::Passed => {
                self.passes += 1;
                if self.passes > MAX_PASSES {
                    return false;
                }
            }
            Kind::Mirrored { denser } => {
                self.bounces += 1;
                self.denser *= denser;
                self.last.density = None;
            }
            Kind::Spread {
                density,
                is_diffuse,
            } => {
                self.bounces += 1;
                self.last.density = Some(density);
                let cone = &mut self.cone;
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
            if self.bounces > settings.max_bounces {
                return false;
            }
            self.last.origin = surface.position;
            self.last.normal = normal;
            if self.bounces > settings.roulette_after {
                let left = self.throughput.max_element() * self.denser;
                let survival = left.sqrt().min(MOST_SURVIVAL);
                if self.samples.pair()[0] >= survival {
                    return false;
                }
                self.throughput /= survival;
            }
        }
        self.ray = leave(surface, next.direction);
        true
    }
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
        {
            queries.push(RayQuery::nearest(number, path.ray));
        }
    }
}

/// A ray away from a surface, from so far beside it that rounding to f32 leaves it on the same side.
#[inline(always)]
fn leave(surface: &Surface, direction: Vec3) -> Ray {
    Ray {
        origin_mm: surface.beside(direction),
        direction: direction.as_dvec3(),
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
