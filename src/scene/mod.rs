//! The scene: what a ray from the lens meets, and the radiance that comes back along it.
//!
//! Camera frame, mm (see [`crate::frames`]): the scene is at z < 0. For now it is made of flat emitting cards in front of a
//! uniform environment; each card's radiance is its texture, the same in all directions (a Lambertian chart under even
//! light).

mod cards;
mod mip;
mod plane;

pub mod coverage;
pub mod import;
pub mod texture;
pub mod world;

pub use cards::{Hits, NO_SURFACE, RaySlices, Scene};
pub use plane::{PlaneError, TexturedPlane};
