//! The main lens: prescription, glass, sequential real-ray tracing, paraxial data, pupils, misalignment.
//!
//! Camera frame throughout (see [`crate::frames`]): mm, z from the scene to the sensor, origin at the first vertex.

pub mod aim;
pub mod analysis;
mod check;
pub mod chief;
pub mod crossing;
pub mod deviation;
pub mod error;
pub mod focus;
pub mod fold;
pub mod glass;
pub mod ideal;
pub mod illumination;
pub mod json;
pub mod library;
pub mod packet;
pub mod paraxial;
pub mod placed;
pub mod prescription;
pub mod pupil;
mod section;
pub mod surface;
pub mod system;
pub mod tolerance;
pub mod trace;
pub mod verification;
pub mod zmx;

pub use crate::simd::SimdLevel;
pub use chief::chief_ray;
pub use deviation::Deviation;
pub use error::LensError;
pub use focus::FocusBy;
pub use fold::Fold;
pub use ideal::IdealLens;
pub use library::builtin_names;
pub use packet::PacketTracer;
pub use paraxial::Paraxial;
pub use placed::Lens;
pub use prescription::Prescription;
pub use pupil::{ExitPupilMap, PupilEllipse};
pub use section::{Section, SectionLine};
pub use surface::Travel;
pub use system::{Aperture, OpticalSurface, OpticalSystem, Pose, SurfaceKind};
pub use tolerance::{ElementRef, Misalignment, table1_defects};
pub use trace::{Clipping, trace_backward, trace_forward, trace_visiting};
