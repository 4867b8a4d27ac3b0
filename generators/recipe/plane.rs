//! The flat cards of a recipe.

use serde::{Deserialize, Serialize};

use super::short;
use crate::charts::{ChartSpec, Mask};

/// A flat card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneRecipe {
    /// What is printed on it; in a file also the name of its kind, or the path of an image.
    #[serde(deserialize_with = "short::chart")]
    pub chart: ChartSpec,
    /// Seed of the chart.
    #[serde(default)]
    pub chart_seed: u64,
    /// Side of the chart's texture, texels.
    #[serde(default = "texture_px")]
    pub texture_px: usize,
    /// Depth of its middle, mm from the first lens vertex.
    pub distance_mm: f64,
    /// Its place and size.
    #[serde(default)]
    pub extent: ExtentRecipe,
    /// Tilt about the horizontal axis, deg; positive: the upper edge goes away.
    #[serde(default)]
    pub tilt_x_deg: f64,
    /// Tilt about the vertical axis, deg; positive: the right edge goes away.
    #[serde(default)]
    pub tilt_y_deg: f64,
    /// Turn in its own plane, deg.
    #[serde(default)]
    pub roll_deg: f64,
    /// Shape that is cut from it; absent: the whole rectangle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cutout: Option<Cutout>,
}

/// A shape cut from a card.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cutout {
    /// Family of outlines.
    pub shape: Mask,
    /// Seed of its proportions.
    #[serde(default)]
    pub seed: u64,
}

fn texture_px() -> usize {
    1024
}

/// Place and size of a card.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "of")]
pub enum ExtentRecipe {
    /// Fills the window's field of view, with a margin for blur.
    #[default]
    Fill,
    /// In parts of the window: (0, 0) is its upper left corner as stored, (1, 1) its lower right one.
    Window {
        /// Centre, fraction of the window's width.
        x: f64,
        /// Centre, fraction of the window's height.
        y: f64,
        /// Side, as a fraction of the window's width.
        size: f64,
    },
    /// In mm in the camera frame.
    Mm {
        /// Centre: to the photographer's right.
        x_mm: f64,
        /// Centre: up.
        y_mm: f64,
        /// Width.
        width_mm: f64,
        /// Height.
        height_mm: f64,
    },
}
