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

/// How far the microlenses stand beside where the rule puts them, along x: s = k₀ + k₁ x + k₃ x³ + k₅ x⁵, as a fit to a
/// real camera finds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MicrolensLaw {
    /// k₀, µm.
    pub um: f64,
    /// k₁, µm per mm.
    pub um_per_mm: f64,
    /// k₃, µm per mm³.
    pub um_per_mm3: f64,
    /// k₅, µm per mm⁵.
    pub um_per_mm5: f64,
    /// Where x is 0: sensor frame, mm.
    pub axis_x_mm: f64,
}

impl MicrolensLaw {
    /// At a sensor position, µm.
    #[inline]
    pub fn at_um(&self, xy_mm: DVec2) -> DVec2 {
        let x = xy_mm.x - self.axis_x_mm;
        let law = self.um_per_mm + x * x * (self.um_per_mm3 + x * x * self.um_per_mm5);
        DVec2::new(self.um + x * law, 0.0)
    }

    /// Whether every number is one.
    pub fn is_finite(&self) -> bool {
        let Self {
            um,
            um_per_mm,
            um_per_mm3,
            um_per_mm5,
            axis_x_mm,
        } = *self;
        [um, um_per_mm, um_per_mm3, um_per_mm5, axis_x_mm]
            .iter()
            .all(|k| k.is_finite())
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_law_is_odd_about_its_axis_but_for_its_constant_and_leaves_y_alone() {
        let law = MicrolensLaw {
            um: 0.1,
            um_per_mm: -0.3,
            um_per_mm3: 0.05,
            um_per_mm5: -0.01,
            axis_x_mm: 0.5,
        };
        let at = |x: f64| law.at_um(DVec2::new(x, 3.0));
        assert!((at(0.5) - DVec2::new(0.1, 0.0)).length() < 1e-12);
        // k₁ 2 + k₃ 2³ + k₅ 2⁵
        assert!((at(2.5).x - (0.1 - 0.6 + 0.4 - 0.32)).abs() < 1e-12);
        assert!((at(2.5).x + at(-1.5).x - 0.2).abs() < 1e-12);
        assert!(law.is_finite());
        let endless = MicrolensLaw {
            um_per_mm: f64::INFINITY,
            ..law
        };
        assert!(!endless.is_finite());
    }
}
