//! What rays meet: the nearest triangle, or how much light arrives along them.
//!
//! The walk works in f32; what it finds is computed again in f64 ([`super::surface`]), so that depths are exact to the
//! vertices' own rounding.

use glam::Vec3A as Vec3;

use super::World;
use super::geometry::{Element, Geometry};
use super::triangles::{Packet, PacketHits, WalkRay};
use super::walk::{Leaves, Visit, WalkGroup, Walks};
use crate::rays::Ray;

/// A ray and the question put to the world about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayQuery {
    /// The caller's number of the ray.
    pub number: usize,
    pub ray: Ray,
    /// How far it goes, mm.
    pub reach_mm: f32,
    pub result: QueryResult,
}

/// What a [`RayQuery`] asks for, and the answer to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum QueryResult {
    /// The nearest triangle that is solid where the ray meets it.
    Nearest(Option<Element>),
    /// Share of R, G, B that arrives: 0 behind anything solid, less than 1 behind veils and thin panes.
    Transmittance(Vec3),
}

impl RayQuery {
    /// A query for the nearest triangle.
    pub fn nearest(number: usize, ray: Ray) -> Self {
        Self {
            number,
            ray,
            reach_mm: f32::INFINITY,
            result: QueryResult::Nearest(None),
        }
    }

    /// The nearest triangle, if that was the question.
    pub fn nearest_element(&self) -> Option<Element> {
        match self.result {
            QueryResult::Nearest(element) => element,
            QueryResult::Transmittance(_) => None,
        }
    }

    /// A query for the share of light that arrives from a distance.
    pub fn transmittance(number: usize, ray: Ray, distance_mm: f32) -> Self {
        Self {
            number,
            ray,
            reach_mm: distance_mm,
            result: QueryResult::Transmittance(Vec3::ONE),
        }
    }
}

impl World {
    /// The nearest triangle that is solid where the ray meets it.
    pub(super) fn closest(&self, ray: &Ray, walks: &mut Walks) -> Option<Element> {
        let mut query = RayQuery::nearest(0, *ray);
        self.trace(std::slice::from_mut(&mut query), walks);
        query.nearest_element()
    }

    /// Answers all queries.
    #[inline(always)]
    pub(super) fn trace(&self, queries: &mut [RayQuery], walks: &mut Walks) {
        let Walks { outer, inner } = walks;
        outer.clear();
        for (i, query) in (0..).zip(queries.iter()) {
            let (origin, direction) = (query.ray.origin_mm, query.ray.direction);
            let ray = WalkRay::new(origin.as_vec3(), direction.as_vec3());
            outer.add(i, ray, query.reach_mm);
        }
        if let [placed] = self.stage.placed.as_slice()
            && placed.object_id.is_none()
        {
            let mut leaves = Packets {
                world: self,
                geometry: &self.stage.geometries[placed.geometry],
                slot: 0,
                queries,
                is_ended: false,
            };
            leaves.geometry.bvh.walk_all(outer, &mut leaves);
            return;
        }
        let mut leaves = Slots {
            world: self,
            queries,
            inner,
        };
        self.stage.bvh.walk_all(outer, &mut leaves);
    }
}

/// The triangles of a geometry.
struct Packets<'a> {
    world: &'a World,
    geometry: &'a Geometry,
    slot: u32,
    /// Of all rays.
    queries: &'a mut [RayQuery],
    /// Whether the last visit ended a walk.
    is_ended: bool,
}

impl Leaves for Packets<'_> {
    #[inline(always)]
    fn test(&self, ray: &WalkRay, t_max: f32, leaf: usize, items: u32) -> PacketHits {
        self.geometry.packets[leaf].intersect(ray, t_max, items)
    }

    #[inline(always)]
    fn visit(&mut self, visit: Visit<'_>, found: &PacketHits) -> bool {
        let query = &mut self.queries[visit.number];
        self.is_ended = self.world.meet(self.slot, query, visit, found);
        self.is_ended
    }

    #[inline(always)]
    fn memory(&self) -> (*const u8, usize) {
        (self.geometry.packets.as_ptr().cast(), size_of::<Packet>())
    }
}

/// Geometries where they stand, each with a tree of its own.
struct Slots<'a> {
    world: &'a World,
    queries: &'a mut [RayQuery],
    /// The way through a geometry's tree.
    inner: &'a mut WalkGroup,
}

impl Leaves for Slots<'_> {
    /// What is met only a walk through their trees tells.
    fn test(&self, _ray: &WalkRay, _t_max: f32, _leaf: usize, _items: u32) -> PacketHits {
        PacketHits::SOME
    }

    fn visit(&mut self, v: Visit<'_>, _found: &PacketHits) -> bool {
        let stage = &self.world.stage;
        let slots = &stage.slots[v.leaf][..v.items as usize];
        slots.iter().any(|&slot| {
            let placed = &stage.placed[slot as usize];
            let query = &mut self.queries[v.number..=v.number];
            let (origin, direction) = (query[0].ray.origin_mm, query[0].ray.direction);
            let mesh = &placed.mesh_from_camera;
            let ray = match placed.object_id {
                None => *v.ray,
                Some(_) => WalkRay::new(
                    mesh.transform_point3(origin.as_vec3()),
                    mesh.transform_vector3(direction.as_vec3()),
                ),
            };
            self.inner.clear();
            self.inner.add(0, ray, *v.t_max);
            let mut leaves = Packets {
                world: self.world,
                geometry: &stage.geometries[placed.geometry],
                slot,
                queries: query,
                is_ended: false,
            };
            leaves.geometry.bvh.walk_all(self.inner, &mut leaves);
            *v.t_max = self.inner.first_t_max();
            leaves.is_ended
        })
    }

    #[inline(always)]
    fn memory(&self) -> (*const u8, usize) {
        (
            self.world.stage.slots.as_ptr().cast(),
            size_of::<[u32; 4]>(),
        )
    }
}

impl World {
    /// What the triangles that a ray meets mean for its query; true if its answer is final.
    #[inline(always)]
    fn meet(&self, slot: u32, query: &mut RayQuery, visit: Visit<'_>, hits: &PacketHits) -> bool {
        let mut mask = hits.mask;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if hits.t[lane] >= *visit.t_max {
                continue;
            }
            let element = Element {
                placed: slot,
                packet: visit.leaf as u32,
                lane: lane as u8,
            };
            if self.is_masked(element) && !self.is_solid(element, &query.ray) {
                continue;
            }
            match &mut query.result {
                QueryResult::Nearest(nearest) => {
                    *visit.t_max = hits.t[lane];
                    *nearest = Some(element);
                }
                QueryResult::Transmittance(share) => {
                    *share *= match self.has_veils {
                        true => self.passes(element, &query.ray),
                        false => Vec3::ZERO,
                    };
                    if *share == Vec3::ZERO {
                        return true;
                    }
                }
            }
        }
        false
    }
}
