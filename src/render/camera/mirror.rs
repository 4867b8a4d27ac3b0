//! Whether a camera is its own mirror image.

use glam::DVec2;

use super::{Camera, Pupils};
use crate::sensor::{MicrolensLaw, MicrolensShifts};

impl Camera {
    /// Whether the window stands on the axis and lens, microlenses and pixel are the same in a mirror along either of
    /// its middle lines: what a place sees is then the mirror image of what the mirrored place sees.
    pub fn is_mirrored(&self) -> bool {
        let pupils = match &self.pupils {
            Pupils::ByField(_) => true,
            Pupils::Fixed(ellipse) => {
                let (a, b) = (ellipse.axis_a_mm, ellipse.axis_b_mm);
                ellipse.centre_mm.truncate() == DVec2::ZERO && a.y == 0.0 && b.x == 0.0
            }
        };
        let microlenses = !matches!(self.shifts, MicrolensShifts::Constant { .. })
            && self.microlens_law == MicrolensLaw::default()
            && self.microlens_offset_um == DVec2::ZERO;
        self.sensor.window_mm().is_on_axis()
            && pupils
            && microlenses
            && self.systems.iter().all(|system| system.is_rotational())
            && self.colours.responses().all(|r| r.is_mirrored())
    }
}
