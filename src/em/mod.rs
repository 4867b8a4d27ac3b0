//! The pixel as matter: its layers, their materials, and where light that falls on it goes.
//!
//! [`light`] is the seam of all solvers, [`PixelModel`] the list of them; each has a folder of its own.

mod builtin;
mod check;
mod choice;
pub mod corrected;
mod error;
pub mod fdtd;
pub mod geometric;
mod indices;
mod level;
pub mod light;
mod material;
mod model;
pub mod mosaic;
pub mod multilayer;
pub mod rcwa;
mod shift_grid;
mod stack;
mod supercell;
pub(crate) mod symmetry;
pub mod wave;

pub use choice::ModelChoice;
pub use error::{SolverError, StackError};
pub(crate) use indices::Indices;
pub use level::{DirectionSteps, Level, Preset};
pub use material::Material;
pub use model::{CorrectedSettings, PixelModel};
pub use shift_grid::ShiftGrid;
pub use stack::{Isolation, Layer, MetalWalls, Microlens, PixelStack};
