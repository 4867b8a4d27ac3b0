//! A flat textured rectangle, with an optional cut-out.
//!
//! The rectangle's points are `p = corner + s·across + t·down`, s and t in [0, 1]: s to the photographer's right, t
//! down in the upright picture. A ray o + τ d meets its plane at τ = n·(corner − o) / n·d, n = across × down.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::texture::Texture;
use crate::range::{OutOfRange, require};
use crate::rays::Ray;

/// A textured rectangle in the camera frame.
#[derive(Clone, Debug)]
pub struct TexturedPlane {
    corner_mm: DVec3,
    across_mm: DVec3,
    down_mm: DVec3,
    normal: DVec3,
    texture: Arc<Texture>,
    coverage: Option<Arc<super::coverage::Coverage>>,
}

impl TexturedPlane {
    /// A rectangle of `width_mm` × `height_mm` whose centre is at `centre_mm`, square to the axis and then turned: by
    /// `roll_deg` in its own plane, by `tilt_x_deg` about the camera's x axis (positive: the upper edge goes away) and
    /// by `tilt_y_deg` about the camera's y axis (positive: the right edge goes away).
    ///
    /// # Errors
    /// A size that is not positive and finite, a centre that is not in front of the lens (z < 0), or a tilt of 80° or
    /// more.
    pub fn new(
        centre_mm: DVec3,
        (width_mm, height_mm): (f64, f64),
        (tilt_x_deg, tilt_y_deg, roll_deg): (f64, f64, f64),
        texture: Arc<Texture>,
        coverage: Option<Arc<super::coverage::Coverage>>,
    ) -> Result<Self, OutOfRange> {
        let check = |field: &'static str, value: f64, ok: bool, allowed: &'static str| {
            require(ok, || OutOfRange::new("plane", field, value, allowed))
        };
        check(
            "width_mm",
            width_mm,
            width_mm > 0.0 && width_mm.is_finite(),
            "a positive length",
        )?;
        check(
            "height_mm",
            height_mm,
            height_mm > 0.0 && height_mm.is_finite(),
            "a positive length",
        )?;
        check(
            "centre z",
            centre_mm.z,
            centre_mm.is_finite() && centre_mm.z < 0.0,
            "negative: in front of the lens",
        )?;
        check(
            "tilt_x_deg",
            tilt_x_deg,
            tilt_x_deg.abs() < 80.0,
            "−80 to 80 (exclusive)",
        )?;
        check(
            "tilt_y_deg",
            tilt_y_deg,
            tilt_y_deg.abs() < 80.0,
            "−80 to 80 (exclusive)",
        )?;
        check("roll_deg", roll_deg, roll_deg.is_finite(), "a finite angle")?;
        let turn = Self::orientation((tilt_x_deg, tilt_y_deg, roll_deg));
        let across_mm = turn * DVec3::new(width_mm, 0.0, 0.0);
        let down_mm = turn * DVec3::new(0.0, -height_mm, 0.0);
        Ok(Self {
            corner_mm: centre_mm - 0.5 * (across_mm + down_mm),
            normal: across_mm.cross(down_mm).normalize(),
            across_mm,
            down_mm,
            texture,
            coverage,
        })
    }

    /// Camera-from-card rotation of (tilt x, tilt y, roll) in deg; the card's own axes are right, up and towards the
    /// camera.
    pub fn orientation((tilt_x_deg, tilt_y_deg, roll_deg): (f64, f64, f64)) -> DMat3 {
        DMat3::from_rotation_y(tilt_y_deg.to_radians())
            * DMat3::from_rotation_x(-tilt_x_deg.to_radians())
            * DMat3::from_rotation_z(roll_deg.to_radians())
    }

    /// Its picture.
    pub fn texture(&self) -> &Texture {
        &self.texture
    }

    /// The same card with another picture.
    pub(crate) fn with_texture(&self, texture: Arc<Texture>) -> Self {
        Self {
            texture,
            ..self.clone()
        }
    }

    /// (s, t) where a ray crosses the card's plane in front of its origin, on the card or beside it.
    pub(crate) fn crossing(&self, ray: &Ray) -> Option<DVec2> {
        let solver = self.solver();
        let tau =
            (solver.offset - solver.normal.dot(ray.origin_mm)) / solver.normal.dot(ray.direction);
        let p = ray.origin_mm + tau * ray.direction;
        let met = DVec2::new(
            solver.s_axis.dot(p) + solver.s0,
            solver.t_axis.dot(p) + solver.t0,
        );
        (tau > 0.0 && met.is_finite()).then_some(met)
    }

    /// The coefficients of the hit: `τ = (offset − n·o) / n·d`, then `s = S·p + s0`, `t = T·p + t0` for the point p.
    #[inline]
    pub(super) fn solver(&self) -> Solver {
        let s_axis = self.across_mm / self.across_mm.length_squared();
        let t_axis = self.down_mm / self.down_mm.length_squared();
        Solver {
            normal: self.normal,
            offset: self.normal.dot(self.corner_mm),
            s_axis,
            s0: -s_axis.dot(self.corner_mm),
            t_axis,
            t0: -t_axis.dot(self.corner_mm),
        }
    }

    /// Whether the card is solid at (s, t) in [0, 1]².
    #[inline]
    pub(super) fn is_solid_at(&self, s: f32, t: f32) -> bool {
        self.coverage.as_ref().is_none_or(|c| c.covers(s, t))
    }

    /// Whether it has a cut-out.
    #[inline]
    pub(super) fn has_coverage(&self) -> bool {
        self.coverage.is_some()
    }
}

/// See [`TexturedPlane::solver`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Solver {
    pub normal: DVec3,
    pub offset: f64,
    pub s_axis: DVec3,
    pub s0: f64,
    pub t_axis: DVec3,
    pub t0: f64,
}
