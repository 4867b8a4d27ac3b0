//! How far each microlens is shifted from the centre of its pixel, so that the chief ray stays between the sub-pixels.
//!
//! Light of slope t = (u, v)/√(n² − u² − v²) behind a lens centred at s lands at s + H t above the photodiodes (n and H
//! of [`MovingFrame`]). The chief ray lands in the middle when s = −H t_chief: towards the axis.

use glam::DVec2;

use super::MovingFrame;
use crate::field::FieldGrid;

/// The rule by which the microlenses are shifted.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case", tag = "rule", deny_unknown_fields)]
pub enum ShiftRule {
    /// Every microlens over the middle of its pixel.
    Centred,
    /// Shift proportional to the distance from the axis and towards it.
    Linear {
        /// Shift in µm per mm of image height.
        um_per_mm: f64,
    },
    /// The shift that centres the main lens's own chief ray on each pixel: as the response's table says, where it holds
    /// shifts found for chief rays, else to first order (moving frame).
    ChiefRay,
}

/// The microlens shift at each place of the sensor.
#[derive(Clone, Debug)]
pub enum MicrolensShifts {
    /// No shift anywhere.
    Centred,
    /// Alike everywhere.
    Constant {
        /// (s_x, s_y), µm.
        shift_um: DVec2,
    },
    /// Proportional to the position, towards the axis.
    Linear {
        /// Shift in µm per mm of image height.
        um_per_mm: f64,
    },
    /// Found for the chief rays of the window ([`ChiefRayShifts`](crate::response::ChiefRayShifts)), in µm.
    Found {
        /// (s_x, s_y).
        shift_um: FieldGrid,
    },
    /// From the chief ray's direction cosines (u, v) over the window.
    ChiefRay {
        /// Direction cosines of the chief ray.
        chief_uv: FieldGrid,
        /// Where light lands behind the microlens.
        frame: MovingFrame,
    },
}

impl MicrolensShifts {
    /// Shift (x, y) in µm of the microlens at `xy_mm` (sensor frame).
    #[inline]
    pub fn at_um(&self, xy_mm: DVec2) -> DVec2 {
        match self {
            Self::Centred => DVec2::ZERO,
            Self::Constant { shift_um } => *shift_um,
            Self::Linear { um_per_mm } => -xy_mm * *um_per_mm,
            Self::Found { shift_um } => {
                let mut shift = [0.0; 2];
                shift_um.sample(xy_mm, &mut shift);
                DVec2::from(shift)
            }
            Self::ChiefRay { chief_uv, frame } => {
                let mut uv = [0.0; 2];
                chief_uv.sample(xy_mm, &mut uv);
                DVec2::from(frame.shift_for_chief_ray(uv[0], uv[1]))
            }
        }
    }
}
