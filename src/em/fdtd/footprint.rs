//! Boxes of cells whose powers are counted: the whole grid, a photodiode's.

use std::ops::Range;

use super::mesh::Mesh;
use crate::em::PixelStack;

/// A box of cells in x and y, and how often the whole period has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Footprint {
    pub x: Range<usize>,
    pub y: Range<usize>,
    pub times: f64,
}

impl Footprint {
    /// All cells of the grid.
    pub fn whole(mesh: &Mesh) -> Self {
        let times = mesh.mirrors.map(|m| if m { 2.0 } else { 1.0 });
        Self {
            x: 0..mesh.grid.nx(),
            y: 0..mesh.grid.ny(),
            times: times[0] * times[1],
        }
    }

    /// A photodiode's: from trench centre to trench centre.
    pub fn for_photodiode(mesh: &Mesh, stack: &PixelStack, index: usize) -> Self {
        let (column, row) = stack.photodiode_column_row(index);
        let along = |n: usize, mirror: bool, parts: usize, at: usize| {
            let cells = if mirror { 2 * n } else { n };
            // A mirror halves the microlens at the side of a supercell.
            let first = match mirror {
                true => cells / 2 - cells / (2 * mesh.microlenses),
                false => 0,
            };
            let parts = parts * mesh.microlenses;
            let place = |at: usize| first + at * cells / parts;
            let (start, end) = (place(at), place(at + 1));
            if !mirror || end <= n {
                (start..end, 1.0)
            } else if start < n {
                (start..n, 2.0)
            } else if end <= cells {
                // Beyond the mirror: its image.
                (cells - end..cells - start, 1.0)
            } else if start < cells {
                (0..end - cells, 2.0)
            } else {
                (start - cells..end - cells, 1.0)
            }
        };
        let [m, n] = [stack.subpixels.m(), stack.subpixels.n()];
        let (x, in_x) = along(mesh.grid.nx(), mesh.mirrors[0], m, column);
        let (y, in_y) = along(mesh.grid.ny(), mesh.mirrors[1], n, row);
        Self {
            x,
            y,
            times: in_x * in_y,
        }
    }
}
