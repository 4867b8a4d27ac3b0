//! What the camera looks at.
pub mod color;
pub mod coverage;
mod mip;
pub mod texture;
