//! The sides of the period and the wave that is sent in: what tells the members of a batch apart.

use super::SolverError;
use super::error::within;

/// A plane of mirror symmetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wall {
    /// Tangential E is odd, so zero, at the wall (a perfect conductor).
    Electric,
    /// Tangential H is odd, so zero, half a step from the wall's E nodes on both sides (a perfect magnetic conductor).
    Magnetic,
}

/// The two sides of one lateral axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lateral {
    /// field(x + nx dx) = e^(i phase) field(x). The phase is k∥ nx dx, not reduced to ±π: the source takes its k∥ from
    /// it.
    Bloch {
        /// Phase of one period in radians.
        phase_rad: f64,
    },
    /// Walls through the E nodes 0 and nx: the grid is half a period of a cell that is its own mirror image.
    Mirror(Wall),
}

impl Lateral {
    /// Whether the fields need an imaginary part.
    pub fn is_complex(self) -> bool {
        matches!(self, Self::Bloch { phase_rad } if phase_rad != 0.0)
    }

    pub(super) fn is_mirror(self) -> bool {
        matches!(self, Self::Mirror(_))
    }
}

/// One run of a batch: its sides and the direction of its current sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Sides in x.
    pub x: Lateral,
    /// Sides in y.
    pub y: Lateral,
    /// Surface current (Jx, Jy) of the source, times the waveform.
    pub current: [f64; 2],
}

impl Member {
    /// Sets of real fields: 2 (real and imaginary part) if a Bloch phase is not zero, else 1.
    pub fn sets(&self) -> usize {
        1 + usize::from(self.x.is_complex() || self.y.is_complex())
    }

    pub(super) fn check(&self) -> Result<(), SolverError> {
        for side in [self.x, self.y] {
            if let Lateral::Bloch { phase_rad } = side {
                within("phase_rad", phase_rad, -1e4, 1e4)?;
            }
        }
        for j in self.current {
            within("current", j, -1e6, 1e6)?;
        }
        Ok(())
    }
}
