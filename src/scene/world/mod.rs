//! A world of triangle meshes, materials and lights, whose radiance is found by following paths of light.
//!
//! ```text
//! WorldDescription ─ check ─▶ World: stage (trees of triangles) · materials · lights · sky
//! ray ─ trace ─▶ Element ─ surface ─▶ place ─ material ─▶ Bsdf ─ path ─▶ radiance
//!                                        light_sampling ───────┘
//! ```
//!
//! Places are f64, so that a depth is as exact as its vertices; the walk through the trees and all shading are f32,
//! whose rounding is far below the noise of the paths.

mod bsdf;
mod builder;
mod bvh;
mod camera_rays;
mod check;
mod crowd;
mod description;
mod environment;
mod facet;
mod fold;
mod found_light;
mod geometry;
mod lamps;
mod lanes;
mod light_bounds;
mod light_node;
mod light_sampling;
mod light_tree;
mod lights;
mod material;
mod microfacet;
mod pages;
mod patches;
mod path;
mod path_state;
mod prepared;
mod repeated;
mod sampler;
mod shapes;
mod surface;
mod texture_levels;
mod texture_map;
mod trace;
mod traits;
mod triangles;
mod walk;
mod walk_step;

#[cfg(test)]
mod tests;

pub use check::WorldWarnings;
pub use description::{
    Alpha, Environment, Instance, Light, Material, MaterialIndices, NormalMap, TextureRef,
    TriangleMesh, WorldDescription,
};
pub use lamps::Lamp;
pub use patches::{Patch, PatchHits, Patches};
pub use path::PathSettings;
pub use texture_map::{Encoding, TextureMap, Wrap};

pub use camera_rays::{CameraRay, FirstHit, PathKey};
pub use prepared::World;

pub(super) use geometry::Element;
pub(crate) use patches::surface_number;
pub(super) use path::PathWorkspace;
