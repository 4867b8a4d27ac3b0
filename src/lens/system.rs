//! A lens at one wavelength: the form that both tracers (scalar oracle and packets) read.
//!
//! Sag of a surface about its vertex, r² = x² + y², c = 1/R, k the conic constant:
//!
//! ```text
//! z(r) = c r² / (1 + √(1 − (1+k) c² r²)) + Σ A_p r^p ,   p = 2, 4, …, 20
//! ```

use glam::{DMat3, DVec2, DVec3};

/// Number of even aspheric terms kept: r², r⁴, …, r²⁰.
pub const ASPHERE_TERMS: usize = 10;

/// Where a tilted or decentred surface stands: `camera = rotation · local + vertex_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Vertex of the surface in the camera frame, mm.
    pub vertex_mm: DVec3,
    /// Camera-from-local rotation; `None` when the surface is square to the axis (the fast path).
    pub rotation: Option<DMat3>,
}

/// Clear aperture of a surface, by its local radius √(x² + y²) from its own vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Largest radius that passes, mm; infinite when open.
    pub semi_mm: f64,
}

/// What a surface does to a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKind {
    /// Refracts (also between equal indices: then the ray passes straight on).
    Refract,
    /// Only clips: the aperture stop, or a dummy plane.
    Stop,
}

/// One surface at one wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct OpticalSurface {
    /// Where it stands.
    pub pose: Pose,
    /// Vertex curvature c = 1/R of the conic, 1/mm; 0 for a plane.
    pub curvature: f64,
    /// Conic constant k (0 sphere, −1 paraboloid).
    pub conic: f64,
    /// A_2, A_4, …, A_20 in mm^(1−p).
    pub aspheric: [f64; ASPHERE_TERMS],
    /// Number of leading entries of `aspheric` in use; 0 for a pure conic.
    pub aspheric_terms: usize,
    /// Clear aperture.
    pub aperture: Aperture,
    /// What it does.
    pub kind: SurfaceKind,
    /// Refractive index on the scene side.
    pub index_before: f64,
    /// Refractive index on the sensor side.
    pub index_after: f64,
}

/// The whole lens at one wavelength, in the order in which light meets its surfaces. A stop in front of the first
/// glass may stand at a larger z than the glass vertex (phone lenses): order, not z, is what counts.
///
/// A fold mirror is unfolded: its tip and tilt are a rotation of everything behind it (see `tolerance`).
#[derive(Clone, Debug, PartialEq)]
pub struct OpticalSystem {
    /// The surfaces.
    pub surfaces: Vec<OpticalSurface>,
    /// Index of the aperture stop in `surfaces`.
    pub stop: usize,
    /// z of the sensor plane in the camera frame, mm.
    pub sensor_z_mm: f64,
    /// Wavelength, nm.
    pub wavelength_nm: f64,
}

impl OpticalSystem {
    /// Whether every surface is square to the axis and centred on it.
    pub fn is_rotational(&self) -> bool {
        let mut poses = self.surfaces.iter().map(|s| &s.pose);
        poses.all(|p| p.rotation.is_none() && p.vertex_mm.truncate() == DVec2::ZERO)
    }
}
