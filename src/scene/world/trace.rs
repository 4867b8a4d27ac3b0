//! What rays meet: the nearest triangle, or how much light arrives along them.
//!
//! The walk works in f32; what it finds is computed again in f64 ([`super::surface`]), so that depths are exact to the vertices' own
//! rounding.

use glam::{DVec3, Vec3};

use super::World;
use super::description::Alpha;
use super::geometry::Geometry;
use super::triangles::WalkRay;
use super::walk::{Visit, Walk, Walks, prefetch};

/// A ray in the camera frame, mm, with a unit direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// A triangle of a placed geometry, by its lane in a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene) struct Element {
    pub placed: u32,
    pub packet: u32,
    pub lane: u8,
}

/// A ray and what is asked of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errand {
    /// Who asks.
    pub number: usize,
    pub ray: Ray,
    /// How far it goes, mm.
    pub reach_mm: f32,
    pub answer: Answer,
}

/// What an [`Errand`] asks for, and brings back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer {
    /// The nearest triangle that is solid where the ray meets it.
    Nearest(Option<Element>),
    /// Share of R, G, B that arrives: 0 behind anything solid, less than 1 behind veils and thin panes.
    Arriving(Vec3),
}

impl Errand {
    /// Asks for the nearest triangle.
    pub fn nearest(number: usize, ray: Ray) -> Self {
        Self {
            number,
            ray,
            reach_mm: f32::INFINITY,
            answer: Answer::Nearest(None),
        }
    }

    /// The triangle that was found, if that was asked.
    pub fn nearest_element(&self) -> Option<Element> {
        match self.answer {
            Answer::Nearest(element) => element,
            Answer::Arriving(_) => None,
        }
    }

    /// Asks what arrives from a distance.
    pub fn arriving(number: usize, ray: Ray, distance_mm: f32) -> Self {
        Self {
            number,
            ray,
            reach_mm: distance_mm,
            answer: Answer::Arriving(Vec3::ONE),
        }
    }
}

impl World {
    /// The nearest triangle that is solid where the ray meets it.
    pub(super) fn closest(&self, ray: &Ray, walks: &mut Walks) -> Option<Element> {
        let mut errand = Errand::nearest(0, *ray);
        self.run(std::slice::from_mut(&mut errand), walks);
        errand.nearest_element()
    }

    /// Answers all errands.
    pub(super) fn run(&self, errands: &mut [Errand], walks: &mut Walks) {
        let Walks { outer, inner } = walks;
        if outer.len() < errands.len() {
            outer.resize(errands.len(), Walk::default());
        }
        let outer = &mut outer[..errands.len()];
        for (i, (walk, errand)) in outer.iter_mut().zip(errands.iter()).enumerate() {
            let (origin, direction) = (errand.ray.origin, errand.ray.direction);
            let ray = WalkRay::new(origin.as_vec3(), direction.as_vec3());
            walk.start(i as u32, ray, errand.reach_mm);
        }
        if let [placed] = self.stage.placed.as_slice()
            && placed.object_id.is_none()
        {
            let geometry = &self.stage.geometries[placed.geometry];
            let leaf = |v: Visit<'_>| {
                let errand = &mut errands[v.number];
                self.meet_packet(geometry, 0, errand, v)
            };
            geometry.bvh.walk_all(outer, leaf, |l| geometry.expect(l));
            return;
        }
        let leaf = |v: Visit<'_>| {
            let errand = &mut errands[v.number];
            let slots = &self.stage.slots[v.leaf][..v.items as usize];
            slots.iter().any(|&slot| {
                let placed = &self.stage.placed[slot as usize];
                let ray = match placed.object_id {
                    None => *v.ray,
                    Some(_) => WalkRay::new(
                        (placed.mesh_from_camera).transform_point3(errand.ray.origin.as_vec3()),
                        (placed.mesh_from_camera).transform_vector3(errand.ray.direction.as_vec3()),
                    ),
                };
                let geometry = &self.stage.geometries[placed.geometry];
                inner.start(0, ray, *v.t_max);
                let mut is_ended = false;
                let leaf = |v: Visit<'_>| {
                    is_ended = self.meet_packet(geometry, slot, errand, v);
                    is_ended
                };
                let inner_walks = std::slice::from_mut(&mut *inner);
                geometry
                    .bvh
                    .walk_all(inner_walks, leaf, |l| geometry.expect(l));
                *v.t_max = inner.t_max;
                is_ended
            })
        };
        self.stage.bvh.walk_all(outer, leaf, |_| ());
    }

    /// Tests a packet of triangles for an errand; true if its answer is final.
    #[inline(always)]
    fn meet_packet(
        &self,
        geometry: &Geometry,
        slot: u32,
        errand: &mut Errand,
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
            if self.is_masked(element) && !self.is_solid(element, &errand.ray) {
                continue;
            }
            match &mut errand.answer {
                Answer::Nearest(nearest) => {
                    *visit.t_max = hits.t[lane];
                    *nearest = Some(element);
                }
                Answer::Arriving(share) => {
                    *share *= match self.has_veils {
                        true => self.passes(element, &errand.ray),
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

    #[inline]
    pub(super) fn material_of(&self, element: Element) -> usize {
        let placed = &self.stage.placed[element.placed as usize];
        let geometry = &self.stage.geometries[placed.geometry];
        let part = geometry.packets[element.packet as usize].parts[usize::from(element.lane)];
        geometry.parts[part as usize].material as usize
    }

    #[inline]
    fn is_masked(&self, element: Element) -> bool {
        self.has_masks
            && matches!(
                self.materials[self.material_of(element)].alpha,
                Alpha::Mask { .. }
            )
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
