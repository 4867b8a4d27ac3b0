//! A world of triangle meshes, materials and lights, whose radiance is found by following paths of light.
//!
//! ```text
//! WorldDescription ─ check ─▶ World: stage (trees of triangles) · materials · lights · sky
//! ray ─ trace ─▶ Element ─ surface ─▶ place ─ material ─▶ Bsdf ─ path ─▶ radiance
//!                                              lights ─────────┘
//! ```
//!
//! Places are f64, so that a depth is as exact as its vertices; the walk through the trees and all shading are f32, whose rounding is far below the noise of
//! the paths.

mod bvh;
mod check;
mod description;
mod environment;
mod fold;
mod geometry;
mod lanes;
mod lights;
mod material;
mod microfacet;
mod path;
mod sampler;
mod shapes;
mod surface;
mod texture_map;
mod trace;
mod triangles;
mod walk;

#[cfg(test)]
mod tests;

pub use check::WorldWarnings;
pub use description::{
    Alpha, Environment, Instance, Light, Material, MaterialIndices, NormalMap, TextureRef,
    TriangleMesh, WorldDescription,
};
pub use path::PathSettings;
pub use texture_map::{Encoding, TextureMap, Wrap};

pub(super) use path::Room;
pub(super) use trace::Element;

use glam::{DVec3, Vec3};

use crate::range::OutOfRange;
use crate::sampling::hash;
use path::{Start, TOGETHER};
use sampler::PathSamples;
use trace::{Errand, Ray};
use walk::Walks;

/// A checked world, ready for rays.
#[derive(Clone, Debug)]
pub struct World {
    stage: geometry::Stage,
    materials: Vec<Material>,
    textures: Vec<TextureMap>,
    lights: lights::Lights,
    sky: environment::Sky,
    albedos: microfacet::AlbedoTable,
    /// Whether any material is a cut-out.
    has_masks: bool,
    /// Of each material, whether shadow rays may pass, and whether of any.
    lets_through: Vec<bool>,
    has_veils: bool,
    /// Of each material, whether it is diffuse and nothing else.
    is_matt: Vec<bool>,
    /// Of each material, whether it asks for texture coordinates.
    is_textured: Vec<bool>,
    warnings: WorldWarnings,
}

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

/// Which random numbers a batch of camera rays uses, and how finely they sample the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathKey {
    /// Shared by rays that are averaged: those of a pixel.
    pub key: u64,
    /// Number of the batch's first ray among them.
    pub first: u32,
    /// By how much a ray's share of the image grows with distance, mm a mm: for N rays a pixel, its angle over √N.
    pub spread: f32,
}

/// A ray of a camera, and the random numbers of its path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Camera frame, mm.
    pub origin_mm: DVec3,
    /// Unit vector away from the camera.
    pub direction: DVec3,
    /// The path's random numbers: `first` is its own.
    pub key: PathKey,
}

fn is_textured(m: &Material) -> bool {
    m.base_colour_texture.is_some()
        || m.metallic_roughness_texture.is_some()
        || m.emission_texture.is_some()
        || m.normal_map.is_some()
}

impl World {
    /// Checks a description and prepares it for rays.
    ///
    /// # Errors
    /// An index out of range, a number outside what its field allows, lists of unequal length. Triangles and vertices that are only
    /// bad in themselves are left out or mended, and counted ([`World::warnings`]).
    pub fn new(description: WorldDescription) -> Result<Self, OutOfRange> {
        check::check(&description)?;
        let mut warnings = WorldWarnings::default();
        let stage = geometry::Stage::new(&description, &mut warnings);
        let sky = environment::Sky::new(&description.environment);
        let materials = &description.materials;
        Ok(Self {
            lights: lights::Lights::new(&description, &stage, &sky),
            has_masks: materials
                .iter()
                .any(|m| matches!(m.alpha, Alpha::Mask { .. })),
            lets_through: materials.iter().map(material::lets_through).collect(),
            has_veils: materials.iter().any(material::lets_through),
            is_matt: materials.iter().map(material::is_matt).collect(),
            is_textured: materials.iter().map(is_textured).collect(),
            albedos: microfacet::AlbedoTable::new(),
            materials: description.materials,
            textures: description.textures,
            stage,
            sky,
            warnings,
        })
    }

    /// What was left out or mended.
    pub fn warnings(&self) -> WorldWarnings {
        self.warnings
    }

    /// Triangles of all instances.
    pub fn triangles(&self) -> usize {
        let of = |p: &geometry::Placed| self.stage.geometries[p.geometry].triangles.len();
        self.stage.placed.iter().map(of).sum()
    }

    /// Least and greatest corner of all triangles, camera frame, mm; `None` without any.
    pub fn bounds_mm(&self) -> Option<[DVec3; 2]> {
        let b = self.stage.bounds;
        (b.least.x <= b.greatest.x).then(|| [b.least.as_dvec3(), b.greatest.as_dvec3()])
    }

    /// What a ray (camera frame, mm; unit direction) meets first.
    pub fn first_hit(&self, origin_mm: DVec3, direction: DVec3) -> Option<FirstHit> {
        let ray = Ray {
            origin: origin_mm,
            direction,
        };
        let element = self.closest(&ray, &mut Walks::default())?;
        Some(self.hit_of(element, &ray))
    }

    fn hit_of(&self, element: Element, ray: &Ray) -> FirstHit {
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

    /// Radiance along a ray (camera frame, mm; unit direction) by one path, number `key.first` of those of `key.key` that are averaged.
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

    /// [`Self::radiance_along`] of many rays, which is faster than of each alone: `found` hears of each ray's place in the list and
    /// its radiance, in no order.
    pub fn radiances(
        &self,
        rays: &[CameraRay],
        settings: &PathSettings,
        mut found: impl FnMut(usize, [f32; 3]),
    ) {
        let room = &mut Room::default();
        for (chunk, rays) in rays.chunks(TOGETHER).enumerate() {
            let all = rays.iter().map(|r| Ray {
                origin: r.origin_mm,
                direction: r.direction,
            });
            room.errands.clear();
            room.errands
                .extend(all.enumerate().map(|(i, ray)| Errand::nearest(i, ray)));
            self.run(&mut room.errands, &mut room.walks);
            let starts = room.errands.iter().zip(rays).map(|(errand, ray)| Start {
                number: chunk * TOGETHER + errand.number,
                ray: errand.ray,
                hit: errand.nearest_element(),
                spread: ray.key.spread,
                channels: Vec3::ONE,
                samples: PathSamples::new(ray.key.key, ray.key.first),
            });
            room.paths.set_out(starts);
            self.radiance(settings, room, |number, l| found(number, l.to_array()));
        }
    }

    /// First hits of camera rays (number, origin and direction of each): element, distance and object.
    pub(super) fn meet(
        &self,
        rays: impl Iterator<Item = (usize, DVec3, DVec3)>,
        room: &mut Room,
        mut found: impl FnMut(usize, Element, FirstHit),
    ) {
        let mut rays = rays
            .map(|(number, origin, direction)| Errand::nearest(number, Ray { origin, direction }));
        loop {
            room.errands.clear();
            room.errands.extend(rays.by_ref().take(2 * TOGETHER));
            if room.errands.is_empty() {
                return;
            }
            self.run(&mut room.errands, &mut room.walks);
            for errand in &room.errands {
                if let Some(element) = errand.nearest_element() {
                    found(errand.number, element, self.hit_of(element, &errand.ray));
                }
            }
        }
    }

    /// Radiance of the wanted channels along camera rays (number, origin, direction) whose first hits are known. A ray's number is added to the
    /// key's.
    pub(super) fn shade(
        &self,
        rays: impl Iterator<Item = ((usize, DVec3, DVec3), Option<Element>)>,
        channels: std::ops::Range<usize>,
        (settings, key): (&PathSettings, &PathKey),
        room: &mut Room,
        mut found: impl FnMut(usize, Vec3),
    ) {
        let wanted = [0, 1, 2].map(|c| f32::from(channels.contains(&c)));
        // Channels with rays of their own have paths of their own.
        let own_key = hash(key.key, &[channels.start as u64]);
        let mut starts = rays.map(|((number, origin, direction), hit)| Start {
            number,
            ray: Ray { origin, direction },
            hit,
            spread: key.spread,
            channels: Vec3::from(wanted),
            samples: PathSamples::new(own_key, key.first.wrapping_add(number as u32)),
        });
        while room.paths.set_out(starts.by_ref().take(TOGETHER)) {
            self.radiance(settings, room, &mut found);
        }
    }
}
