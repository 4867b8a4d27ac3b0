//! The main lens: prescription, glass, sequential real-ray tracing, paraxial data, pupils, misalignment.
//!
//! Camera frame throughout (see [`crate::frames`]): mm, z from the scene to the sensor, origin at the first vertex.

pub mod packet;
pub mod surface;
pub mod system;
pub mod trace;

pub use packet::{PacketTracer, RayBatch, RayStatus, SimdLevel};
pub use surface::Travel;
pub use system::{Aperture, OpticalSurface, OpticalSystem, Pose, Ray, RayFailure, SurfaceKind};
pub use trace::{Clipping, trace_backward, trace_forward, trace_visiting};
