//! Recipe → rendered sample with all its truths, ready for the writer.

mod by_rows;
mod coherence;
mod exposure;
mod ledger;
mod noisy;
mod picture;
mod planned;
mod prepare;
mod prepared;
mod rendered;
pub mod stages;

pub use by_rows::ByRows;
pub use prepare::{prepare, prepare_picture};
pub use prepared::{Prepared, Rays, SampleError, render_sample};
pub use rendered::{Made, Sample};
