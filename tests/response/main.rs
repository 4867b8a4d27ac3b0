//! The response: one conformance suite that every pixel model joins in a few lines, and the physics of the wave model.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod cache;
mod conformance;
mod curves;
mod fdtd;
mod isolation;
mod phone;
#[path = "../common/random.rs"]
mod random;
mod rcwa;
mod shifted;
mod solvers;
mod wave;
mod wavelengths;
