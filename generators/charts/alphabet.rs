//! Tiles of running alphabet text, as the paper's "abcd" chart (Fig. 9c): letters are less artificial than straight
//! lines.
//!
//! Each tile has its own tint, contrast, letter size, turn and polarity (dark on light, or the inverse).

use super::error::{ChartError, side, within};
use super::keyed::Key;
use super::lettering::{Letter, Lettering, Placement};
use super::paint::canvas;
use quadpixel::scene::texture::Texture;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const NAME: &str = "alphabet";

/// Parameters of the `alphabet` chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Alphabet {
    /// Tiles along a side, 1..=64; default 6.
    pub tiles: u32,
    /// Lines of text in a tile before its own size factor (0.7..1.5), 1..=32; default 4.
    pub lines: u32,
    /// Largest turn of a tile's text to either side, degrees, 0..=180; default 15.
    pub rotation_deg: f64,
    /// Strength of the colours, 0 (grey) ..=1; default 0.5.
    pub tint: f64,
    /// Share of tiles with light letters on dark, 0..=1; default 0.4.
    pub inverse: f64,
    /// Least difference of reflectance between letters and ground, 0.05..=0.85; default 0.4.
    pub least_contrast: f64,
}

impl Default for Alphabet {
    fn default() -> Self {
        Self {
            tiles: 6,
            lines: 4,
            rotation_deg: 15.0,
            tint: 0.5,
            inverse: 0.4,
            least_contrast: 0.4,
        }
    }
}

/// One tile, ready to paint: box in whole texels, colours, letters.
struct Tile {
    bounds: [f32; 4],
    ground: [f32; 3],
    ink: [f32; 3],
    letters: Vec<Letter>,
}

impl Alphabet {
    pub(super) fn random(key: Key) -> Self {
        Self {
            tiles: key.whole(0, 3, 10),
            lines: key.whole(1, 2, 7),
            rotation_deg: key.range(2, 0.0, 45.0),
            tint: key.range(3, 0.0, 1.0),
            inverse: key.range(4, 0.0, 1.0),
            least_contrast: key.range(5, 0.15, 0.6),
        }
    }

    fn check(&self) -> Result<(), ChartError> {
        within(NAME, "tiles", self.tiles.into(), 1.0, 64.0)?;
        within(NAME, "lines", self.lines.into(), 1.0, 32.0)?;
        within(NAME, "rotation_deg", self.rotation_deg, 0.0, 180.0)?;
        within(NAME, "tint", self.tint, 0.0, 1.0)?;
        within(NAME, "inverse", self.inverse, 0.0, 1.0)?;
        within(NAME, "least_contrast", self.least_contrast, 0.05, 0.85)
    }

    pub(super) fn draw(&self, seed: u64, size_px: usize) -> Result<Texture, ChartError> {
        self.check()?;
        side(size_px)?;
        let lettering = Lettering::new().map_err(|e| ChartError::File {
            path: PathBuf::from("Roboto-Regular-ascii.ttf (bundled)"),
            reason: e.to_string(),
        })?;
        let key = Key::new(seed, NAME);
        let tiles: Vec<Tile> = (0..self.tiles * self.tiles)
            .into_par_iter()
            .map(|k| {
                self.tile(
                    key.with(k.into()),
                    &lettering,
                    k % self.tiles,
                    k / self.tiles,
                    size_px,
                )
            })
            .collect();
        canvas(size_px, [0.5; 3], |band| {
            for tile in &tiles {
                band.fill(tile.bounds, tile.ground, |_, _| 1.0);
                for letter in &tile.letters {
                    letter.paint(band, tile.bounds, tile.ink);
                }
            }
        })
    }

    fn tile(&self, key: Key, lettering: &Lettering, column: u32, row: u32, size_px: usize) -> Tile {
        let pitch = size_px as f64 / f64::from(self.tiles);
        let limit = |k: u32| (f64::from(k) * pitch).round() as f32;
        let bounds = [limit(column), limit(row), limit(column + 1), limit(row + 1)];

        let dark = key.range(0, 0.03, 0.9 - self.least_contrast);
        let light = key.range(1, dark + self.least_contrast, 0.95);
        let (dark, light) = (
            self.tinted(key.with(2), dark),
            self.tinted(key.with(3), light),
        );
        let (ground, ink) = if key.uniform(4) < self.inverse {
            (dark, light)
        } else {
            (light, dark)
        };

        // Line spacing is 1.25 em. Sizes are in units of the tile, so that the chart is the same at every raster size.
        let em = pitch / (1.25 * f64::from(self.lines)) * key.range(5, 0.7, 1.5);
        let angle = key.range(6, -1.0, 1.0) * self.rotation_deg.to_radians();
        let upper = key.uniform(7) < 0.25;
        let first = if upper { b'A' } else { b'a' };
        let (sin, cos) = angle.sin_cos();
        let middle = [
            (f64::from(column) + 0.5) * pitch,
            (f64::from(row) + 0.5) * pitch,
        ];
        // Text lines cover the tile's circumscribed circle.
        let reach = 0.5 * pitch * std::f64::consts::SQRT_2;
        let spacing = 1.25 * em;
        let lines = (2.0 * reach / spacing).ceil() as u64 + 1;
        let mut letters = Vec::new();
        let mut letter = key.whole(8, 0, 25) as u8;
        for line in 0..lines {
            let mut text = String::new();
            while f64::from(lettering.length_em(&text)) * em < 2.0 * reach {
                text.push(char::from(first + letter % 26));
                letter = (letter + 1) % 26;
                if letter == 0 {
                    text.push(' ');
                }
            }
            let down = -reach + (line as f64 + 0.5) * spacing;
            let origin = [
                (middle[0] - reach * cos - down * sin) as f32,
                (middle[1] - reach * sin + down * cos) as f32,
            ];
            let at = Placement {
                origin,
                em: em as f32,
                angle: angle as f32,
            };
            letters.extend(lettering.text(&text, at, bounds));
        }
        Tile {
            bounds,
            ground,
            ink,
            letters,
        }
    }

    /// A colour around the grey `tone`, within 0.02..=0.97.
    fn tinted(&self, key: Key, tone: f64) -> [f32; 3] {
        [0, 1, 2].map(|c| {
            let shift = self.tint * 0.5 * key.range(c, -1.0, 1.0) * tone.min(1.0 - tone).max(0.1);
            (tone + shift).clamp(0.02, 0.97) as f32
        })
    }
}
