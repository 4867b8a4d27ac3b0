//! Disparity at every pixel, against pairs blurred by an independent code: half-pupil kernels sampled point by point.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod blurred;
mod kernels;
mod network;
mod rays;
