//! The lens shifts of a 5D table: a regular grid over one period of the lens array.
//!
//! A gapless lens array shifted by a whole pitch is the same array, so all shifts there are lie in one period: there is
//! no last node, and a microlens that is pushed over its neighbour is the neighbour's, pulled back. Nodes
//! `s = (i, j) pitch / N`; those that a symmetry of the square maps onto each other are simulated and stored once (the
//! octant `0 ≤ j ≤ i ≤ N/2`).

use serde::{Deserialize, Serialize};

use super::symmetry::Symmetry;
use crate::range::{OutOfRange, require};

/// N nodes per pitch along x and along y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftGrid {
    /// Period of the lens array in µm.
    pub pitch_um: f64,
    /// Nodes a pitch, N.
    pub per_pitch: usize,
}

/// A node by its place (i, j) in the period, each 0 to N − 1.
pub(crate) type ShiftNode = [usize; 2];

impl ShiftGrid {
    /// N nodes per pitch (µm).
    ///
    /// # Errors
    /// A pitch that is not positive, or an N that is not an even number from 4 to 32.
    pub fn new(pitch_um: f64, per_pitch: usize) -> Result<Self, OutOfRange> {
        require(pitch_um > 0.0 && pitch_um.is_finite(), || {
            OutOfRange::new(
                "response",
                "shift_grid.pitch_um",
                pitch_um,
                "finite and > 0",
            )
        })?;
        let even = (4..=32).contains(&per_pitch) && per_pitch.is_multiple_of(2);
        require(even, || {
            let allowed = "an even number from 4 to 32";
            OutOfRange::new("response", "shift_grid.per_pitch", per_pitch, allowed)
        })?;
        Ok(Self {
            pitch_um,
            per_pitch,
        })
    }

    /// Shift of a node in µm, within half a pitch of the centre.
    pub fn shift_um(&self, node: [usize; 2]) -> [f64; 2] {
        let n = self.per_pitch as f64;
        node.map(|i| {
            let i = i as f64;
            (if i > 0.5 * n { i - n } else { i }) * self.pitch_um / n
        })
    }

    /// All nodes of the period, row-major.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = ShiftNode> + use<> {
        let n = self.per_pitch;
        (0..n * n).map(move |k| [k / n, k % n])
    }

    /// Place of a node among [`Self::nodes`].
    pub(crate) fn index(&self, [i, j]: ShiftNode) -> usize {
        i * self.per_pitch + j
    }

    /// The node of a place.
    pub(crate) fn node(&self, place: usize) -> ShiftNode {
        [place / self.per_pitch, place % self.per_pitch]
    }

    /// Where a symmetry sends a node.
    pub(crate) fn sent(&self, by: Symmetry, [i, j]: ShiftNode) -> ShiftNode {
        let n = self.per_pitch as i64;
        let (a, b) = by.node((i as i64, j as i64));
        [a, b].map(|x| x.rem_euclid(n) as usize)
    }

    /// Nodes that stand for all others; the first is (0, 0).
    pub(crate) fn stored(&self, symmetries: &[Symmetry]) -> Vec<ShiftNode> {
        let stands_for_itself = |node: &ShiftNode| self.stands_for(symmetries, *node).0 == *node;
        self.nodes().filter(stands_for_itself).collect()
    }

    /// The stored node that stands for a node, and the symmetry that leads there.
    pub(crate) fn stands_for(
        &self,
        symmetries: &[Symmetry],
        node: ShiftNode,
    ) -> (ShiftNode, Symmetry) {
        // In the octant i ≥ j; of a pixel without that symmetry the quadrant.
        let rank = |[i, j]: ShiftNode| {
            let half = self.per_pitch / 2;
            (usize::from(i > half || j > half), usize::from(j > i), i, j)
        };
        let images = symmetries.iter().map(|&s| (self.sent(s, node), s));
        images
            .min_by_key(|(image, _)| rank(*image))
            .unwrap_or((node, Symmetry::NONE))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::em::PixelStack;
    use crate::em::symmetry::symmetries;
    use crate::sensor::Subpixels;

    #[test]
    fn an_octant_stands_for_the_whole_period_of_a_square_pixel() {
        let mut stack = PixelStack::builtin("1.6um").unwrap();
        let grid = ShiftGrid::new(1.6, 8).unwrap();
        let stored = grid.stored(&symmetries(&stack));
        let wanted: Vec<ShiftNode> = (0..=4).flat_map(|i| (0..=i).map(move |j| [i, j])).collect();
        assert_eq!(stored, wanted);
        stack.subpixels = Subpixels::DUAL_X;
        let stored = grid.stored(&symmetries(&stack));
        assert_eq!((stored.len(), stored[0]), (25, [0, 0]));
        assert_eq!(grid.shift_um([5, 4]), [-0.6000000000000001, 0.8]);
    }

    #[test]
    fn only_even_grids_of_some_nodes_are_made() {
        for (pitch, n) in [(1.6, 7), (1.6, 2), (1.6, 34), (0.0, 8), (f64::NAN, 8)] {
            assert!(ShiftGrid::new(pitch, n).is_err(), "{pitch}, {n}");
        }
    }
}
