//! What the sensor's window sees: the directions of its middle and edges, in which generators place their objects.

use super::error::SceneError;
use glam::{DMat3, DVec2, DVec3};
use quadpixel::lens::trace_backward;
use quadpixel::render::Camera;
use quadpixel::spectrum::ChannelWavelengths;

use crate::scenes::field_of_view::middle_ray;

/// The cone of a window. Depths are −z of the camera frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Slopes (x/depth, y/depth) of the middle.
    middle: DVec2,
    /// Half the width and height, in slopes.
    pub half: DVec2,
}

impl View {
    /// Traces the middles of the window and of its four edges.
    pub fn from_camera(camera: &Camera) -> Result<Self, SceneError> {
        let window = camera.sensor().window_mm();
        let system = camera.system(ChannelWavelengths::REFERENCE);
        let slope = |x: f64, y: f64| {
            let place = window.centre + DVec2::new(x * window.half_width, y * window.half_height);
            middle_ray(camera, place)
                .and_then(|ray| trace_backward(system, ray).ok())
                .map(|ray| ray.direction.truncate() / -ray.direction.z)
                .ok_or(SceneError::Dark)
        };
        let across = slope(1.0, 0.0)? - slope(-1.0, 0.0)?;
        let down = slope(0.0, 1.0)? - slope(0.0, -1.0)?;
        Ok(Self {
            middle: slope(0.0, 0.0)?,
            half: 0.5 * DVec2::new(across.x.abs(), down.y.abs()),
        })
    }

    /// The point at a depth, at (x, y) from −1 to 1 across the view (x right, y up).
    pub fn at(&self, x: f64, y: f64, depth_mm: f64) -> DVec3 {
        let slope = self.middle + self.half * DVec2::new(x, y);
        DVec3::new(slope.x * depth_mm, slope.y * depth_mm, -depth_mm)
    }

    /// Half the narrower side of the view at a depth, mm.
    pub fn reach_mm(&self, depth_mm: f64) -> f64 {
        self.half.min_element() * depth_mm
    }

    /// The turn that faces the camera from the middle of the view.
    pub fn facing(&self) -> DMat3 {
        let z = -self.at(0.0, 0.0, 1.0).normalize();
        let x = DVec3::Y.cross(z).normalize();
        DMat3::from_cols(x, z.cross(x), z)
    }
}
