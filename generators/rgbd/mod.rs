//! Pictures with depth from files and arrays: what their numbers mean, and the pairs of two folders.

mod blur;
mod depth;
mod error;
mod files;
mod light;
mod meaning;
mod pairs;
mod preset;
mod recipe;

pub use blur::{Depths, TooLarge};
pub use error::PictureError;
pub use files::Stored;
pub use meaning::{DepthKind, Encoding, Intrinsics, Meaning};
pub use pairs::{Pair, pairs};
pub use preset::Preset;
pub use recipe::{Level, RgbdRecipe};
