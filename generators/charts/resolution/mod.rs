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

mod pen;

use super::error::{ChartError, side, tones, within};
use super::keyed::Key;
use super::lettering::{Letter, Lettering, Placement};
use super::paint::canvas;
use super::stripes::random_tones;
use pen::Pen;
use quadpixel::scene::texture::Texture;
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::PathBuf;

const NAME: &str = "resolution";
/// LW/PH at the wide end of the wedges and at the first line block.
const LEAST_LW_PH: f32 = 200.0;

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

/// A label: its text and its middle.
struct Label {
    text: String,
    middle: [f32; 2],
}

/// A wedge: the direction from the chart's middle along its lines (radians), and the distances from the middle (shares
/// of the side) of its wide end, `start`, and its narrow one, `end`.
struct Wedge {
    angle: f32,
    start: f32,
    end: f32,
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

/// Four wedges towards the middle, four from the corners.
fn wedges() -> Vec<Wedge> {
    let straight = (0u8..4).map(|k| Wedge {
        angle: FRAC_PI_2 * f32::from(k),
        start: 0.25,
        end: 0.05,
    });
    let diagonal = (0u8..4).map(|k| Wedge {
        angle: FRAC_PI_4 + FRAC_PI_2 * f32::from(k),
        start: 0.58,
        end: 0.34,
    });
    straight.chain(diagonal).collect()
}

impl Wedge {
    /// Light and dark stripe pairs across.
    const CYCLES: f32 = 5.0;

    /// Cycles a side at the share `along` (0 wide end, 1 narrow end).
    fn frequency(along: f32, highest_lw_ph: f32) -> f32 {
        0.5 * (LEAST_LW_PH + (highest_lw_ph - LEAST_LW_PH) * along)
    }

    /// Hundreds of LW/PH beside the lines, to a tenth.
    fn labels(&self, highest_lw_ph: f32) -> Vec<Label> {
        let (sin, cos) = self.angle.sin_cos();
        (0u8..=4)
            .map(|k| {
                let along = f32::from(k) / 4.0;
                let frequency = Self::frequency(along, highest_lw_ph);
                let r = self.start + (self.end - self.start) * along;
                let beside = 0.5 * Self::CYCLES / frequency + 0.016;
                Label {
                    text: format!("{}", (frequency / 5.0).round() / 10.0),
                    middle: [0.5 + r * cos - beside * sin, 0.5 + r * sin + beside * cos],
                }
            })
            .collect()
    }
}

/// Parallel lines of one frequency in a square.
struct Block {
    centre: [f32; 2],
    half: f32,
    lw_ph: f32,
    angle: f32,
}

/// Blocks of growing frequency on either side of the zone plates: upright above, level at the sides, diagonal below.
fn blocks(highest_lw_ph: f32) -> Vec<Block> {
    let mut blocks = Vec::new();
    for (k, along) in [0.29f32, 0.37, 0.63, 0.71].into_iter().enumerate() {
        for (line, across) in [0.085f32, 0.165].into_iter().enumerate() {
            let step = (2 * k + line) as f32 / 7.0;
            let lw_ph = LEAST_LW_PH * (highest_lw_ph / LEAST_LW_PH).powf(step);
            // Round to tens, so that the label is true.
            let lw_ph = (lw_ph / 10.0).round() * 10.0;
            for (centre, angle) in [
                ([along, across], 0.0),
                ([along, 1.0 - across], FRAC_PI_4),
                ([across, along], FRAC_PI_2),
                ([1.0 - across, along], -FRAC_PI_4),
            ] {
                blocks.push(Block {
                    centre,
                    half: 0.022,
                    lw_ph,
                    angle,
                });
            }
        }
    }
    blocks
}

impl Block {
    fn label(&self) -> Label {
        Label {
            text: format!("{:.0}", self.lw_ph),
            middle: [self.centre[0], self.centre[1] + self.half + 0.015],
        }
    }
}

impl Label {
    /// Em height as a share of the side.
    const EM: f32 = 0.014;

    fn letters(&self, lettering: &Lettering, size: f32) -> Vec<Letter> {
        let em = Self::EM * size;
        let half = 0.5 * em * lettering.length_em(&self.text);
        let at = Placement {
            // The digits' height is 0.71 em: centre them on the point.
            origin: [
                self.middle[0] * size - half,
                self.middle[1] * size + 0.355 * em,
            ],
            em,
            angle: 0.0,
        };
        lettering.text(&self.text, at, [0.0, 0.0, size, size])
    }
}
