//! A resolution chart in the manner of ISO 12233 (drawn anew): hyperbolic wedges, slanted squares, zone plates, line
//! blocks and labels.
//!
//! ```text
//! ▲ ╲  block ZONE block  ╱ ▲     Positions are shares of the side, x right, y down.
//!    ╲      ◇  |  ◇     ╱        LW/PH = line widths per picture height (light and dark lines both count):
//!  block       |       block       f cycles per side = LW/PH / 2; a raster of N texels holds up to N LW/PH.
//!  ZONE   ────( )────  ZONE      A wedge has a fixed number of lines; its frequency grows along it.
//!  block       |       block     Lines beyond the raster's Nyquist limit are grey.
//!    ╱      ◇  |  ◇     ╲
//! ▲ ╱  block ZONE block  ╲ ▲
//! ```

mod parts;
mod pen;

use super::error::{ChartError, side, tones, within};
use super::keyed::Key;
use super::lettering::{Letter, Lettering};
use super::paint::canvas;
use super::stripes::random_tones;
use parts::{Block, blocks, wedges};
use pen::Pen;
use quadpixel::scene::texture::Texture;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const NAME: &str = "resolution";
/// Parameters of the `resolution` chart; it does not depend on the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Resolution {
    /// Highest frequency of wedges, zone plates and blocks in line widths per picture height, 400..=8000; default 2000.
    pub highest_lw_ph: f64,
    /// Turn of the slanted squares, degrees, −45..=45; default 5.
    pub slant_deg: f64,
    /// Reflectance of the ink, 0..=1; default 0.04.
    pub dark: f64,
    /// Reflectance of the paper, 0..=1; default 0.85.
    pub light: f64,
}

impl Default for Resolution {
    fn default() -> Self {
        Self {
            highest_lw_ph: 2000.0,
            slant_deg: 5.0,
            dark: 0.04,
            light: 0.85,
        }
    }
}

impl Resolution {
    pub(super) fn random(key: Key) -> Self {
        let [dark, light] = random_tones(key);
        Self {
            highest_lw_ph: key.range(2, 1000.0, 4000.0),
            slant_deg: key.range(3, 2.0, 10.0),
            dark,
            light,
        }
    }

    pub(super) fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        tones(NAME, self.dark, self.light)?;
        within(NAME, "highest_lw_ph", self.highest_lw_ph, 400.0, 8000.0)?;
        within(NAME, "slant_deg", self.slant_deg, -45.0, 45.0)?;
        side(size_px)?;
        let lettering = Lettering::new().map_err(|e| ChartError::File {
            path: PathBuf::from("Roboto-Regular-ascii.ttf (bundled)"),
            reason: e.to_string(),
        })?;
        let size = size_px as f32;
        let highest = self.highest_lw_ph as f32;
        let wedges = wedges();
        let blocks = blocks(highest);
        let labels = wedges
            .iter()
            .flat_map(|w| w.labels(highest))
            .chain(blocks.iter().map(Block::label));
        let letters: Vec<Letter> = labels.flat_map(|l| l.letters(&lettering, size)).collect();
        canvas(size_px, [self.light as f32], |band| {
            let mut pen = Pen {
                band,
                size,
                dark: self.dark as f32,
            };
            pen.frame();
            for wedge in &wedges {
                pen.wedge(wedge, highest);
            }
            for block in &blocks {
                pen.block(block);
            }
            for centre in [[0.5, 0.13], [0.5, 0.87], [0.13, 0.5], [0.87, 0.5]] {
                pen.zone_plate(centre, 0.075, highest);
            }
            pen.zone_plate([0.5, 0.5], 0.032, 0.5 * highest);
            for centre in [
                [0.385, 0.385],
                [0.615, 0.385],
                [0.385, 0.615],
                [0.615, 0.615],
            ] {
                pen.square(centre, 0.07, self.slant_deg.to_radians() as f32);
            }
            for letter in &letters {
                letter.paint(pen.band, [0.0, 0.0, size, size], [self.dark as f32]);
            }
        })
    }
}
