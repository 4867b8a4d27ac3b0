//! The main lens: prescription, glass, sequential real-ray tracing, paraxial data, pupils, misalignment.
//!
//! Camera frame throughout (see [`crate::frames`]): mm, z from the scene to the sensor, origin at the first vertex.

mod aim;
mod analysis;
mod check;
mod chief;
mod crossing;
mod deviation;
mod error;
mod focus;
mod fold;
mod folder;
mod glass;
mod ideal;
mod illumination;
mod json;
mod library;
mod map;
mod packet;
mod paraxial;
mod placed;
pub(crate) mod polynomial;
mod prescription;
mod pupil;
mod reflection;
mod section;
mod seq;
mod surface;
mod system;
mod tolerance;
mod trace;
pub mod verification;
mod zmx;

pub use aim::{Aim, Field};
pub use analysis::{FieldFigures, SPOT_LINES_NM, Spot, pupil_grid, rms_radius};
pub use chief::{chief_ray, chief_rays};
pub use deviation::{Deviation, LARGEST_INDEX_DEVIATION, LARGEST_RADIUS_PERCENT};
pub use error::LensError;
pub use focus::FocusBy;
pub use fold::Fold;
pub use folder::{LensFigures, LensKind, lens_files};
pub use glass::{Glass, WAVELENGTH_RANGE_NM, catalogue_glass, catalogue_names};
pub use ideal::IdealLens;
pub use illumination::{UvBox, projected_solid_angle};
pub use library::builtin_names;
pub use map::{LensMap, MapBound, MapFailure, MapReport, MapTask, PlaceBuffers};
pub use packet::PacketTracer;
pub use paraxial::{Paraxial, singlet_efl_mm};
pub use placed::Lens;
pub use prescription::{
    PrescribedSurface, Prescription, Stated, Verification, VerifiedElement, VerifiedField,
};
pub(crate) use pupil::last_that_pass;
pub use pupil::{ExitPupilMap, PupilEllipse};
pub use reflection::{
    Coating, GhostPair, GhostPairs, NamedCoating, Reflected, ReflectionSettings, Reflections,
};
pub use section::{Section, SectionLine};
pub use surface::Travel;
pub use system::{ASPHERE_TERMS, Aperture, OpticalSurface, OpticalSystem, Pose, SurfaceKind};
pub use tolerance::{ElementRef, LARGEST_TURN_DEG, Misalignment, table1_defects};
pub use trace::{Clipping, trace_backward, trace_forward, trace_visiting};
