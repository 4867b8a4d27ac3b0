//! The sensor: the grid of microlenses, the sub-pixels below each, how the microlenses are shifted for the chief
//! ray, and how the light becomes digital numbers ([`readout`]).
//!
//! Sensor frame (see [`crate::frames`]): origin where the axis meets the sensor, lengths of the grid in mm, of a pixel
//! in µm.

mod charge;
mod grid;
mod microlens;
mod moving_frame;
pub mod readout;
mod wandering;

pub use charge::Charge;
pub use grid::Sensor;
pub use microlens::{MicrolensLaw, MicrolensShifts, ShiftRule};
pub use moving_frame::MovingFrame;
pub use quadpixel_datasets::{Subpixels, SubpixelsError};
pub use wandering::{CollectedAt, Silicon, Wandering};

use crate::range::{OutOfRange, require};

/// Checks that pixels are simulated with this partition; `what` names whose it is in the error.
///
/// # Errors
/// Another partition than those of [`Subpixels::SIMULATED`].
pub fn check_simulated(what: &'static str, subpixels: Subpixels) -> Result<(), OutOfRange> {
    require(Subpixels::SIMULATED.contains(&subpixels), || {
        let allowed = Subpixels::SIMULATED.map(|s| s.to_string()).join(", ");
        OutOfRange::new(what, "subpixels", subpixels, allowed + " (columns x rows)")
    })
}

/// Calls a method that is generic over the number of sub-pixels, one of those of [`Subpixels::SIMULATED`].
macro_rules! by_count {
    ($count:expr, $object:ident.$method:ident($($argument:expr),*)) => {
        match $count {
            1 => $object.$method::<1>($($argument),*),
            2 => $object.$method::<2>($($argument),*),
            4 => $object.$method::<4>($($argument),*),
            9 => $object.$method::<9>($($argument),*),
            _ => $object.$method::<16>($($argument),*),
        }
    };
}
pub(crate) use by_count;
