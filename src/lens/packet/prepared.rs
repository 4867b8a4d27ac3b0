//! A surface, prepared for the loops.

use glam::{DMat3, DVec3};

use crate::lens::crossing::SLANTED_Z_SQUARED;
use crate::lens::system::{ASPHERE_TERMS, OpticalSurface, SurfaceKind};

/// Rings into which the clear aperture is cut to bound its slope.
const RINGS: usize = 128;
/// The bound goes on beyond the rim, to this many rings, for rays that are clipped.
const OUTER_RINGS: usize = 256;
/// Slope up to which it may rise there.
const OUTER_SLOPE: f64 = 1.0;

/// Where the crossing that Newton's method finds is the one that counts if it has the right sense (see
/// [`crate::lens::crossing`]). With m the steepest slope, a ray with D_z² (1 + m²) ≥ m² crosses once; within the
/// aperture one within 45° of the axis is not asked for more.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainCase {
    /// Least D_z² within the aperture.
    pub z_squared: f64,
    /// Least D_z² beyond it, where one crossing outside tells that there is none inside.
    pub outer_z_squared: f64,
    /// Largest r² (mm²) to which that holds.
    pub outer_r_squared: f64,
}

impl PlainCase {
    fn for_surface(surface: &OpticalSurface) -> PlainCase {
        let semi = surface.aperture.semi_mm;
        if surface.aspheric_terms == 0 || semi == f64::INFINITY {
            return PlainCase {
                z_squared: 0.0,
                outer_z_squared: 0.0,
                outer_r_squared: f64::INFINITY,
            };
        }
        let least = |slope: f64| slope * slope / (1.0 + slope * slope);
        let (mut steepest, mut reach, mut within) = (0.0_f64, 0.0, 0.0);
        for ring in 1..=OUTER_RINGS {
            let outer = semi * ring as f64 / RINGS as f64;
            let (low, high) = surface.slope_bounds(reach * reach, outer * outer);
            let slope = steepest.max(outer * low.abs().max(high.abs()));
            let ends = slope > OUTER_SLOPE.max(within) || !surface.within_domain(outer * outer);
            if ring > RINGS && ends {
                break;
            }
            (steepest, reach) = (slope, outer);
            if ring == RINGS {
                within = slope;
            }
        }
        PlainCase {
            z_squared: least(within).min(SLANTED_Z_SQUARED),
            outer_z_squared: least(steepest),
            outer_r_squared: reach * reach,
        }
    }
}

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
    /// Where Newton's method needs no second look.
    pub plain_case: PlainCase,
    /// The surface itself, for the rays that need one.
    pub shape: OpticalSurface,
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
            plain_case: PlainCase::for_surface(surface),
            shape: surface.clone(),
            eta: (surface.kind == SurfaceKind::Refract).then(|| {
                (
                    surface.index_before / surface.index_after,
                    surface.index_after / surface.index_before,
                )
            }),
        }
    }
}
