//! Wedges and line blocks of the resolution chart, where they lie, and their labels.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::charts::lettering::{Letter, Lettering, Placement};

/// LW/PH at the wide end of the wedges and at the first line block.
const LEAST_LW_PH: f32 = 200.0;

/// A label: its text and its middle.
pub(super) struct Label {
    text: String,
    middle: [f32; 2],
}

/// A wedge: the direction from the chart's middle along its lines (radians), and the distances from the middle (shares
/// of the side) of its wide end, `start`, and its narrow one, `end`.
pub(super) struct Wedge {
    pub(super) angle: f32,
    pub(super) start: f32,
    pub(super) end: f32,
}

/// Four wedges towards the middle, four from the corners.
pub(super) fn wedges() -> Vec<Wedge> {
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
    pub(super) const CYCLES: f32 = 5.0;

    /// Cycles a side at the share `along` (0 wide end, 1 narrow end).
    pub(super) fn frequency(along: f32, highest_lw_ph: f32) -> f32 {
        0.5 * (LEAST_LW_PH + (highest_lw_ph - LEAST_LW_PH) * along)
    }

    /// Hundreds of LW/PH beside the lines, to a tenth.
    pub(super) fn labels(&self, highest_lw_ph: f32) -> Vec<Label> {
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
pub(super) struct Block {
    pub(super) centre: [f32; 2],
    pub(super) half: f32,
    pub(super) lw_ph: f32,
    pub(super) angle: f32,
}

/// Blocks of growing frequency on either side of the zone plates: upright above, level at the sides, diagonal below.
pub(super) fn blocks(highest_lw_ph: f32) -> Vec<Block> {
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
    pub(super) fn label(&self) -> Label {
        Label {
            text: format!("{:.0}", self.lw_ph),
            middle: [self.centre[0], self.centre[1] + self.half + 0.015],
        }
    }
}

impl Label {
    /// Em height as a share of the side.
    const EM: f32 = 0.014;

    pub(super) fn letters(&self, lettering: &Lettering, size: f32) -> Vec<Letter> {
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
