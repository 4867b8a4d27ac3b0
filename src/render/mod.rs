//! Scene + lens + sensor + response → sub-pixel image, with its truth.
//!
//! Irradiance of sub-pixel `id` of a pixel, per unit radiance:
//!
//! ```text
//! E_id = ⟨ ∫ L(x, d) P_id(d; shift, λ) cos θ dω ⟩  over x in the pixel
//!      ≈ A/N Σ_k L_k P_id(u_k, v_k) Δz²/ℓ_k⁴            (dω cos θ = cos²θ/ℓ² dA, cos θ = Δz/ℓ)
//! ```
//!
//! over N rays from points of the pixel to points of an ellipse of area A in the plane of the exit pupil, Δz in front
//! of the sensor, ℓ away. Each ray is traced once and splatted on all sub-pixels of its pixel, weighted by their
//! response. The classic mode is the same estimator with the geometric response. A ray has a wavelength λ of its
//! channel's band, at which the lens bends it and the pixel absorbs it ([`crate::spectrum`]).

mod aiming;
mod blur_rays;
mod camera;
mod colours;
mod control;
mod diffraction;
mod disparity_curve;
mod disparity_ratio;
mod estimator;
mod far;
mod footprints;
mod ghosts;
mod image;
pub mod kernels;
mod lamp_rays;
mod lens_maps;
mod look;
mod matching_curve;
mod occlusion;
mod pixel_aim;
mod probe;
mod record;
mod run;
mod splat;
mod stats;
mod tracer;
pub mod truth;
mod workspace;

pub use blur_rays::blur_rays;
pub use camera::{Camera, CameraError};
pub use control::LEAST_RAYS_PER_SUBPIXEL;
pub use disparity_curve::{LUMINANCE, disparity_curves};
pub use disparity_ratio::{disparity_ratio, disparity_ratio_in};
pub use footprints::Footprints;
pub use ghosts::{GhostBlocks, GhostLook, ghost_blocks};
pub use image::SubPixelImage;
pub use lens_maps::{LensMaps, LensTracing};
pub use matching_curve::matching_curves;
pub use probe::probe;
pub use record::{RayRecord, RecordError};
pub use run::{Render, Rendered, render};
pub use stats::{LostRays, RenderStats, SamplingErrors};

/// What changes the answer, recorded with it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderSettings {
    /// Rays per pixel (microlens) and colour channel; each is splatted on all sub-pixels. Powers of two are best.
    pub rays_per_pixel: usize,
    /// Key of the samples.
    pub seed: u64,
}

/// What must not change the answer, and is not recorded.
#[derive(Clone, Copy, Debug)]
pub struct Execution {
    /// Instructions of the lens tracer.
    pub simd: crate::simd::SimdLevel,
}

impl Default for Execution {
    fn default() -> Self {
        Self {
            simd: crate::simd::SimdLevel::detect(),
        }
    }
}
