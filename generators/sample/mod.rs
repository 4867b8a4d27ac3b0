//! Recipe → rendered sample with all its truths, ready for the writer.

mod coherence;
mod ledger;
mod noisy;
mod picture;
mod planned;
mod prepared;
mod rendered;
pub mod stages;

pub use prepared::{Prepared, Rays, SampleError, prepare, render_sample};
pub use rendered::Sample;
