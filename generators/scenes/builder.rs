//! A world under construction: shapes with materials, put in place one object after the other.

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::scene::world::{
    Instance, Light, Material, MaterialIndices, TextureMap, TextureRef, TriangleMesh,
    WorldDescription,
};

use super::shape::Shape;

/// See the module.
#[derive(Default)]
pub(super) struct Builder {
    world: WorldDescription,
    objects: usize,
}

impl Builder {
    /// Adds a picture.
    pub fn picture(&mut self, map: TextureMap) -> TextureRef {
        self.world.textures.push(map);
        TextureRef::new(self.world.textures.len() - 1)
    }

    /// Adds a material.
    pub fn material(&mut self, material: Material) -> usize {
        self.world.materials.push(material);
        self.world.materials.len() - 1
    }

    /// Adds an object of parts (shape, material), all placed alike.
    pub fn object(&mut self, name: &str, parts: Vec<(Shape, usize)>, camera_from_object: DAffine3) {
        let object_id = self.objects.min(usize::from(u16::MAX) - 1) as u16;
        self.objects += 1;
        for (shape, material) in parts {
            self.world.instances.push(Instance {
                mesh: self.world.meshes.len(),
                camera_from_mesh: camera_from_object,
                object_id,
            });
            self.world.meshes.push(TriangleMesh {
                materials: MaterialIndices::Mesh(material),
                ..shape.into_mesh(name)
            });
        }
    }

    /// Adds a light without a surface.
    pub fn light(&mut self, light: Light) {
        self.world.lights.push(light);
    }

    /// The world.
    pub fn finished(self, environment: [f32; 3]) -> WorldDescription {
        WorldDescription {
            environment: quadpixel::scene::world::Environment::Even(environment),
            ..self.world
        }
    }
}

/// Object's place from a point, its up direction and a turn about it.
pub(super) fn standing(at: DVec3, up: DVec3, turn_rad: f64, scale: f64) -> DAffine3 {
    let z = (DVec3::Z - up * up.z).normalize_or(up.any_orthonormal_vector());
    let frame = DMat3::from_cols(up.cross(z), up, z);
    DAffine3::from_mat3_translation(
        frame * DMat3::from_rotation_y(turn_rad) * DMat3::from_diagonal(DVec3::splat(scale)),
        at,
    )
}
