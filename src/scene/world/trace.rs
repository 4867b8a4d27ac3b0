//! What a ray meets: the nearest triangle, or how much of its light arrives.
//!
//! The walk works in f32; what it finds is computed again in f64 ([`super::surface`]), so that depths are exact to the vertices' own
//! rounding.

use glam::{DVec3, Vec3};

use super::World;
use super::bvh::Stack;
use super::description::Alpha;
use super::geometry::Placed;
use super::triangles::WalkRay;

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

impl World {
    /// The nearest triangle that is solid where the ray meets it.
    pub(super) fn closest(&self, ray: &Ray, stack: &mut Stack) -> Option<Element> {
        let mut nearest = None;
        self.visit(ray, f32::INFINITY, stack, |element, t, t_max| {
            if !self.is_masked(element) || self.is_solid(element, ray) {
                *t_max = t;
                nearest = Some(element);
            }
            false
        });
        nearest
    }

    /// Share of R, G, B that arrives over a distance: 0 behind anything solid, less than 1 behind veils and thin panes.
    pub(super) fn transmittance(&self, ray: &Ray, distance_mm: f32, stack: &mut Stack) -> Vec3 {
        let mut share = Vec3::ONE;
        self.visit(ray, distance_mm, stack, |element, _, _| {
            if self.is_masked(element) && !self.is_solid(element, ray) {
                return false;
            }
            share *= match self.has_veils {
                true => self.passes(element, ray),
                false => Vec3::ZERO,
            };
            share == Vec3::ZERO
        });
        share
    }

    /// Shows every triangle met before `t_max` to `found(element, t, t_max)`, which may lower `t_max` and ends the search by true.
    #[inline(always)]
    fn visit(
        &self,
        ray: &Ray,
        mut t_max: f32,
        stack: &mut Stack,
        mut found: impl FnMut(Element, f32, &mut f32) -> bool,
    ) {
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let outer = WalkRay::new(origin, direction);
        if let [placed] = self.stage.placed.as_slice()
            && placed.object_id.is_none()
        {
            self.visit_placed(0, placed, &outer, &mut t_max, stack, &mut found);
            return;
        }
        self.stage
            .bvh
            .walk(&outer, &mut t_max, stack, |leaf, items, t_max, stack| {
                let slots = &self.stage.slots[leaf as usize][..items as usize];
                slots.iter().any(|&slot| {
                    let placed = &self.stage.placed[slot as usize];
                    let inner = match placed.object_id {
                        None => outer,
                        Some(_) => WalkRay::new(
                            placed.mesh_from_camera.transform_point3(origin),
                            placed.mesh_from_camera.transform_vector3(direction),
                        ),
                    };
                    self.visit_placed(slot, placed, &inner, t_max, stack, &mut found)
                })
            });
    }

    #[inline(always)]
    fn visit_placed(
        &self,
        slot: u32,
        placed: &Placed,
        ray: &WalkRay,
        t_max: &mut f32,
        stack: &mut Stack,
        found: &mut impl FnMut(Element, f32, &mut f32) -> bool,
    ) -> bool {
        let geometry = &self.stage.geometries[placed.geometry];
        let mut ended = false;
        geometry
            .bvh
            .walk(ray, t_max, stack, |leaf, items, t_max, _| {
                let packet = &geometry.packets[leaf as usize];
                let hits = packet.intersect(ray, *t_max, items);
                let mut mask = hits.mask;
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let element = Element {
                        placed: slot,
                        packet: leaf,
                        lane: lane as u8,
                    };
                    if hits.t[lane] < *t_max && found(element, hits.t[lane], t_max) {
                        ended = true;
                        return true;
                    }
                }
                false
            });
        ended
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
