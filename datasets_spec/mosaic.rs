//! The colour-filter mosaic's part of `meta.json`: one colour per microlens, so that all sub-pixels below it have the
//! same.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How `mosaic.png` and `noisy_mosaic.png` came about (SPEC.md, "Mosaic").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mosaic {
    /// Colours of the microlenses.
    pub pattern: MosaicPattern,
    /// Levels of `mosaic.png`: those of `raw.png`.
    pub clean: CodeLevels,
    /// Levels of `noisy_mosaic.png`: the readout's black level and its largest code; absent without a readout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noisy: Option<CodeLevels>,
}

/// Black and white of integer codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CodeLevels {
    /// Code of no light.
    pub black_level: u16,
    /// Code of the brightest light.
    pub white_level: u16,
}

/// Colours of 2 × 2 microlenses, row by row, that repeat from the window's upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MosaicPattern {
    /// R G over G B; with 2 × 2 sub-pixels a quad-Bayer sensor.
    Rggb,
}

impl MosaicPattern {
    /// The channel (0: R, 1: G, 2: B) of the microlens in a column and row of the window.
    pub fn channel(self, column: usize, row: usize) -> usize {
        let Self::Rggb = self;
        column % 2 + row % 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rggb_is_r_g_over_g_b() {
        let channel = |x, y| MosaicPattern::Rggb.channel(x, y);
        let square = [channel(0, 0), channel(1, 0), channel(0, 1), channel(1, 1)];
        assert_eq!(square, [0, 1, 1, 2]);
        assert_eq!((channel(6, 4), channel(7, 5)), (0, 2));
    }
}
