//! The scene: what a ray from the lens meets, and the radiance that comes back along it.
//!
//! Camera frame, mm (see [`crate::frames`]): the scene is at z < 0. It is of one of two kinds: flat emitting cards in front of a uniform
//! environment, each card's radiance its texture, the same in all directions (a Lambertian chart under even light); or a
//! [`world`] of meshes, materials and lights.

mod cards;
mod kind;
mod mip;
mod plane;

pub mod coverage;
pub mod import;
pub mod texture;
pub mod world;

pub use kind::{Hits, NO_SURFACE, RaySlices, Scene};
pub use plane::TexturedPlane;
