//! The sensor: how a pixel is parted into sub-pixels.

mod subpixels;

pub use subpixels::{Subpixels, SubpixelsError};
