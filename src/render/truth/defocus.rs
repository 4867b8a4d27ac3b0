//! Paraxial defocus: where depth D is imaged, and how large its blur is on the sensor.
//!
//! Newton's equation, camera frame: z′ = z_F′ + f²/(z_F + D) for an object at z = −D. With the exit pupil at z_p,
//! semi-diameter a, and the sensor at z_s: s′ = z′ − z_p, D_xp = z_s − z_p. A ray through the pupil height P lands P
//! (z′ − z_s)/s′ beside the image. In terms of slopes at the sensor (m = −P/D_xp relative to the chief ray's) that is m
//! · lever, lever = D_xp (z_s − z′)/s′.

//!
//! z_s is the paraxial image of the focused depth, so that both are zero there. The real sensor may stand beside it by
//! the small shift with which the lens's designer balanced its aberrations; what that does to a point counts as
//! aberration.

use crate::lens::Paraxial;
use crate::render::Camera;

/// Paraxial defocus of a focused camera, reference wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defocus {
    focal_length_mm: f64,
    front_focus_z_mm: f64,
    rear_focus_z_mm: f64,
    pupil_z_mm: f64,
    pupil_semi_mm: f64,
    sensor_z_mm: f64,
}

impl Defocus {
    /// From the camera's paraxial data; `None` for bare pixels, which have no focus.
    pub fn new(camera: &Camera) -> Option<Self> {
        Some(Self::of_focused(
            camera.paraxial()?,
            camera.focus_distance_mm(),
        ))
    }

    /// Of a lens that is focused at a depth, mm.
    pub fn of_focused(lens: &Paraxial, focus_mm: f64) -> Self {
        let mut defocus = Self::of_lens(lens);
        defocus.sensor_z_mm = defocus.image_z_mm(focus_mm);
        defocus
    }

    /// In the middle of a channel's band, on the sensor of the reference wavelength.
    pub fn for_channel(camera: &Camera, channel: usize) -> Option<Self> {
        Some(Self {
            sensor_z_mm: Self::new(camera)?.sensor_z_mm,
            ..Self::of_lens(camera.channel_paraxial(channel)?)
        })
    }

    fn of_lens(p: &Paraxial) -> Self {
        Self {
            focal_length_mm: p.efl_mm,
            front_focus_z_mm: p.front_focal_z_mm,
            rear_focus_z_mm: p.rear_principal_z_mm + p.efl_mm,
            pupil_z_mm: p.exit_pupil_z_mm,
            pupil_semi_mm: p.exit_pupil_semi_mm,
            sensor_z_mm: 0.0,
        }
    }

    /// Depth that is imaged on the sensor, mm; +∞ for infinity and beyond.
    pub fn focused_depth_mm(&self) -> f64 {
        let behind = self.sensor_z_mm - self.rear_focus_z_mm;
        let depth = self.focal_length_mm * self.focal_length_mm / behind - self.front_focus_z_mm;
        if behind > 0.0 { depth } else { f64::INFINITY }
    }

    /// z of the image of depth `depth_mm` (+∞ allowed), mm.
    pub fn image_z_mm(&self, depth_mm: f64) -> f64 {
        self.rear_focus_z_mm
            + self.focal_length_mm * self.focal_length_mm / (self.front_focus_z_mm + depth_mm)
    }

    /// Displacement on the sensor per unit of slope relative to the chief ray, mm.
    pub fn lever_mm(&self, depth_mm: f64) -> f64 {
        // D_xp/s′ = 1/(1 + (z′ − z_s)/D_xp) stays finite for a pupil at infinity.
        let behind = self.image_z_mm(depth_mm) - self.sensor_z_mm;
        -behind / (1.0 + behind / (self.sensor_z_mm - self.pupil_z_mm))
    }

    /// Signed diameter of the circle of confusion, mm: positive for points behind the focus (farther than it).
    pub fn circle_of_confusion_mm(&self, depth_mm: f64) -> f64 {
        self.pupil_slope() * self.lever_mm(depth_mm)
    }

    /// Depth of a signed circle of confusion, mm, in front of the lens; `None` where no depth has it.
    pub fn depth_of_coc_mm(&self, coc_mm: f64) -> Option<f64> {
        // lever = −b/(1 + b/D), b how far the image lies behind the sensor and D the pupil's distance.
        let lever = coc_mm / self.pupil_slope();
        let behind = -lever / (1.0 + lever / (self.sensor_z_mm - self.pupil_z_mm));
        let beyond_focus = self.sensor_z_mm + behind - self.rear_focus_z_mm;
        let depth =
            self.focal_length_mm * self.focal_length_mm / beyond_focus - self.front_focus_z_mm;
        (beyond_focus > 0.0 && depth > 0.0).then_some(depth)
    }

    /// From the exit pupil to z_s, mm.
    pub fn pupil_distance_mm(&self) -> f64 {
        self.sensor_z_mm - self.pupil_z_mm
    }

    /// Slope that the exit pupil's diameter spans, seen from the sensor: diameter over distance.
    pub fn pupil_slope(&self) -> f64 {
        2.0 * self.pupil_semi_mm / self.pupil_distance_mm()
    }
}
