//! The lens shifts of a table: the pixel's own, or all of a period.

use crate::em::symmetry::{Node, Symmetry};
use crate::em::{PixelStack, ShiftGrid};
use crate::response::{ResponseError, TableSettings};

/// See the module. A shift is told by its place.
pub(super) enum ShiftAxis {
    /// The pixel's own, µm.
    One([f64; 2]),
    /// All nodes of a grid, of a pixel with a centred lens.
    All(ShiftGrid),
}

impl ShiftAxis {
    /// # Errors
    /// A lens that is shifted already, of a table of all shifts.
    pub fn new(stack: &PixelStack, settings: &TableSettings) -> Result<Self, ResponseError> {
        let Some(shifts) = &settings.shifts else {
            return Ok(Self::One(stack.lens.shift_um));
        };
        if stack.lens.shift_um != [0.0, 0.0] {
            return Err(ResponseError::value(
                "lens.shift_um",
                format!("{:?}", stack.lens.shift_um),
                "[0, 0] for a table of all shifts",
            ));
        }
        Ok(Self::All(ShiftGrid::new(stack.pitch_um, shifts.per_pitch)?))
    }

    /// The grid, of a table of all shifts.
    pub fn grid(&self) -> Option<ShiftGrid> {
        match self {
            Self::One(_) => None,
            Self::All(grid) => Some(*grid),
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::All(grid) => grid.per_pitch * grid.per_pitch,
        }
    }

    /// A shift in µm.
    pub fn shift_um(&self, place: usize) -> [f64; 2] {
        match self {
            Self::One(shift_um) => *shift_um,
            Self::All(grid) => grid.shift_um(grid.node(place)),
        }
    }

    /// Where a symmetry sends a shift.
    pub fn sent(&self, by: Symmetry, place: usize) -> usize {
        match self {
            Self::One(_) => place,
            Self::All(grid) => grid.index(grid.sent(by, grid.node(place))),
        }
    }

    /// Symmetries that leave a direction alone and so give one shift's light from another's.
    pub fn fixing(&self, direction: Node, symmetries: &[Symmetry]) -> Vec<Symmetry> {
        match self {
            Self::One(_) => vec![Symmetry::NONE],
            Self::All(_) => {
                let fixing = symmetries.iter().copied();
                fixing.filter(|g| g.node(direction) == direction).collect()
            }
        }
    }

    /// Shifts to simulate at a direction; they stand for all.
    pub fn to_simulate(&self, direction: Node, symmetries: &[Symmetry]) -> Vec<usize> {
        let fixing = self.fixing(direction, symmetries);
        let first = |place: &usize| {
            let images = fixing.iter().map(|g| self.sent(*g, *place));
            images.min() == Some(*place)
        };
        (0..self.count()).filter(first).collect()
    }

    /// Shifts that a table stores, and their values in µm on its axis.
    pub fn stored(&self, symmetries: &[Symmetry]) -> Vec<(usize, [f64; 2])> {
        match self {
            Self::One(_) => vec![(0, [0.0, 0.0])],
            Self::All(grid) => {
                let nodes = grid.stored(symmetries).into_iter();
                nodes.map(|n| (grid.index(n), grid.shift_um(n))).collect()
            }
        }
    }
}
