//! What the camera asks of a world: first hits, and radiances along its rays.

use glam::{DVec3, Vec3};

use super::World;
use super::geometry::Element;
use super::path::{PathSettings, PathWorkspace};
use super::path_state::Start;
use super::sampler::{PathSamples, TOGETHER};
use super::trace::RayQuery;
use super::walk::Walks;
use crate::rays::Ray;

/// The first surface on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// From the ray's origin, mm.
    pub distance_mm: f64,
    /// Unit shading normal (smooth, without normal maps) on the side of the ray.
    pub normal: DVec3,
    /// The instance's object.
    pub object_id: u16,
}

/// Which random numbers the path of a camera ray uses, and how finely such rays sample the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathKey {
    /// Shared by rays that are averaged: those of a pixel.
    pub key: u64,
    /// Number of the ray among them.
    pub number: u32,
    /// By how much a ray's share of the image grows with distance, mm per mm: for N rays per pixel, its angle over √N.
    pub spread: f32,
}

/// A ray of a camera, and the random numbers of its path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Camera frame, mm.
    pub origin_mm: DVec3,
    /// Unit vector away from the camera.
    pub direction: DVec3,
    /// The path's random numbers.
    pub key: PathKey,
}

impl World {
    /// What a ray (camera frame, mm; unit direction) meets first.
    pub fn first_hit(&self, origin_mm: DVec3, direction: DVec3) -> Option<FirstHit> {
        let ray = Ray {
            origin_mm,
            direction,
        };
        let element = self.closest(&ray, &mut Walks::default())?;
        Some(self.hit_of(element, &ray))
    }

    /// Where a ray meets the triangle that it meets first.
    pub(in crate::scene) fn hit_of(&self, element: Element, ray: &Ray) -> FirstHit {
        let surface = self.surface(element, ray);
        let side = if surface.normal.as_dvec3().dot(ray.direction) < 0.0 {
            1.0
        } else {
            -1.0
        };
        FirstHit {
            distance_mm: surface.distance,
            normal: surface.shading.as_dvec3() * side,
            object_id: surface.object_id,
        }
    }

    /// Radiance along a ray (camera frame, mm; unit direction) by one path, number `key.number` of those of `key.key`
    /// that are averaged.
    pub fn radiance_along(
        &self,
        origin_mm: DVec3,
        direction: DVec3,
        settings: &PathSettings,
        key: &PathKey,
    ) -> [f32; 3] {
        let mut radiance = [0.0; 3];
        let ray = CameraRay {
            origin_mm,
            direction,
            key: *key,
        };
        self.radiances(&[ray], settings, |_, l| radiance = l);
        radiance
    }

    /// [`Self::radiance_along`] of many rays, which is faster than of each alone: `visit` hears of each ray's place in
    /// the list and its radiance, in no order.
    pub fn radiances(
        &self,
        rays: &[CameraRay],
        settings: &PathSettings,
        mut visit: impl FnMut(usize, [f32; 3]),
    ) {
        let workspace = &mut PathWorkspace::default();
        for (chunk, rays) in rays.chunks(TOGETHER).enumerate() {
            let all = rays.iter().map(|r| Ray {
                origin_mm: r.origin_mm,
                direction: r.direction,
            });
            workspace.queries.clear();
            workspace
                .queries
                .extend(all.enumerate().map(|(i, ray)| RayQuery::nearest(i, ray)));
            self.trace(&mut workspace.queries, &mut workspace.walks);
            let starts = workspace
                .queries
                .iter()
                .zip(rays)
                .map(|(query, ray)| Start {
                    number: chunk * TOGETHER + query.number,
                    ray: query.ray,
                    hit: query.nearest_element(),
                    spread: ray.key.spread,
                    samples: PathSamples::new(ray.key.key, ray.key.number),
                });
            workspace.paths.start(starts);
            self.radiance(settings, workspace, |number, l| visit(number, l.to_array()));
        }
    }

    /// The triangles that camera rays, each with its number, meet first.
    pub(in crate::scene) fn first_elements(
        &self,
        rays: impl Iterator<Item = (usize, Ray)>,
        workspace: &mut PathWorkspace,
        mut visit: impl FnMut(usize, Element, &Ray),
    ) {
        let mut rays = rays.map(|(number, ray)| RayQuery::nearest(number, ray));
        loop {
            workspace.queries.clear();
            workspace.queries.extend(rays.by_ref().take(2 * TOGETHER));
            if workspace.queries.is_empty() {
                return;
            }
            self.trace(&mut workspace.queries, &mut workspace.walks);
            for query in &workspace.queries {
                if let Some(element) = query.nearest_element() {
                    visit(query.number, element, &query.ray);
                }
            }
        }
    }

    /// Radiance along camera rays (each with its number) whose first hits are known; `key` says a ray's random numbers.
    /// Rays of one number and different wavelengths meet nearly the same places and follow paths of the same
    /// random numbers, whatever channel is wanted of them: what a path misses or finds by luck it does in all colours,
    /// so that its error is one of brightness and not of colour.
    pub(in crate::scene) fn radiances_of_hits(
        &self,
        rays: impl Iterator<Item = ((usize, Ray), Option<Element>)>,
        (settings, key): (&PathSettings, impl Fn(usize) -> PathKey),
        workspace: &mut PathWorkspace,
        mut visit: impl FnMut(usize, Vec3),
    ) {
        let mut starts = rays.map(|((number, ray), hit)| {
            let key = key(number);
            Start {
                number,
                ray,
                hit,
                spread: key.spread,
                samples: PathSamples::new(key.key, key.number),
            }
        });
        while workspace.paths.start(starts.by_ref().take(TOGETHER)) {
            self.radiance(settings, workspace, |number, l| visit(number, l.into()));
        }
    }
}
