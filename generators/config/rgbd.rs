//! Pictures with depth in a dataset.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{ConfigError, Draw, number};
use crate::rgbd::{Level, Meaning, Pair, Preset, pairs};

/// Pictures with depth; the samples take them in turn, and have their sizes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RgbdConfig {
    /// A published folder layout below `image`, in the place of `depth`; what its numbers mean comes with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// A picture, or a folder of pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<String>,
    /// Its depth, or a folder of depths of the same stems.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<String>,
    /// The same as a list, `[picture, depth]` each; folders become one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<[String; 2]>,
    /// What the numbers mean; a sidecar adds what is left open.
    #[serde(default)]
    pub meaning: Meaning,
    /// How they are converted: `psf` (absent) or `rays`, with `rays_per_pixel` rays.
    #[serde(default, skip_serializing_if = "Level::is_default")]
    pub level: Level,
    /// Focuses at the depth that this share of a picture's pixels are nearer than, in the place of `lens.focus_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_share: Option<Draw>,
}

impl RgbdConfig {
    /// Puts the pairs of the folders in the place of their names. Returns what has no other half, a line each.
    ///
    /// # Errors
    /// Folders without a pair, or that cannot be read.
    pub fn listed(&mut self) -> Result<Vec<String>, ConfigError> {
        let found = match (&self.image, &self.depth, self.preset) {
            (Some(root), None, Some(preset)) => preset.pairs(Path::new(root)),
            (Some(image), Some(depth), _) => pairs(Path::new(image), Path::new(depth)),
            _ => return Ok(Vec::new()),
        };
        let (found, alone) =
            found.map_err(|e| ConfigError::Together(format!("scene.rgbd: {e}")))?;
        self.pairs.extend(
            found.iter().map(|pair: &Pair| {
                [&pair.image, &pair.depth].map(|path| path.display().to_string())
            }),
        );
        if let Some(preset) = self.preset {
            self.meaning = std::mem::take(&mut self.meaning).or(preset.meaning());
        }
        (self.image, self.depth, self.preset) = (None, None, None);
        Ok(alone)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let together = |text: &str| Err(ConfigError::Together(text.to_owned()));
        let has_depth = self.depth.is_some() || self.preset.is_some();
        if self.image.is_some() != has_depth {
            return together(
                "scene.rgbd has one of image and depth; allowed: both, image and preset, or pairs",
            );
        }
        if self.depth.is_some() && self.preset.is_some() {
            return together(
                "scene.rgbd has depth and preset; allowed: one of them, as a preset says where the depths lie",
            );
        }
        if self.pairs.is_empty() && self.image.is_none() {
            return together("scene.rgbd has no picture; allowed: image and depth, or pairs");
        }
        if let Err(what) = self.meaning.check() {
            return Err(ConfigError::Together(format!("scene.rgbd.meaning.{what}")));
        }
        Ok(number::check(&[(
            "scene.rgbd.focus_share",
            self.focus_share,
            [0.0, 1.0],
        )])?)
    }
}
