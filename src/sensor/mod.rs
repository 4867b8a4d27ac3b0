//! The sensor: the grid of microlenses, the sub-pixels below each, how the microlenses are shifted for the chief
//! ray, and how the light becomes digital numbers ([`readout`]).
//!
//! Sensor frame (see [`crate::frames`]): origin where the axis meets the sensor, lengths of the grid in mm, of a pixel
//! in µm.

mod grid;
mod microlens;
mod moving_frame;
pub mod readout;
mod subpixels;

pub use grid::Sensor;
pub use microlens::{MicrolensShifts, ShiftRule};
pub use moving_frame::MovingFrame;
pub use subpixels::{Subpixels, SubpixelsError};
