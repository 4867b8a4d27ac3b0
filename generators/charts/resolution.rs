//! A resolution chart in the manner of ISO 12233 (drawn anew): hyperbolic wedges, slanted squares, zone plates, line blocks and labels.
//!
//! ```text
//! ▲ ╲  block ZONE block  ╱ ▲     Positions are shares of the side, x right, y down.
//!    ╲      ◇  |  ◇     ╱        LW/PH = line widths per picture height (light and dark lines both count):
//!  block       |       block       f cycles a side = LW/PH / 2; a raster of N texels holds up to N LW/PH.
//!  ZONE   ────( )────  ZONE      A wedge has a fixed number of lines; its frequency grows in proportion to the way along it.
//!  block       |       block     Lines beyond the raster's Nyquist limit are grey.
//!    ╱      ◇  |  ◇     ╲
//! ▲ ╱  block ZONE block  ╲ ▲
//! ```

use super::error::{ChartError, side, tones, within};
use super::keyed::Key;
use super::lettering::{Letter, Lettering, Placement};
use super::paint::{Band, canvas, edge_coverage, square_wave, strip};
use super::stripes::random_tones;
use quadpixel::scene::texture::Texture;
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
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

/// A band, and how shares of the side become texels and shares of ink reflectances.
struct Pen<'b, 'a> {
    band: &'b mut Band<'a, 1>,
    size: f32,
    dark: f32,
}

/// A label: its text, the middle of its base line, its turn.
struct Label {
    text: String,
    middle: [f32; 2],
    angle: f32,
}

/// A wedge: the middle of the chart's star it belongs to, the direction in which its lines run, from the wide end at `start` to the
/// narrow one at `end` (shares of the side along that direction, from the middle; `start` may lie beyond `end`).
struct Wedge {
    middle: [f32; 2],
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
        middle: [0.5, 0.5],
        angle: FRAC_PI_2 * f32::from(k),
        start: 0.25,
        end: 0.05,
    });
    let diagonal = (0u8..4).map(|k| Wedge {
        middle: [0.5, 0.5],
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

    /// Hundreds of LW/PH beside the lines.
    fn labels(&self, highest_lw_ph: f32) -> Vec<Label> {
        let (sin, cos) = self.angle.sin_cos();
        (0u8..=4)
            .map(|k| {
                let along = f32::from(k) / 4.0;
                let frequency = Self::frequency(along, highest_lw_ph);
                let r = self.start + (self.end - self.start) * along;
                let beside = 0.5 * Self::CYCLES / frequency + 0.016;
                Label {
                    text: format!("{:.0}", 2.0 * frequency / 100.0),
                    middle: [
                        self.middle[0] + r * cos - beside * sin,
                        self.middle[1] + r * sin + beside * cos,
                    ],
                    angle: 0.0,
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
            angle: 0.0,
        }
    }
}

impl Label {
    /// Em height as a share of the side.
    const EM: f32 = 0.014;

    fn letters(&self, lettering: &Lettering, size: f32) -> Vec<Letter> {
        let em = Self::EM * size;
        let half = 0.5 * em * lettering.length_em(&self.text);
        let (sin, cos) = self.angle.sin_cos();
        // The digits' height is 0.71 em: centre them on the point.
        let down = 0.355 * em;
        let at = Placement {
            origin: [
                self.middle[0] * size - half * cos - down * sin,
                self.middle[1] * size - half * sin + down * cos,
            ],
            em,
            angle: self.angle,
        };
        lettering.text(&self.text, at, [0.0, 0.0, size, size])
    }
}

impl Pen<'_, '_> {
    /// Inks the box [x0, y0, x1, y1] (shares of the side) by the coverage at a place in texels.
    fn ink(&mut self, bounds: [f32; 4], coverage: impl Fn(f32, f32) -> f32) {
        let bounds = bounds.map(|v| v * self.size);
        self.band.fill(bounds, [self.dark], coverage);
    }

    /// A line around the chart and three arrows a side whose tips touch the edge.
    fn frame(&mut self) {
        for (centre, half) in [
            ([0.5, 0.03], [0.4715, 0.0015]),
            ([0.5, 0.97], [0.4715, 0.0015]),
            ([0.03, 0.5], [0.0015, 0.4715]),
            ([0.97, 0.5], [0.0015, 0.4715]),
        ] {
            let (centre, half) = (centre.map(|v| v * self.size), half.map(|v| v * self.size));
            self.band.rectangle(centre, half, 0.0, [self.dark]);
        }
        for side in 0u8..4 {
            let (sin, cos) = (FRAC_PI_2 * f32::from(side)).sin_cos();
            for shift in [-0.25f32, 0.0, 0.25] {
                let tip = [0.5 + 0.5 * cos - shift * sin, 0.5 + 0.5 * sin + shift * cos];
                self.arrow(tip, [cos, sin]);
            }
        }
    }

    /// A triangle with its tip at `tip`, pointing along `to`, as high as the frame is wide.
    fn arrow(&mut self, tip: [f32; 2], to: [f32; 2]) {
        const HEIGHT: f32 = 0.028;
        // Sides at 30° to the axis.
        let (sin, cos) = (PI / 6.0).sin_cos();
        let size = self.size;
        let [x, y] = tip;
        self.ink([x - 0.03, y - 0.03, x + 0.03, y + 0.03], |px, py| {
            let (dx, dy) = (px - x * size, py - y * size);
            let back = -(dx * to[0] + dy * to[1]);
            let across = dy * to[0] - dx * to[1];
            let flank = |across: f32, n: [f32; 2]| edge_coverage(back * sin - across * cos, n);
            let n = [sin * to[0] - cos * to[1], sin * to[1] + cos * to[0]];
            let m = [sin * to[0] + cos * to[1], sin * to[1] - cos * to[0]];
            (flank(across, n) + flank(-across, m) - 1.0).max(0.0)
                * edge_coverage(HEIGHT * size - back, to)
        });
    }

    fn wedge(&mut self, wedge: &Wedge, highest_lw_ph: f32) {
        let (sin, cos) = wedge.angle.sin_cos();
        let [x, y] = wedge.middle;
        let size = self.size;
        let half_width = 0.5 * Wedge::CYCLES / Wedge::frequency(0.0, highest_lw_ph);
        let ends = [wedge.start, wedge.end];
        let reach_x = ends.map(|r| x + r * cos);
        let reach_y = ends.map(|r| y + r * sin);
        let margin = half_width + 2.0 / size;
        let bounds = [
            reach_x[0].min(reach_x[1]) - margin,
            reach_y[0].min(reach_y[1]) - margin,
            reach_x[0].max(reach_x[1]) + margin,
            reach_y[0].max(reach_y[1]) + margin,
        ];
        let (middle, half_length) = (
            0.5 * (wedge.start + wedge.end),
            0.5 * (wedge.start - wedge.end).abs(),
        );
        self.ink(bounds, |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let (r, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let along = ((r - wedge.start) / (wedge.end - wedge.start)).clamp(0.0, 1.0);
            let frequency = Wedge::frequency(along, highest_lw_ph);
            let (n, m) = ([-sin, cos], [cos, sin]);
            let inside = strip(across * size, 0.5 * Wedge::CYCLES / frequency * size, n)
                * strip((r - middle) * size, half_length * size, m);
            if inside <= 0.0 {
                return 0.0;
            }
            // Dark in the middle and at both rims: an odd number of half waves across.
            inside * square_wave(across * frequency, frequency / size, n)
        });
    }

    /// Rings whose frequency grows in proportion to the radius, to `highest_lw_ph` at the rim: phase = f r / 2.
    fn zone_plate(&mut self, centre: [f32; 2], radius: f32, highest_lw_ph: f32) {
        let [x, y] = centre;
        let size = self.size;
        let rim = 0.5 * highest_lw_ph;
        let reach = radius + 1.0 / size;
        self.ink([x - reach, y - reach, x + reach, y + reach], |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let r = dx.hypot(dy).max(1e-7);
            let n = [dx / r, dy / r];
            let frequency = rim * r / radius;
            edge_coverage((radius - r) * size, n)
                * square_wave(0.5 * frequency * r, frequency / size, n)
        });
    }

    fn square(&mut self, centre: [f32; 2], side: f32, angle: f32) {
        let half = [0.5 * side * self.size; 2];
        self.band
            .rectangle(centre.map(|v| v * self.size), half, angle, [self.dark]);
    }

    fn block(&mut self, block: &Block) {
        let [x, y] = block.centre;
        let (size, half) = (self.size, block.half);
        let (sin, cos) = block.angle.sin_cos();
        let frequency = 0.5 * block.lw_ph;
        let reach = half + 1.0 / size;
        self.ink([x - reach, y - reach, x + reach, y + reach], |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let inside = strip(dx * size, half * size, [1.0, 0.0])
                * strip(dy * size, half * size, [0.0, 1.0]);
            inside.max(0.0)
                * square_wave(
                    (dx * cos + dy * sin) * frequency,
                    frequency / size,
                    [cos, sin],
                )
        });
    }
}
