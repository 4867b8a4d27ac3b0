//! A path between two surfaces: what it carries, and how it goes on from one.

use glam::Vec3A as Vec3;

use super::bsdf::{Kind, Scattered};
use super::found_light::LastScattering;
use super::geometry::Element;
use super::path::PathSettings;
use super::sampler::PathSamples;
use super::surface::Surface;
use crate::rays::Ray;

/// How often a path may pass straight through veils and panes, beside its bounces.
const MAX_PASSES: u32 = 64;
/// Survival in Russian roulette, at most.
const MOST_SURVIVAL: f32 = 0.95;
/// Half width of the cone of a path after a diffuse surface, rad.
const DIFFUSE_SPREAD: f32 = 0.2;

/// The cone of the texture filter: its width and growth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    pub width_mm: f32,
    pub spread: f32,
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
pub(super) struct Path {
    /// The caller's number of its ray.
    pub number: usize,
    pub ray: Ray,
    pub hit: Option<Element>,
    pub throughput: Vec3,
    /// What the camera's ray itself sees, and what comes to it beyond.
    pub direct: Vec3,
    pub indirect: Vec3,
    /// What a light sends if nothing stands in its way.
    pub expected: Vec3,
    pub last: LastScattering,
    pub cone: Cone,
    pub bounces: u32,
    pub passes: u32,
    /// Radiance beyond refractions, over that here.
    pub denser: f32,
    pub samples: PathSamples,
    /// Whether it goes on.
    pub is_open: bool,
}

/// Paths that are followed together.
#[derive(Clone, Debug, Default)]
pub(super) struct Paths(pub(super) Vec<Path>);

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
    pub fn turn(
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

/// A ray away from a surface, from so far beside it that rounding to f32 leaves it on the same side.
#[inline(always)]
pub(super) fn leave(surface: &Surface, direction: Vec3) -> Ray {
    Ray {
        origin_mm: surface.beside(direction),
        direction: direction.as_dvec3(),
    }
}
