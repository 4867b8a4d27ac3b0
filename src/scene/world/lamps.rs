//! The shining bodies of a world, as balls around them: what a camera may look at on purpose.

use std::collections::BTreeMap;

use glam::DVec3;

use super::geometry::{Element, Stage};
use super::lights::{Lights, Shining};

/// A body that shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Middle, camera frame, mm.
    pub centre_mm: DVec3,
    /// Of a ball that holds all that shines, mm.
    pub radius_mm: f64,
}

/// So many are found, the most powerful ones.
const MOST: usize = 256;

/// What shines of each mesh where it stands, in falling order of power.
pub(super) fn lamps(stage: &Stage, lights: &Lights) -> Vec<Lamp> {
    let mut bodies: BTreeMap<(u32, u32), (f64, Vec<Element>)> = BTreeMap::new();
    for &Shining { element, power, .. } in &lights.triangles {
        let geometry = &stage.geometries[stage.placed[element.placed as usize].geometry];
        let part = geometry.packets[element.packet as usize].parts[usize::from(element.lane)];
        let (sum, elements) = bodies.entry((element.placed, part)).or_default();
        *sum += power;
        elements.push(element);
    }
    let mut bodies: Vec<(f64, Vec<Element>)> = bodies.into_values().collect();
    bodies.sort_by(|a, b| b.0.total_cmp(&a.0));
    let strongest = bodies.iter().take(MOST);
    strongest
        .map(|(_, elements)| ball(stage, elements))
        .collect()
}

/// Around the middle of the box of all corners.
fn ball(stage: &Stage, elements: &[Element]) -> Lamp {
    let corners = || {
        elements.iter().flat_map(|element| {
            let placed = &stage.placed[element.placed as usize];
            let geometry = &stage.geometries[placed.geometry];
            let packet = &geometry.packets[element.packet as usize];
            let corners = packet.corners(usize::from(element.lane));
            corners.map(|p| placed.camera_from_mesh.transform_point3(p.as_dvec3()))
        })
    };
    let least = corners().fold(DVec3::INFINITY, DVec3::min);
    let greatest = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let centre_mm = 0.5 * (least + greatest);
    Lamp {
        centre_mm,
        radius_mm: corners().fold(0.0, |radius, p| radius.max(p.distance(centre_mm))),
    }
}
