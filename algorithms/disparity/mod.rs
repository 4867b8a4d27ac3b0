//! Sub-pixel block matching: how far each part of one view is shifted against another.
//!
//! ```text
//! A, B ─ plane ─▶ zero mean, unit deviation ─ search ─▶ whole pixels + summit ─ refine ─▶ shift, covariance, verdict
//!          └ halved (beyond 4 px) ─ search ─▶ guess ─┘
//! ```
//!
//! The model of a window is `a(x) = g·b(x + d) + o`: what lies at x in A lies at x + d in B; d in pixels, x to the
//! right, y down, gain g and offset o free in each window. Whole pixels come from the largest zero-mean normalised
//! cross-correlation (ZNCC), d from inverse-compositional Gauss–Newton (Baker & Matthews, IJCV 56, 221 (2004)) with the
//! exact Lanczos kernel (a = 4). It begins at the summit of the correlations, or where the node to the left ended.
//!
//! The covariance is `C = σ²(Σ∇a∇aᵀ)⁻¹` with σ² from the residual, which holds both images' noise; without noise models
//! of its own it tells which directions a window can measure. It knows nothing of systematic errors: up to 0.04 px
//! where B's point spread is wider by 1 px at half its maximum (σ 0.85 to 1.27 px; much the same as a further blur of
//! σ = 1 px), and 0.07 px where σ itself grows by 1 px; even out the blur first.
//!
//! # Cost
//!
//! The least that this algorithm needs a node, at stride 4, window 21 and ±4 px:
//!
//! | | operations |
//! |---|---|
//! | search: 81 shifts of 16 products, 34 sums | 4 050 |
//! | sampling, 28 + 21 rows of 21 samples, 15 operations each | 15 400 |
//! | its five sums with the reference, 11 operations per pixel | 4 900 |
//! | gradient and Hessian of a reference: 12 operations per pixel of 4 columns, sums of 21 columns | 1 200 |
//!
//! One sampling with its sums there (1.2 on average) and one back, and two references: 51 000 operations, 3.2 G/Mpx, or
//! 0.09 s/Mpx with 16 a clock (two AVX2 units, no fused multiply-add, as results must be the same everywhere) at 2.3
//! GHz. Memory: 2 pictures of 4 bytes per pixel in, and 8 planes (values, mean, norm, gradients of both) written and
//! read once: 72 MB/Mpx, 0.01 s/Mpx. So it is the refinement's arithmetic that counts, and what helps is to need fewer
//! samplings.

mod block_sums;
mod error;
mod geometry;
mod lanes;
mod matches;
mod matching;
mod peak;
mod phases;
mod plane;
mod prepared;
mod reference;
mod refine;
mod sampler;
mod search;
mod settings;
mod surfaces;
mod tile;

pub use error::MatchError;
pub use geometry::{Axes, Grid};
pub use matches::{DisparityMap, Match, Verdict};
pub use matching::match_images;
pub use settings::{DIRECT_SEARCH_PX, Limits, MatchSettings};
pub use surfaces::{ZnccSurfaces, zncc_surfaces};
