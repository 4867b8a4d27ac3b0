//! Where the rays of a pixel start and what they are aimed at.

use glam::{DVec2, DVec3};

use super::camera::Camera;
use crate::frames::camera_from_sensor_mm;
use crate::lens::PupilEllipse;
use crate::sampling::hash;

/// The pixel's own data that its rays share.
pub(super) struct PixelAim {
    pub position_mm: DVec2,
    pub pupil: PupilEllipse,
    pub shift_um: DVec2,
    pub key: u64,
}

impl PixelAim {
    /// The aim of pixel (column, row); `None` where the lens lets no light through.
    pub fn new(camera: &Camera, seed: u64, column: usize, row: usize) -> Option<Self> {
        let position_mm = camera.sensor().position_mm(column as f64, row as f64);
        Some(Self {
            position_mm,
            pupil: camera.pupil_at(position_mm)?,
            shift_um: camera.shift_at_um(position_mm),
            key: hash(seed, &[column as u64, row as u64]),
        })
    }
}

/// Origin of the ray through the middle of a pixel, camera frame, mm.
pub(super) fn pixel_origin_mm(camera: &Camera, column: f64, row: f64) -> DVec3 {
    camera_from_sensor_mm(
        camera.sensor().position_mm(column, row),
        camera.sensor_z_mm(),
    )
}
