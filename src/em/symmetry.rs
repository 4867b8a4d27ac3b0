//! Directions that a symmetry of pixel and lens shift maps onto each other are simulated once.
//!
//! A square cell with a centred lens has the eight symmetries of the square; a lens shift, or photodiodes that are not
//! square, leave fewer. The response is the mean of both polarizations, which every symmetry keeps. A mosaic of colour
//! filters leaves all: those of the red and the blue microlens are the square's, and the diagonal changes the two
//! greens, of which the response is the mean.

use super::PixelStack;
use crate::sensor::Subpixels;

/// Place on the simulated grid, (0, 0) in the middle.
pub(crate) type Node = (i64, i64);

/// A symmetry of the square: first swap the axes, then change signs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Symmetry {
    swap: bool,
    sign_x: i64,
    sign_y: i64,
}

impl Symmetry {
    /// The one that changes nothing.
    pub const NONE: Self = Self {
        swap: false,
        sign_x: 1,
        sign_y: 1,
    };

    /// Where it sends a node.
    pub fn node(self, (a, b): Node) -> Node {
        let (a, b) = if self.swap { (b, a) } else { (a, b) };
        (a * self.sign_x, b * self.sign_y)
    }
    /// Where it sends the direction cosines (u, v).
    pub fn direction(self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [u, v] = if self.swap { [v, u] } else { [u, v] };
        [u * self.sign_x as f64, v * self.sign_y as f64]
    }
    /// The sub-pixel that sub-pixel `i` becomes.
    pub fn sub_pixel(self, s: Subpixels, i: usize) -> usize {
        let (c, r) = s.column_row(i);
        let i = if self.swap { s.index(r, c) } else { i };
        s.mirrored(i, [self.sign_x < 0, self.sign_y < 0])
    }
}

/// The symmetries of a pixel with a centred lens.
pub(crate) fn symmetries_of(subpixels: Subpixels) -> Vec<Symmetry> {
    symmetries_keeping(subpixels, [0.0, 0.0])
}

/// The symmetries that leave the pixel and its lens shift as they are.
pub(crate) fn symmetries(stack: &PixelStack) -> Vec<Symmetry> {
    symmetries_keeping(stack.subpixels, stack.lens.shift_um)
}

fn symmetries_keeping(subpixels: Subpixels, [sx, sy]: [f64; 2]) -> Vec<Symmetry> {
    let mut symmetries = Vec::new();
    for swap in [false, true] {
        for sign_x in [1, -1] {
            for sign_y in [1, -1] {
                let (a, b) = if swap { (sy, sx) } else { (sx, sy) };
                let keeps_shift = a * sign_x as f64 == sx && b * sign_y as f64 == sy;
                let keeps_pixel = !swap || subpixels.m() == subpixels.n();
                if keeps_shift && keeps_pixel {
                    symmetries.push(Symmetry {
                        swap,
                        sign_x,
                        sign_y,
                    });
                }
            }
        }
    }
    symmetries
}

/// One node of every orbit: the smallest.
pub(crate) fn canonical_nodes(steps: i64, symmetries: &[Symmetry]) -> Vec<Node> {
    let mut nodes = Vec::new();
    for a in -steps..=steps {
        for b in -steps..=steps {
            if symmetries.iter().all(|s| s.node((a, b)) >= (a, b)) {
                nodes.push((a, b));
            }
        }
    }
    nodes
}
