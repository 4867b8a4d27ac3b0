//! The main lens: prescription, glass, sequential real-ray tracing, paraxial data, pupils, misalignment.
//!
//! Camera frame throughout (see [`crate::frames`]): mm, z from the scene to the sensor, origin at the first vertex.

pub mod system;

pub use system::{Aperture, OpticalSurface, OpticalSystem, Pose, Ray, RayFailure, SurfaceKind};
