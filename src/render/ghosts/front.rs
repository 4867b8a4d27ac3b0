//! Where light enters the lens.

use glam::{DVec2, DVec3};

use super::super::Camera;
use crate::rays::Ray;
use crate::spectrum::ChannelWavelengths;

/// The disk is this much larger than the rim: surfaces out of place.
const MARGIN: f64 = 1.05;
/// Light nearer to the disk's plane than this cosine is left out: no lens takes it in.
const LEAST_COSINE: f64 = 0.02;

/// The disk in the plane of the first rim. Light that goes through the cap of glass behind or in front of it goes
/// through the disk.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrontDisk {
    centre_mm: DVec3,
    radius_mm: f64,
}

impl FrontDisk {
    /// `None` of bare pixels.
    pub fn new(camera: &Camera) -> Option<Self> {
        let system = camera.system(ChannelWavelengths::REFERENCE);
        let rimmed = |s: &&crate::lens::OpticalSurface| s.aperture.semi_mm.is_finite();
        let first = system.surfaces.iter().find(rimmed)?;
        let semi = first.aperture.semi_mm;
        let sag = first.sag_mm(semi * semi).unwrap_or(0.0);
        Some(Self {
            centre_mm: first.pose.vertex_mm + DVec3::new(0.0, 0.0, sag),
            radius_mm: MARGIN * semi,
        })
    }

    /// Its middle, camera frame, mm.
    pub fn centre_mm(&self) -> DVec3 {
        self.centre_mm
    }

    /// Side of the square around it, mm.
    pub fn side_mm(&self) -> f64 {
        2.0 * self.radius_mm
    }

    /// The place at p, −1 to 1 along each side of the square, camera frame, mm; `None` beside the disk.
    pub fn place_mm(&self, p: DVec2) -> Option<DVec3> {
        let inside = p.length_squared() <= 1.0;
        inside.then(|| self.centre_mm + (self.radius_mm * p).extend(0.0))
    }
}

/// A direction away from the camera by its cosines across the axis; `None` along the disk.
pub(super) fn outwards(s: DVec2) -> Option<DVec3> {
    let z2 = 1.0 - s.length_squared();
    (z2 > LEAST_COSINE * LEAST_COSINE).then(|| s.extend(-z2.sqrt()))
}

/// The light that comes against it.
pub(super) fn inwards(place_mm: DVec3, outwards: DVec3) -> Ray {
    Ray {
        origin_mm: place_mm,
        direction: -outwards,
    }
}
