//! The Yee stepper against closed forms: dispersion, energy, absorbing layers, slabs, late time; and the fast stepper
//! against the plain one.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod equal;
mod plane_waves;
mod setup;
mod stability;
