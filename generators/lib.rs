//! `qpgen`: randomised charts and scenes, rendered into training data.
pub mod charts;
