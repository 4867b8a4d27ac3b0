//! Surfaces and small systems built by hand.

use glam::{DMat3, DVec3};
use quadpixel::lens::{Aperture, OpticalSurface, OpticalSystem, Pose, SurfaceKind};

/// A refracting conic on the axis at z = `z_mm`, unlimited in aperture.
pub fn conic(z_mm: f64, curvature: f64, conic: f64, indices: (f64, f64)) -> OpticalSurface {
    OpticalSurface {
        pose: Pose {
            vertex_mm: DVec3::new(0.0, 0.0, z_mm),
            rotation: None,
        },
        curvature,
        conic,
        aspheric: [0.0; 10],
        aspheric_terms: 0,
        aperture: Aperture {
            semi_mm: f64::INFINITY,
        },
        kind: SurfaceKind::Refract,
        index_before: indices.0,
        index_after: indices.1,
    }
}

/// The same surface with even aspheric terms A_2, A_4, ….
pub fn asphere(mut surface: OpticalSurface, terms: &[f64]) -> OpticalSurface {
    surface.aspheric[..terms.len()].copy_from_slice(terms);
    surface.aspheric_terms = terms.len();
    surface
}

/// The same surface turned about its vertex: by `tip` about x, then by `tilt` about y, rad.
pub fn tilted(mut surface: OpticalSurface, tip: f64, tilt: f64) -> OpticalSurface {
    surface.pose.rotation = Some(DMat3::from_rotation_y(tilt) * DMat3::from_rotation_x(tip));
    surface
}

/// An aperture stop on the axis.
pub fn stop(z_mm: f64, semi_mm: f64) -> OpticalSurface {
    let mut surface = conic(z_mm, 0.0, 0.0, (1.0, 1.0));
    surface.aperture.semi_mm = semi_mm;
    surface.kind = SurfaceKind::Stop;
    surface
}

/// A system of these surfaces at 550 nm; its stop is the first `Stop` surface, or surface 0.
pub fn system(surfaces: Vec<OpticalSurface>, sensor_z_mm: f64) -> OpticalSystem {
    let stop = surfaces
        .iter()
        .position(|s| s.kind == SurfaceKind::Stop)
        .unwrap_or(0);
    OpticalSystem {
        surfaces,
        stop,
        sensor_z_mm,
        wavelength_nm: 550.0,
    }
}
