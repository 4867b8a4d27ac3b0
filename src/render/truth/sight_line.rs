//! A line of sight in front of the lens.

use glam::DVec2;

use crate::rays::Ray;

/// The line in front of the lens on which lies, at each depth, the mean of the places that a pixel sees: at depth D
/// (x, y) = D q₀ + q₁, camera frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightLine {
    /// Slope: (x, y) per depth.
    pub q0: DVec2,
    /// Where it meets z = 0, mm.
    pub q1_mm: DVec2,
}

impl SightLine {
    /// The line of a ray in front of the lens.
    pub fn from_ray(ray: &Ray) -> Self {
        let (o, d) = (ray.origin_mm, ray.direction);
        let m = d.truncate() / d.z;
        Self {
            q0: -m,
            q1_mm: o.truncate() - o.z * m,
        }
    }
}
