//! What a render did: rays, lost rays by cause, spread of the estimate.

use crate::rays::RayFailure;

/// Rays that did not reach the scene, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct LostRays {
    /// Stopped by an aperture: true vignetting and the margin of the aim.
    pub vignetted: u64,
    /// Passed beside a surface.
    pub missed: u64,
    /// Totally reflected.
    pub total_internal_reflection: u64,
}

impl LostRays {
    /// Counts one more.
    #[inline]
    pub fn count(&mut self, failure: RayFailure) {
        match failure {
            RayFailure::Vignetted { .. } => self.vignetted += 1,
            RayFailure::Missed { .. } => self.missed += 1,
            RayFailure::TotalInternalReflection { .. } => self.total_internal_reflection += 1,
        }
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.vignetted + self.missed + self.total_internal_reflection
    }
}

/// Figures of one render.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RenderStats {
    /// Rays traced through the lens (every channel's counts).
    pub rays: u64,
    /// Those of them that were lost.
    pub lost: LostRays,
    /// RMS error of a sub-pixel value that sampling leaves, as a fraction of the mean sub-pixel value: from pixels
    /// rendered twice with independent samples. `None` when the image is black.
    pub relative_spread: Option<f64>,
}

/// Running sums of a render.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub rays: u64,
    pub lost: LostRays,
    /// Sum of squared differences of pairs, and their number.
    pub squared_difference: f64,
    pub pairs: u64,
}

impl Tally {
    /// The figures of the render that gave `mosaic`.
    pub fn stats(&self, mosaic: &[f32]) -> RenderStats {
        let mean = mosaic.iter().map(|&x| f64::from(x)).sum::<f64>() / mosaic.len() as f64;
        let relative_spread = (mean > 0.0 && self.pairs > 0)
            .then(|| (self.squared_difference / (2.0 * self.pairs as f64)).sqrt() / mean);
        RenderStats {
            rays: self.rays,
            lost: self.lost,
            relative_spread,
        }
    }

    /// Both together.
    pub fn merge(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            lost: LostRays {
                vignetted: self.lost.vignetted + other.lost.vignetted,
                missed: self.lost.missed + other.lost.missed,
                total_internal_reflection: self.lost.total_internal_reflection
                    + other.lost.total_internal_reflection,
            },
            squared_difference: self.squared_difference + other.squared_difference,
            pairs: self.pairs + other.pairs,
        }
    }
}
