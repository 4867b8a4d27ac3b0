//! What to match, and when a match is too bad to be used.

use super::error::MatchError;
use super::geometry::Axes;

/// Largest search, in pixels, done at full resolution; beyond it the search goes from coarse to fine.
pub const DIRECT_SEARCH_PX: usize = 4;

/// What to match and what to trust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchSettings {
    /// Side of the square window in pixels: odd, 5 to 31; 15 to 31 is what the accuracy figures hold for.
    pub window_px: usize,
    /// Distance of the nodes in pixels, at least 1.
    pub stride_px: usize,
    /// Largest shift looked for on each free axis, in pixels: 1 to 1024.
    pub search_px: usize,
    /// Directions in which a shift is possible.
    pub axes: Axes,
    /// The refinement ends where the steps that it would still take are expected to sum to less than this, px: 1e-6 to
    /// 0.5. Steps shrink by some 0.05 each, measured at every window that takes two.
    pub last_step_px: f64,
    /// What is too bad to be used.
    pub limits: Limits,
}

impl Default for MatchSettings {
    fn default() -> Self {
        Self {
            window_px: 21,
            stride_px: 4,
            search_px: 4,
            axes: Axes::Both,
            last_step_px: 1e-3,
            limits: Limits::default(),
        }
    }
}

/// When a match is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest standard deviation (the worse principal axis), px.
    pub deviation_px: f64,
    /// Smallest ZNCC.
    pub zncc: f64,
    /// Largest ratio of the second peak of the ZNCC to the first.
    pub second_peak: f64,
    /// Largest disagreement of the match from A to B with that from B to A, px.
    pub forward_backward_px: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            deviation_px: 0.1,
            zncc: 0.5,
            second_peak: 0.9,
            forward_backward_px: 0.1,
        }
    }
}

/// That every setting is in its range.
pub(super) fn check(settings: &MatchSettings) -> Result<(), MatchError> {
    let setting = |name, value: f64, allowed| {
        Err(MatchError::Setting {
            name,
            value,
            allowed,
        })
    };
    let window = settings.window_px;
    if window.is_multiple_of(2) || !(5..=31).contains(&window) {
        return setting("window", window as f64, "an odd number from 5 to 31 px");
    }
    if !(1..=1024).contains(&settings.stride_px) {
        return setting("stride", settings.stride_px as f64, "1 to 1024 px");
    }
    if !(1..=1024).contains(&settings.search_px) {
        return setting("search", settings.search_px as f64, "1 to 1024 px");
    }
    if !(1e-6..=0.5).contains(&settings.last_step_px) {
        return setting("last step", settings.last_step_px, "1e-6 to 0.5 px");
    }
    for (name, value) in [
        ("largest deviation", settings.limits.deviation_px),
        ("smallest ZNCC", settings.limits.zncc),
        ("second peak", settings.limits.second_peak),
        ("forward-backward", settings.limits.forward_backward_px),
    ] {
        if value.is_nan() || value <= 0.0 {
            return setting(name, value, "a positive number");
        }
    }
    Ok(())
}
