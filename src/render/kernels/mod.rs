//! What each sub-pixel makes of a point of the scene: kernels over field, inverse depth, colour and sub-pixel.
//!
//! The ray that leaves the pixel at p through point k of the pupil meets depth D in the direction q_k(D) = q₀ + q₁/D
//! (see [`super::truth`]). The picture shows that point where the line of sight q̄ equals it, to first order at
//!
//! ```text
//! p + o_k(D),   o_k = J⁻¹ (q_k − q̄),   J = ∂q̄/∂p        (px; x right, y down as stored)
//! ```
//!
//! So a point of the picture at p is spread to p − o_k, weighted by what the ray is worth to the sub-pixel, P cos θ dω.
//! The kernel of a sub-pixel is the sum of its rays, each spread over pixels by a [`Footprint`]. Its centroid is the
//! sub-pixel's disparity, of the same rays as [`super::truth::DisparityField`]. Rays are traced once per field node and
//! wavelength: q is linear in 1/D, so that they serve every depth. Diffraction at the lens's aperture displaces them as
//! in a render, where the camera has it.

mod bank;
mod depth;
mod error;
mod footprint;
mod node;
mod support;
mod traced;

pub use bank::{BankPlan, KernelBank, LaneFigures};
pub use depth::DepthKernels;
pub use error::KernelError;
pub use footprint::Footprint;
pub use support::Support;
