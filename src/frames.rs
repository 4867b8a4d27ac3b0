//! The frames, drawn once.
//!
//! ```text
//! camera frame (lens and scene)            pixel / sensor frame           image as stored
//!        y up                                    y up                        ┌──────▶ column = +x_sensor
//!        │                                       │                           │ B A     (sub-pixels of a 2×2 pixel:
//!        │   z (towards the sensor)              │   z (towards the scene)   │ D C      A = (+x,−y), B = (−x,−y),
//!        │  ╱                                    │  ╱                        ▼          C = (+x,+y), D = (−x,+y))
//!        └────── x right                  x ─────┘                          row = +y_sensor
//!    as the photographer sees the scene     (seen by the same photographer, x points to the left)
//! ```
//!
//! - **Camera frame**: right-handed, mm, origin at the vertex of the first surface of the prescription, z along the
//!   axis from the scene to the sensor, x to the photographer's right, y up. The scene is at z < 0: depth = −z.
//! - **Sensor frame** (origin where the axis meets the sensor): the camera frame turned
//!   by 180° about y, so z points to the scene.
//! - **Stored image**: column grows with x_sensor, row grows with y_sensor. The lens turns the image by 180°, so the
//!   stored picture is upright and not mirrored: the photographer's right is at large columns, up is at small rows.
//! - **Direction cosines** (u, v) of light that arrives at the sensor: x and y components of its travel direction in
//!   the sensor frame. Light with u > 0 comes from the photographer's right half of the pupil and falls on
//!   the sub-pixels at x_sensor > 0 (stored on the right): the **right view** R = A + C sees the right half of the
//!   pupil, the **left view** L = B + D the left half. A point nearer than the focus has x_L − x_R > 0, as for a pair
//!   of eyes. In y: T = A + B (stored above; y_sensor < 0; v < 0) sees the pupil's **upper** half, and B = C + D the
//!   lower one.

use glam::{DVec2, DVec3};

/// Sensor-frame direction or offset from camera-frame one (a turn by 180° about y; its own inverse).
#[inline]
pub fn sensor_from_camera(d: DVec3) -> DVec3 {
    DVec3::new(-d.x, d.y, -d.z)
}

/// Direction cosines (u, v) of light travelling along the unit vector `d` (camera frame, d.z > 0).
#[inline]
pub fn uv_from_camera_direction(d: DVec3) -> DVec2 {
    DVec2::new(-d.x, d.y)
}

/// Direction cosines (u, v) of the light that arrives along a ray traced backward, whose unit direction has these x and
/// y (camera frame): the light travels against it.
#[inline]
pub fn uv_from_traced_direction(x: f64, y: f64) -> (f64, f64) {
    (x, -y)
}

/// Camera-frame point of the sensor position `xy_mm` (sensor frame) on a sensor at `z_mm`.
#[inline]
pub fn camera_from_sensor_mm(xy_mm: DVec2, z_mm: f64) -> DVec3 {
    DVec3::new(-xy_mm.x, xy_mm.y, z_mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_half_of_the_pupil_sends_light_to_positive_u() {
        // From a pupil point on the photographer's right (x = +1) at z = −5 to the axis on the sensor at z = 0.
        let d = DVec3::new(-1.0, 0.0, 5.0).normalize();
        let uv = uv_from_camera_direction(d);
        assert!(uv.x > 0.0);
        assert_eq!(uv_from_traced_direction(-d.x, -d.y), (uv.x, uv.y));
    }

    #[test]
    fn sensor_frame_is_an_involution() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(sensor_from_camera(sensor_from_camera(p)), p);
        assert_eq!(
            camera_from_sensor_mm(DVec2::new(1.0, 2.0), 3.0),
            DVec3::new(-1.0, 2.0, 3.0)
        );
    }
}
