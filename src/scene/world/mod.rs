//! A world of triangle meshes, materials and lights, whose radiance is found by following paths of light.

mod check;
mod description;
mod texture_map;

pub use check::{WorldError, WorldWarnings};
pub use description::{
    Alpha, Environment, Instance, Light, Material, MaterialIndices, NormalMap, TextureRef,
    TriangleMesh, WorldDescription,
};
pub use texture_map::{Encoding, TextureMap, Wrap};

/// A checked world, ready for rays.
#[derive(Clone, Debug)]
pub struct World {
    warnings: WorldWarnings,
}

impl World {
    /// Checks a description and prepares it for rays.
    ///
    /// # Errors
    /// An index out of range, a number outside what its field allows, lists of unequal length. Triangles and vertices that are only
    /// bad in themselves are left out or mended, and counted ([`World::warnings`]).
    pub fn new(description: WorldDescription) -> Result<Self, WorldError> {
        check::check(&description)?;
        Ok(Self {
            warnings: WorldWarnings::default(),
        })
    }

    /// What was left out or mended.
    pub fn warnings(&self) -> WorldWarnings {
        self.warnings
    }
}
