//! The pixel as matter: its layers, their materials, and where light that falls on it goes.
//!
//! [`light`] is the seam of all solvers, [`PixelModel`] the list of them; each has a folder of its own.

mod builtin;
mod check;
pub mod corrected;
mod error;
pub mod fdtd;
pub mod geometric;
mod indices;
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

pub use error::{SolverError, StackError};
pub(crate) use indices::Indices;
pub use material::Material;
pub use model::{CorrectedSettings, DirectionSteps, Level, ModelChoice, PixelModel, Preset};
pub use shift_grid::ShiftGrid;
pub use stack::{Layer, MetalWalls, Microlens, PixelStack};
