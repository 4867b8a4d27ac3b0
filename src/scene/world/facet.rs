//! A triangle as a plane and two edges, f64: places on it.

use glam::{DVec3, Vec3A as Vec3};

use super::geometry::{Element, Stage};
use crate::rays::Ray;

/// A triangle in the camera frame: its first corner, the edges from it, their cross product and its square.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    p0: DVec3,
    pub e1: DVec3,
    pub e2: DVec3,
    cross: DVec3,
    squared: f64,
}

impl Stage {
    /// A triangle as it stands.
    #[inline(always)]
    pub fn facet(&self, element: Element) -> Facet {
        let [p0, p1, p2] = self.corners(element);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let cross = e1.cross(e2);
        Facet {
            p0,
            e1,
            e2,
            cross,
            squared: cross.length_squared(),
        }
    }

    /// A triangle's corners in the camera frame.
    #[inline(always)]
    fn corners(&self, element: Element) -> [DVec3; 3] {
        let placed = &self.placed[element.placed as usize];
        let geometry = &self.geometries[placed.geometry];
        let packet = &geometry.packets[element.packet as usize];
        let [a, b, c] = packet.corners(usize::from(element.lane));
        let [a, b, c] = [a.as_dvec3(), b.as_dvec3(), c.as_dvec3()];
        if placed.object_id.is_none() {
            return [a, b, c];
        }
        let place = |p| placed.camera_from_mesh.transform_point3(p);
        [place(a), place(b), place(c)]
    }
}

impl Facet {
    /// Twice its area, mm².
    #[inline(always)]
    pub fn double_area(&self) -> f64 {
        self.squared.sqrt()
    }

    /// Unit normal of the front; `mirrored` if its mesh is placed so.
    #[inline(always)]
    pub fn normal(&self, mirrored: bool) -> Vec3 {
        let outward = if mirrored { -1.0 } else { 1.0 };
        (self.cross * (outward / self.double_area())).as_vec3a()
    }

    /// A place, by the weights of the second and third corner.
    #[inline(always)]
    pub fn place(&self, [b1, b2]: [f64; 2]) -> DVec3 {
        self.p0 + b1 * self.e1 + b2 * self.e2
    }

    /// Weights of the second and third corner where the ray meets the triangle, moved into it where rounding left it.
    #[inline(always)]
    pub fn barycentric(&self, ray: &Ray) -> [f64; 2] {
        let Self {
            p0,
            e1,
            e2,
            cross: n,
            squared,
        } = *self;
        let t = n.dot(p0 - ray.origin_mm) / n.dot(ray.direction);
        let q = ray.origin_mm + t * ray.direction - p0;
        let inverse = 1.0 / squared;
        // A ray along the plane makes t infinite and these NaN: then the first corner serves.
        let within = |x: f64| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let b1 = within(n.dot(q.cross(e2)) * inverse);
        let b2 = within(n.dot(e1.cross(q)) * inverse);
        let over = b1 + b2;
        if over > 1.0 {
            return [b1 / over, b2 / over];
        }
        [b1, b2]
    }
}

/// Weights of the second and third corner for a point (s, t) of the unit square, evenly over the area.
#[inline(always)]
pub(super) fn even_weights([s, t]: [f32; 2]) -> [f64; 2] {
    let root = f64::from(s).sqrt();
    [root * (1.0 - f64::from(t)), root * f64::from(t)]
}
