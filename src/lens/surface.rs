//! One surface of a lens: its sag, slope and normal, and where a ray meets it, all in the surface's own frame.
//!
//! With r² = x² + y², c the vertex curvature, k the conic constant and s = √(1 − (1+k) c² r²):
//!
//! ```text
//! sag z(r) = c r² / (1 + s) + Σ A_p r^p          slope over radius h = z'(r) / r = c / s + Σ p A_p r^(p−2)
//! ∇(z − sag) = (−x h, −y h, 1)
//! ```
//!
//! A ray P + t D meets the bare conic c (x² + y² + (1+k) z²) − 2 z = 0 where A t² + 2 B t + C = 0. Light that crosses
//! from the scene's side to the sensor's side does so where A t + B < 0 (σ = +1), the other way round where A t + B > 0
//! (σ = −1): this picks the sheet that carries the vertex without looking at distances (Welford, Aberrations of Optical
//! Systems, section 4.3). An asphere takes that point as the start of Newton's method on z − sag(r²) = 0 along the ray.
//! A start from the vertex plane would lose field-edge rays on the steep last surfaces of phone lenses. Where Newton's
//! method does not settle, or settles where it must not, [`super::crossing`] searches the aperture.

use glam::{DVec2, DVec3};

use super::system::OpticalSurface;
use crate::rays::Ray;

/// Newton's method gives up after this many steps. Regular rays need two to five; a ray far outside the clear aperture,
/// where r^p rules, comes in by a factor 1 − 1/p a step.
pub(crate) const NEWTON_LIMIT: usize = 64;
/// A Newton step below this is the last one, mm: convergence is quadratic, so it leaves less than rounding does.
pub(crate) const NEWTON_LAST_STEP_MM: f64 = 1e-9;
/// Floor of s² outside the conic's domain, which keeps Newton's method going until it comes back inside.
pub(crate) const ROOT_FLOOR: f64 = 1e-4;

/// Which way a ray crosses the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// From the scene to the sensor.
    Forward,
    /// From the sensor to the scene.
    Backward,
}

impl Travel {
    /// σ: +1 forward, −1 backward.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Travel::Forward => 1.0,
            Travel::Backward => -1.0,
        }
    }
}

impl OpticalSurface {
    /// Sag in mm at squared radius `r2` (mm²); `None` outside the domain of the conic.
    pub fn sag_mm(&self, r2: f64) -> Option<f64> {
        self.within_domain(r2).then(|| self.sag_and_slope(r2).0)
    }

    /// Slope over radius h = z'(r) / r in 1/mm at squared radius `r2` (mm²); `None` outside the domain of the conic.
    pub fn slope_over_radius(&self, r2: f64) -> Option<f64> {
        self.within_domain(r2).then(|| self.sag_and_slope(r2).1)
    }

    /// Unit normal at (x, y) mm of the local frame, pointing to the sensor's side; `None` outside the domain.
    pub fn normal(&self, at_mm: DVec2) -> Option<DVec3> {
        let h = self.slope_over_radius(at_mm.length_squared())?;
        Some(DVec3::new(-at_mm.x * h, -at_mm.y * h, 1.0).normalize())
    }

    /// The point (local frame, mm) at which the local `ray` crosses the surface in the sense `travel`; `None` if it
    /// misses. The clear aperture stops nothing here; of several crossings it says which one counts (see
    /// `lens::crossing`).
    pub fn intersect(&self, ray: Ray, travel: Travel) -> Option<DVec3> {
        let (d, sign) = (ray.direction, travel.sign());
        // From the point nearest to the vertex: the numbers stay small, whatever the distance travelled.
        let foot = ray.origin_mm - d * ray.origin_mm.dot(d);
        let start = self.intersect_conic(foot, d, sign);
        if self.aspheric_terms > 0 {
            let settled = self.newton(foot, d, start.unwrap_or(0.0));
            return Some(foot + d * self.settle(foot, d, sign, settled)?);
        }
        let point = foot + d * start?;
        let r2 = point.x * point.x + point.y * point.y;
        // The conic's other sheet has 1 − (1+k) c z < 0. Written so that a NaN fails.
        let on_sheet = 1.0 - (1.0 + self.conic) * self.curvature * point.z > 0.0;
        (point.is_finite() && self.within_domain(r2) && on_sheet).then_some(point)
    }

    /// Path length from `foot` to the bare conic. An asphere may be met where its conic is missed: then
    /// the point of closest approach, −B/A, is a good start; a pure conic returns `None`.
    fn intersect_conic(&self, foot: DVec3, d: DVec3, sign: f64) -> Option<f64> {
        let (c, k1) = (self.curvature, 1.0 + self.conic);
        let a = c * (d.x * d.x + d.y * d.y + k1 * d.z * d.z);
        let b = c * (foot.x * d.x + foot.y * d.y + k1 * foot.z * d.z) - d.z;
        let cc = c * (foot.x * foot.x + foot.y * foot.y + k1 * foot.z * foot.z) - 2.0 * foot.z;
        let discriminant = b * b - a * cc;
        if discriminant < 0.0 {
            return (self.aspheric_terms > 0).then(|| -b / a);
        }
        let root = sign * discriminant.sqrt();
        // The two forms of the same root; the one whose terms do not cancel.
        let t = if sign * b <= 0.0 {
            cc / (root - b)
        } else {
            -(b + root) / a
        };
        let on_vertex_sheet = 1.0 - k1 * c * (foot.z + t * d.z) > 0.0;
        on_vertex_sheet.then_some(t)
    }

    /// Path length at which Newton's method settles.
    fn newton(&self, foot: DVec3, d: DVec3, start: f64) -> Option<f64> {
        let mut t = start;
        for _ in 0..NEWTON_LIMIT {
            let p = foot + d * t;
            let (sag, h) = self.sag_and_slope(p.x * p.x + p.y * p.y);
            let step = (p.z - sag) / (d.z - h * (p.x * d.x + p.y * d.y));
            t -= step;
            if step.abs() < NEWTON_LAST_STEP_MM {
                return Some(t);
            }
        }
        None
    }

    pub(super) fn within_domain(&self, r2: f64) -> bool {
        1.0 - (1.0 + self.conic) * self.curvature * self.curvature * r2 > 0.0
    }

    /// Sag and slope over radius, continued past the conic's domain by [`ROOT_FLOOR`].
    pub(super) fn sag_and_slope(&self, r2: f64) -> (f64, f64) {
        let c = self.curvature;
        let s2 = 1.0 - (1.0 + self.conic) * c * c * r2;
        let s = if s2 > ROOT_FLOOR { s2 } else { ROOT_FLOOR }.sqrt();
        let (mut value, mut derivative) = (0.0, 0.0);
        for (i, a) in self.aspheric[..self.aspheric_terms]
            .iter()
            .enumerate()
            .rev()
        {
            value = (value + a) * r2;
            derivative = derivative * r2 + 2.0 * (i + 1) as f64 * a;
        }
        (c * r2 / (1.0 + s) + value, c / s + derivative)
    }
}
