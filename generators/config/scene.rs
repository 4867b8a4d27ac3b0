//! `[scene]`: charts on cards, worlds of meshes or pictures with depth.

use serde::{Deserialize, Serialize};

use super::error::ConfigError;
use super::number::{Draw, Range, Scale};
use super::rgbd::RgbdConfig;
use super::world::WorldConfig;
use crate::charts::{ChartSpec, is_image};

/// Scenes of flat cards. What a file leaves out is as in the default configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneConfig {
    /// Kinds of chart, or image files; one is drawn for each card, the background's in turn.
    pub charts: Vec<String>,
    /// Depth of the background as a multiple of the focused depth.
    pub background_over_focus: Draw,
    /// Tilt of the background about each axis, deg.
    pub tilt_deg: Draw,
    /// Number of cards in front of the background (rounded down).
    pub cards: Draw,
    /// Depth of a card as a multiple of the focused depth (at most 0.95 of the background's).
    pub card_over_focus: Draw,
    /// Side of a card as a fraction of the window's width.
    pub card_size: Draw,
    /// Side of every chart's texture, texels.
    pub texture_px: usize,
    /// Worlds of meshes in the place of cards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldConfig>,
    /// Pictures with depth in the place of cards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rgbd: Option<RgbdConfig>,
}

impl Default for SceneConfig {
    fn default() -> Self {
        let drawn = |min, max, scale| Draw::Range(Range { min, max, scale });
        Self {
            charts: ["alphabet", "dead-leaves", "resolution", "noise"]
                .map(str::to_owned)
                .to_vec(),
            background_over_focus: drawn(0.7, 4.0, Scale::Inverse),
            tilt_deg: drawn(-25.0, 25.0, Scale::default()),
            cards: drawn(0.0, 3.99, Scale::default()),
            card_over_focus: drawn(0.5, 1.6, Scale::Inverse),
            card_size: drawn(0.15, 0.5, Scale::default()),
            texture_px: 1024,
            world: None,
            rgbd: None,
        }
    }
}

impl SceneConfig {
    pub(super) fn check_charts(&self) -> Result<(), ConfigError> {
        let known = |name: &str| ChartSpec::KINDS.contains(&name) && name != "image";
        let mut unknown = self
            .charts
            .iter()
            .filter(|name| !known(name) && !is_image(name));
        match unknown.next() {
            None => Ok(()),
            Some(name) => {
                let kinds = ChartSpec::KINDS.join(", ");
                Err(ConfigError::Together(format!(
                    "scene.charts has `{name}`; allowed: {kinds} (image by the path of a PNG, JPEG or TIFF file)"
                )))
            }
        }
    }
}
