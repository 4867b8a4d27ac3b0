//! `qpgen`: randomised charts and scenes, rendered into training data.
pub mod charts;
pub mod gallery;
pub mod preview;
pub mod writer;
