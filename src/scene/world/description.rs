//! A world of meshes as plain data: what importers and generators fill in and [`World::new`](super::World::new) checks.
//!
//! Camera frame, mm ([`crate::frames`]): x right, y up, the scene at z < 0. Colours are linear RGB. Radiance is in the
//! unit of the finished image; where a length enters a light's strength it is the **metre** (`m` in a name), so that
//! numbers of glTF's punctual lights can be taken as they are.
//!
//! The material is glTF 2.0's metallic-roughness model, with its extensions for transmission, index and emissive
//! strength.

use std::sync::Arc;

use glam::{Affine2, DAffine3, DMat3, DVec3};

use super::TextureMap;
use crate::image::Image;

/// Everything in a world. Indices (`mesh`, `material`, `texture`) count from 0 within its lists.
#[derive(Clone, Debug, Default)]
pub struct WorldDescription {
    /// Shapes, each in a frame of its own.
    pub meshes: Vec<TriangleMesh>,
    /// Placed shapes. A mesh that no instance names is not part of the world.
    pub instances: Vec<Instance>,
    /// What surfaces do with light.
    pub materials: Vec<Material>,
    /// Pictures that materials name.
    pub textures: Vec<TextureMap>,
    /// Lights without a surface; surfaces that shine are materials with an emission.
    pub lights: Vec<Light>,
    /// What lies behind everything.
    pub environment: Environment,
}

/// Triangles over shared vertices. A triangle's front is the side from which its vertices run counter-clockwise.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// For messages.
    pub name: String,
    /// Vertices, mm in the mesh's frame (an instance's transform may hold any unit's factor).
    pub positions_mm: Vec<[f32; 3]>,
    /// A shading normal a vertex, of any length; without them the triangles are flat.
    pub normals: Option<Vec<[f32; 3]>>,
    /// A texture coordinate a vertex: u to the right, v **down**, one picture in 0..1 (as in glTF; OBJ's v runs up).
    pub uvs: Option<Vec<[f32; 2]>>,
    /// A linear colour and alpha a vertex, factors of those of the material, 0 to 1.
    pub colours: Option<Vec<[f32; 4]>>,
    /// Three vertex indices a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Which material each triangle has.
    pub materials: MaterialIndices,
}

/// The materials of a mesh's triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MaterialIndices {
    /// One for all.
    Mesh(usize),
    /// One a triangle, in their order.
    Triangles(Vec<u32>),
}

impl Default for MaterialIndices {
    fn default() -> Self {
        Self::Mesh(0)
    }
}

/// A mesh, placed.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Which mesh.
    pub mesh: usize,
    /// Its place; may turn, scale, shear and mirror.
    pub camera_from_mesh: DAffine3,
    /// What the truth's object map shows: 0 to 65534, shared by instances that are one object.
    pub object_id: u16,
}

/// A picture as a factor of a material's property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Which picture.
    pub texture: usize,
    /// Texture coordinate in the picture from the mesh's (glTF's `KHR_texture_transform`).
    pub uv_from_mesh: Affine2,
}

impl TextureRef {
    /// The picture by the mesh's own coordinates.
    pub fn new(texture: usize) -> Self {
        Self {
            texture,
            uv_from_mesh: Affine2::IDENTITY,
        }
    }
}

/// What a surface does with light (glTF 2.0, appendix B, made reciprocal and energy-conserving).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Diffuse reflectance of a non-metal, reflectance at normal incidence of a metal, tint of a transmitted ray at
    /// each crossing; 0 to 1.
    pub base_colour: [f32; 3],
    /// Factor of `base_colour` (RGB) and of `alpha` (A).
    pub base_colour_texture: Option<TextureRef>,
    /// 0 a non-metal, 1 a metal; between, a mixture.
    pub metallic: f32,
    /// 0 a mirror, 1 matt; the GGX width is its square. Below [`Material::SMOOTH_ROUGHNESS`] the reflection is a
    /// mirror's.
    pub roughness: f32,
    /// Factor of `roughness` (G) and of `metallic` (B).
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Index of refraction of a non-metal, 1 to 4; 1 has no reflection (a purely diffuse surface).
    pub ior: f32,
    /// Share of a non-metal's body that lets light through, clear and smooth, instead of scattering it diffusely: 1 is
    /// glass.
    pub transmission: f32,
    /// Whether what transmits is a thin sheet, which does not bend rays (glTF without `KHR_materials_volume`), or a
    /// solid body.
    pub thin_walled: bool,
    /// Radiance that it sends from its front, also from its back if `two_sided`.
    pub emission: [f32; 3],
    /// Factor of `emission`.
    pub emission_texture: Option<TextureRef>,
    /// Tangent-space normals (x along u, y against v: glTF's convention).
    pub normal_map: Option<NormalMap>,
    /// How solid it is.
    pub alpha: Alpha,
    /// Whether its back emits as its front. Both sides always reflect.
    pub two_sided: bool,
}

impl Material {
    /// Roughness below which reflection is a mirror's: the GGX lobe would be narrower than 0.06°.
    pub const SMOOTH_ROUGHNESS: f32 = 0.03;

    /// A diffuse surface without a gloss.
    pub fn diffuse(reflectance: [f32; 3]) -> Self {
        Self {
            base_colour: reflectance,
            ior: 1.0,
            ..Self::default()
        }
    }

    /// A black surface of the given radiance, from its front.
    pub fn emitter(radiance: [f32; 3]) -> Self {
        Self {
            emission: radiance,
            ..Self::diffuse([0.0; 3])
        }
    }

    /// A metal of this reflectance at normal incidence.
    pub fn metal(reflectance: [f32; 3], roughness: f32) -> Self {
        Self {
            base_colour: reflectance,
            metallic: 1.0,
            roughness,
            ..Self::default()
        }
    }

    /// Clear, smooth, solid glass.
    pub fn glass(ior: f32) -> Self {
        Self {
            roughness: 0.0,
            ior,
            transmission: 1.0,
            ..Self::default()
        }
    }
}

impl Default for Material {
    /// A white, matt non-metal of index 1.5 (glTF's defaults, except that `metallic` is 0).
    fn default() -> Self {
        Self {
            name: String::new(),
            base_colour: [1.0; 3],
            base_colour_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            ior: 1.5,
            transmission: 0.0,
            thin_walled: false,
            emission: [0.0; 3],
            emission_texture: None,
            normal_map: None,
            alpha: Alpha::Opaque,
            two_sided: false,
        }
    }
}

/// Bumps as a picture: RGB in 0..1 is (x, y, z) in −1..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The picture, which must be linear.
    pub texture: TextureRef,
    /// Factor of x and y.
    pub scale: f32,
}

/// How solid a surface is. `alpha` (0 to 1) is a factor of the alpha channel of the base colour's texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Everywhere.
    Opaque,
    /// A cut-out: solid where alpha is at least `cutoff`, else not there.
    Mask {
        /// Factor of the texture's alpha.
        alpha: f32,
        /// The threshold.
        cutoff: f32,
    },
    /// A veil: passes the share 1 − alpha straight on. For the truth it is there.
    Blend {
        /// Factor of the texture's alpha.
        alpha: f32,
    },
}

/// A light without a surface, seen by none but through what it lights.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A disc at infinity. With `half_angle_deg` > 0 it is visible.
    Sun {
        /// Where its light travels to, camera frame, of any length.
        direction: DVec3,
        /// Irradiance on a surface square to it, radiance × sr.
        irradiance: [f32; 3],
        /// Half its angle: 0 for parallel light, 0.266 for the Sun, less than 45.
        half_angle_deg: f64,
    },
    /// A point.
    Point {
        /// Where it is.
        position_mm: DVec3,
        /// Intensity in radiance × m²: a surface square to it at d metres gets the irradiance `intensity_m2 / d²`.
        intensity_m2: [f32; 3],
    },
    /// A point with a cone (glTF's `KHR_lights_punctual`).
    Spot {
        /// Where it is.
        position_mm: DVec3,
        /// The cone's axis, away from the light, of any length.
        direction: DVec3,
        /// Intensity within the inner cone, as of [`Light::Point`].
        intensity_m2: [f32; 3],
        /// Half angle of the inner cone, 0 to `outer_deg`.
        inner_deg: f64,
        /// Half angle at which the light has fallen to nothing, more than `inner_deg`, at most 90.
        outer_deg: f64,
    },
}

/// What lies behind everything.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere.
    Even([f32; 3]),
    /// A panorama.
    Map {
        /// Equirectangular radiance, 3 channels: the middle column is the map's −z, columns go on to its +x, row 0 is
        /// its +y.
        image: Arc<Image>,
        /// The map's place: a rotation.
        camera_from_map: DMat3,
        /// Factor of the radiance.
        scale: f32,
    },
}

impl Default for Environment {
    /// Darkness.
    fn default() -> Self {
        Self::Even([0.0; 3])
    }
}
