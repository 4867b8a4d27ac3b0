//! Which of a pixel's tables: preset, shifts, colour and exact model, in the words of `qpgen response`.

use quadpixel::em::mosaic::FilterColour;
use quadpixel::em::{Level, Preset};
use quadpixel_datasets::TableColour;
use serde::{Deserialize, Serialize};

/// Which table of a pixel, in the words of `qpgen response`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TableChoice {
    /// How finely its model computes.
    pub preset: Preset,
    /// Lens shifts per pitch of a table of all lens shifts; absent: the table of the centred lens, moved along with the
    /// lens.
    pub shifts: Option<usize>,
    /// Colour of the microlens, of a pixel in a mosaic of colour filters; absent: as the pixel says.
    pub colour: Option<TableColour>,
    /// Of a model that is corrected by an exact one, which; absent: the usual one.
    pub exact: Option<ExactModel>,
}

/// Which exact model corrects a faster one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactModel {
    /// The exact model.
    pub model: Level,
    /// How finely it computes.
    pub preset: Preset,
    /// How many directions of it the correction is fitted to.
    pub runs: usize,
}

impl TableChoice {
    /// Whether `qpgen response` would make it without a word more than model and pixel.
    pub fn is_usual(&self) -> bool {
        self.preset.is_standard() && self.shifts.is_none() && self.colour.is_none()
    }
}

/// The one colour, if it is one.
pub fn one_colour(colour: TableColour) -> Option<FilterColour> {
    match colour {
        TableColour::Red => Some(FilterColour::Red),
        TableColour::Green => Some(FilterColour::Green),
        TableColour::Blue => Some(FilterColour::Blue),
        TableColour::Bands => None,
    }
}
