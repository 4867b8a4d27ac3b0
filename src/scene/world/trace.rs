//! What rays meet: the nearest triangle, or how much light arrives along them.
//!
//! The walk works in f32; what it finds is computed again in f64 ([`super::surface`]), so that depths are exact to the
//! vertices' own rounding.

use glam::Vec3A as Vec3;

use super::World;
use super::geometry::{Element, Geometry};
use super::triangles::WalkRay;
use super::walk::{Visit, Walks, prefetch};
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
            let geometry = &self.stage.geometries[placed.geometry];
            let leaf = |v: Visit<'_>| {
                let query = &mut queries[v.number];
                self.meet_packet(geometry, 0, query, v)
            };
            geometry.bvh.walk_all(outer, leaf, |l| geometry.expect(l));
            return;
        }
        let leaf = |v: Visit<'_>| {
            let query = &mut queries[v.number];
            let slots = &self.stage.slots[v.leaf][..v.items as usize];
            slots.iter().any(|&slot| {
                let placed = &self.stage.placed[slot as usize];
                let ray = match placed.object_id {
                    None => *v.ray,
                    Some(_) => WalkRay::new(
                        (placed.mesh_from_camera).transform_point3(query.ray.origin_mm.as_vec3()),
                        (placed.mesh_from_camera).transform_vector3(query.ray.direction.as_vec3()),
                    ),
                };
                let geometry = &self.stage.geometries[placed.geometry];
                inner.clear();
                inner.add(0, ray, *v.t_max);
                let mut is_ended = false;
                let leaf = |v: Visit<'_>| {
                    is_ended = self.meet_packet(geometry, slot, query, v);
                    is_ended
                };
                geometry.bvh.walk_all(inner, leaf, |l| geometry.expect(l));
                *v.t_max = inner.first_t_max();
                is_ended
            })
        };
        self.stage.bvh.walk_all(outer, leaf, |_| ());
    }

    /// Tests a packet of triangles for an query; true if its answer is final.
    #[inline(always)]
    fn meet_packet(
        &self,
        geometry: &Geometry,
        slot: u32,
        query: &mut RayQuery,
        visit: Visit<'_>,
    ) -> bool {
        let packet = &geometry.packets[visit.leaf];
        let hits = packet.intersect(visit.ray, *visit.t_max, visit.items);
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

impl Geometry {
    /// A packet will be read soon.
    #[inline(always)]
    fn expect(&self, packet: usize) {
        if let Some(packet) = self.packets.get(packet) {
            prefetch(packet);
        }
    }
}
