//! How a sample's rays went through the main lens.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the rays of the image went through the main lens. Those of truth and target are always traced surface by
/// surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensTracing {
    /// How.
    pub method: LensMethod,
    /// How far maps were allowed to err; `null` where none were made.
    pub bound: Option<MapError>,
    /// The maps; `null` where the lens was traced surface by surface.
    pub map: Option<LensMap>,
    /// Why there are none although they were asked for; else `null`.
    pub failure: Option<String>,
    /// Part of the image's rays that was traced surface by surface: with maps, those next to the edge of the pupil.
    pub exact_share: f64,
}

/// How rays go through the main lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LensMethod {
    /// Surface by surface, as was asked for.
    Exact,
    /// By maps: polynomials over the pupil, fitted to rays traced surface by surface.
    Map,
    /// Surface by surface: so few rays are traced sooner than a map is made.
    TooFewRays,
    /// Surface by surface: no map of this lens and window meets the bound.
    NotMapped,
}

/// Error of a ray's place in the scene, referred to the sensor, at any depth from half of that in focus.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapError {
    /// Root mean square, px.
    pub rms_px: f64,
    /// Largest, px.
    pub worst_px: f64,
}

/// The maps of a sample's lens: of each number that of the wavelength where it is largest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensMap {
    /// Total degree of the polynomials over the pupil.
    pub degree: u32,
    /// Places along the window's width and height between which they are interpolated.
    pub nodes: [u32; 2],
    /// Part of the window, the worst wavelength's, where the bound is not met and all rays are traced surface by
    /// surface.
    pub unmapped_share: f64,
    /// Elsewhere, measured with rays that took no part in the fit.
    pub error: MapError,
}
