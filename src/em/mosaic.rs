//! A mosaic of colour filters: the supercell of 2×2 microlenses that then repeats, each of one colour over all of its
//! sub-pixels (quad-Bayer for a quad pixel).
//!
//! ```text
//!      y ▲
//!        │  G   B        row 1            microlens = row · 2 + column: 0 red, 1 and 2 green, 3 blue
//!        │  R   G        row 0, y = 0     stored from row 0 (see crate::sensor): RGGB
//!        └──────────▶ x
//!      column 0   1                       the red microlens's centre is the origin, the others a pitch beyond
//! ```
//! Without a mosaic the period is one microlens: its neighbours wear its own filter, and light that crosses over to
//! them has passed no other (section 4 of Chataignier et al., Opt. Express 27, 30486 (2019), calls this the worst
//! case). A mosaic keeps the pixel's mirrors through the centres of microlenses, for the columns and rows on both sides
//! of one are alike; it breaks those through their borders, and for the two greens that of the diagonal.

use serde::{Deserialize, Serialize};

use super::Material;

/// Microlenses of the supercell.
pub const MICROLENSES: usize = 4;

/// Colour of a filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FilterColour {
    /// Red.
    Red,
    /// Green: two microlenses of the four.
    #[default]
    Green,
    /// Blue.
    Blue,
}

impl FilterColour {
    /// All colours.
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];
    /// By microlens of the supercell.
    pub const OF_MICROLENSES: [Self; MICROLENSES] =
        [Self::Red, Self::Green, Self::Green, Self::Blue];

    /// `red`, `green`, `blue`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

/// The filters of the colours that are not green; the green one is the filter layer's own material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mosaic {
    /// Red filter.
    pub red: Material,
    /// Blue filter.
    pub blue: Material,
    /// The microlens of the supercell that an angular response is of; green: the mean of both.
    #[serde(default)]
    pub colour: FilterColour,
}
