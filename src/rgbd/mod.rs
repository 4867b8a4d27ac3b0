//! A picture with depth, as a camera with parts of the pupil in its pixels sees it: kernels scattered front to back.
//!
//! Each pixel of the picture is where the sum of the sub-pixels shows a point of the scene at its depth (see
//! [`crate::render::truth`]). It is spread into every sub-pixel by a kernel ([`crate::render::kernels`]), interpolated
//! in field and in inverse depth. Layers of inverse depth are laid over each other from the front: what layer l gives
//! sub-pixel i of pixel q, and how far it covers it, is
//!
//! ```text
//! C_i,l(q) = Σ_p K_i(q − p; p, l) L(p) w_l(p) j_i(p),      A_i,l(q) = Σ_p K_i(q − p; p, l) w_l(p) j_i(p)
//! E_i = white_i · Σ_l C_i,l/A_i,l · t_i,l / Σ_l t_i,l,     t_i,l = min(A_i,l, 1 − Σ_k<l t_i,k)
//! ```
//!
//! A pixel between two layers belongs to both by w, so that centroids are linear in inverse depth and a slanted surface
//! has no seams: its layers' coverages sum to 1. j_i = 1 + ∂Δ_i/∂(1/D) · ∇(1/D) is by how much the slant stretches what
//! sub-pixel i sees. Behind depth edges the background goes on ([`Relief`]).
//!
//! Kernels that diffraction widens are spread in two parts: their core pixel by pixel, the halo around it (at most
//! 3 % of the light) from blocks of 4 × 4 pixels with the mean of the block's halos. Of white noise, the worst there
//! is, that errs by 0.25 % of the mean (root mean square); the kernels' rays by 0.4 %.
//!
//! That is [`Conversion::run`], or row by row [`Spread::rows`]. [`Conversion::trace`] renders the same relief as
//! surfaces of shining patches, ray by ray: exact where the above is of first order in the field and of layers in
//! depth, and slower.
//!
//! Pixels are done tile by tile; what a pixel gets does not depend on the tiles, the threads or the instructions.

mod add;
mod apart;
mod cell_kernels;
mod convert;
mod error;
mod halo;
mod levels;
mod picture;
mod relief;
mod spread;
mod surfaces;
mod tile;
mod traced;

pub use convert::{Conversion, Converted};
pub use error::RgbdError;
pub use levels::Levels;
pub use picture::DepthPicture;
pub use relief::Relief;
pub use spread::Spread;
