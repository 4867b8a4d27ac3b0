//! What a render did: rays, lost rays by cause, spread of the estimate.

use std::f64::consts::FRAC_1_SQRT_2;

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
    /// Those of them that went through the lens surface by surface; the others were mapped.
    #[serde(default)]
    pub exact_rays: u64,
    /// Those of them that were lost.
    pub lost: LostRays,
    /// What sampling leaves, from pixels rendered twice with independent samples. `None` when the image is black.
    pub errors: Option<SamplingErrors>,
}

/// Errors of sub-pixel values that sampling leaves; of two renders a and b of a value the error is |a − b|/√2.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SamplingErrors {
    /// Root mean square of the error, over the mean value.
    pub rms_over_mean: f64,
    /// Median over the lit values of error over value, (a + b)/2.
    pub median_relative: f64,
    /// Part of the lit values with |a − b| above half the value.
    pub speckle_share: f64,
}

/// Part of its value by which a speckle differs in a second render.
const SPECKLE: f32 = 0.5;

/// Running sums of a render.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub rays: u64,
    pub exact_rays: u64,
    pub lost: LostRays,
    /// Sum of squared differences of pairs, and their number.
    pub squared_difference: f64,
    pub pairs: u64,
    /// |a − b|/((a + b)/2) of the lit pairs.
    pub relative_differences: Vec<f32>,
}

impl Tally {
    /// The figures of the render that gave `mosaic`.
    pub fn stats(&self, mosaic: &[f32]) -> RenderStats {
        let mean = mosaic.iter().map(|&x| f64::from(x)).sum::<f64>() / mosaic.len() as f64;
        let errors = (mean > 0.0 && !self.relative_differences.is_empty()).then(|| {
            let mut sorted = self.relative_differences.clone();
            sorted.sort_by(f32::total_cmp);
            let speckles = sorted.len() - sorted.partition_point(|&d| d <= SPECKLE);
            SamplingErrors {
                rms_over_mean: (self.squared_difference / (2.0 * self.pairs as f64)).sqrt() / mean,
                median_relative: f64::from(sorted[sorted.len() / 2]) * FRAC_1_SQRT_2,
                speckle_share: speckles as f64 / sorted.len() as f64,
            }
        });
        RenderStats {
            rays: self.rays,
            exact_rays: self.exact_rays,
            lost: self.lost,
            errors,
        }
    }

    /// Counts a value that was rendered twice.
    pub fn count_pair(&mut self, a: f64, b: f64) {
        self.squared_difference += (a - b) * (a - b);
        self.pairs += 1;
        if a + b > 0.0 {
            let relative = (a - b).abs() / (0.5 * (a + b));
            self.relative_differences.push(relative as f32);
        }
    }

    /// Both together.
    pub fn merge(mut self, other: Self) -> Self {
        self.relative_differences.extend(other.relative_differences);
        Self {
            rays: self.rays + other.rays,
            exact_rays: self.exact_rays + other.exact_rays,
            lost: LostRays {
                vignetted: self.lost.vignetted + other.lost.vignetted,
                missed: self.lost.missed + other.lost.missed,
                total_internal_reflection: self.lost.total_internal_reflection
                    + other.lost.total_internal_reflection,
            },
            squared_difference: self.squared_difference + other.squared_difference,
            pairs: self.pairs + other.pairs,
            relative_differences: self.relative_differences,
        }
    }
}
