//! A description, checked and made ready for rays: trees of triangles, materials, lights, the sky.

use glam::DVec3;

use super::check::{self, WorldWarnings};
use super::description::{Material, WorldDescription};
use super::geometry::{Element, Part, Placed};
use super::lamps::{Lamp, lamps};
use super::texture_map::TextureMap;
use super::traits::Traits;
use super::{environment, geometry, lights};
use crate::range::OutOfRange;

/// A checked world, ready for rays.
#[derive(Clone, Debug)]
pub struct World {
    pub(super) stage: geometry::Stage,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<TextureMap>,
    pub(super) lights: lights::Lights,
    lamps: Vec<Lamp>,
    pub(super) sky: environment::Sky,
    /// One per material.
    pub(super) traits: Vec<Traits>,
    /// Whether any material is a cut-out.
    pub(super) has_masks: bool,
    /// Whether no light comes from infinitely far along a ray.
    pub(super) is_dark_beyond: bool,
    /// Whether shadow rays may pass any material.
    pub(super) has_veils: bool,
    pub(super) warnings: WorldWarnings,
}

impl World {
    /// Checks a description and prepares it for rays.
    ///
    /// # Errors
    /// An index out of range, a number outside what its field allows, lists of unequal length. Triangles and vertices
    /// that are only bad in themselves are left out or mended, and counted ([`World::warnings`]).
    pub fn new(description: WorldDescription) -> Result<Self, OutOfRange> {
        check::check(&description)?;
        let mut warnings = WorldWarnings::default();
        let stage = geometry::Stage::new(&description, &mut warnings);
        let sky = environment::Sky::new(&description.environment);
        let traits: Vec<Traits> = description.materials.iter().map(Traits::new).collect();
        let lights = lights::Lights::new(&description, &stage, &sky);
        Ok(Self {
            lamps: lamps(&stage, &lights),
            is_dark_beyond: sky.is_dark() && !lights.suns.iter().any(lights::Sun::is_disc),
            lights,
            has_masks: traits.iter().any(|t| t.is_cut_out),
            has_veils: traits.iter().any(|t| t.lets_through),
            traits,
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
        let geometry = |p: &geometry::Placed| &self.stage.geometries[p.geometry];
        let triangles = |p| geometry(p).triangles.len();
        self.stage.placed.iter().map(triangles).sum()
    }

    /// Least and greatest corner of all triangles, camera frame, mm; `None` without any.
    pub fn bounds_mm(&self) -> Option<[DVec3; 2]> {
        let b = self.stage.bounds;
        (b.least.x <= b.greatest.x).then(|| [b.least.as_dvec3(), b.greatest.as_dvec3()])
    }

    /// What shines, instance by instance, in falling order of power: 256 at most.
    pub fn lamps(&self) -> &[Lamp] {
        &self.lamps
    }

    /// Suns with a disc: the direction towards each, and 1 − cos of half its angle.
    pub fn suns(&self) -> impl Iterator<Item = (DVec3, f64)> {
        let discs = self.lights.suns.iter().filter(|sun| sun.is_disc());
        discs.map(|sun| (sun.direction.as_dvec3(), f64::from(sun.rise)))
    }

    /// A triangle's material.
    #[inline]
    pub(super) fn material_of(&self, element: Element) -> usize {
        self.part_of(element).1.material as usize
    }

    /// The object of a triangle.
    pub(in crate::scene) fn object_of(&self, element: Element) -> u16 {
        let (placed, part) = self.part_of(element);
        placed.object_id.unwrap_or(part.object_id)
    }

    #[inline]
    fn part_of(&self, element: Element) -> (&Placed, &Part) {
        let placed = &self.stage.placed[element.placed as usize];
        let geometry = &self.stage.geometries[placed.geometry];
        let part = geometry.packets[element.packet as usize].parts[usize::from(element.lane)];
        (placed, &geometry.parts[part as usize])
    }

    /// Whether a triangle may have holes.
    #[inline]
    pub(super) fn is_masked(&self, element: Element) -> bool {
        self.has_masks && self.traits[self.material_of(element)].is_cut_out
    }
}
