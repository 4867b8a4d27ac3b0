//! A surface, prepared for the loops.

use glam::{DMat3, DVec3};

use crate::lens::system::{ASPHERE_TERMS, OpticalSurface, SurfaceKind};

/// A surface with what does not depend on the ray worked out.
#[derive(Clone, Debug)]
pub(super) struct Prepared {
    pub vertex_mm: DVec3,
    /// Camera-from-local.
    pub rotation: Option<DMat3>,
    pub curvature: f64,
    /// 1 + k.
    pub k1: f64,
    /// A_p, and p A_p.
    pub value: [f64; ASPHERE_TERMS],
    pub derivative: [f64; ASPHERE_TERMS],
    pub terms: usize,
    pub semi_squared: f64,
    /// n/n' forward and backward; `None` where nothing refracts.
    pub eta: Option<(f64, f64)>,
}

impl Prepared {
    pub(super) fn new(surface: &OpticalSurface) -> Prepared {
        let mut value = [0.0; ASPHERE_TERMS];
        let terms = surface.aspheric_terms.min(ASPHERE_TERMS);
        value[..terms].copy_from_slice(&surface.aspheric[..terms]);
        Prepared {
            vertex_mm: surface.pose.vertex_mm,
            rotation: surface.pose.rotation,
            curvature: surface.curvature,
            k1: 1.0 + surface.conic,
            value,
            derivative: std::array::from_fn(|i| 2.0 * (i + 1) as f64 * value[i]),
            terms,
            semi_squared: surface.aperture.semi_mm * surface.aperture.semi_mm,
            eta: (surface.kind == SurfaceKind::Refract).then(|| {
                (
                    surface.index_before / surface.index_after,
                    surface.index_after / surface.index_before,
                )
            }),
        }
    }
}
