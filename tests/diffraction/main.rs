//! Diffraction at the lens's aperture, from outside: gratings rendered with and without it against the overlap of the
//! directions that reach the sensor, and the rays' blur times the aperture's against waves with the lens's own phases.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod gratings;
mod pupil;
#[path = "../common/shots.rs"]
mod shots;
mod waves;
