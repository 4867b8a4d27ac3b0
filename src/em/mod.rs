//! The pixel as matter: its layers, their materials, and light in them.

mod builtin;
pub mod fdtd;
mod material;
pub mod mosaic;
pub mod multilayer;
pub mod rcwa;
mod stack;
pub mod wave;

pub use material::Material;
pub use stack::{Layer, MetalWalls, Microlens, PixelStack, StackError};
