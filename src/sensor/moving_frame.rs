//! The moving frame: what a shift of the microlens does to the response, to first order.
//!
//! Inside the stack a wave from (u, v) has the slope `t = (u, v) / √(n² − u² − v²)` and lands near `s + H t`, where `s`
//! is the shift of the lens. So a lens shifted by s answers like the centred one at the slope
//! `t' = t + s / H`, that is at `(u', v') = n t' / √(1 + |t'|²)`.
//!
//! n: index between lens and silicon; H (µm): effective height, lens to silicon. First order only: the shifted lens's
//! lobe also changes its shape a little. Against the wave model of the shifted 2.8 µm pixel, over an F/2 cone about the
//! chief ray, it is off by 1.9 % (rms, of the peak) at a chief ray of 10° and by 3.5 % at 20°; ignoring the shift costs
//! 22 % and 39 %. Tables at several shifts ([`crate::response::ResponseAxes`] has the axis) are for better
//! interpolation.

use serde::{Deserialize, Serialize};

use crate::range::{OutOfRange, require};

/// Index and effective height behind the microlens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovingFrame {
    /// Index n between lens and silicon (1 for the geometric pixel).
    pub index: f64,
    /// Effective height H in µm.
    pub height_um: f64,
}

impl MovingFrame {
    /// Index n and height H; that of a pixel is [`crate::em::PixelStack::moving_frame`].
    ///
    /// # Errors
    /// An index outside 1 to 10, or a height that is not positive and finite.
    pub fn new(index: f64, height_um: f64) -> Result<Self, OutOfRange> {
        require((1.0..10.0).contains(&index), || {
            OutOfRange::new("response", "frame.index", index, "1 to 10")
        })?;
        require(height_um > 0.0 && height_um.is_finite(), || {
            OutOfRange::new("response", "frame.height_um", height_um, "finite and > 0")
        })?;
        Ok(Self { index, height_um })
    }

    /// Direction cosines at which the centred response is to be read for light from (u, v) under a lens shifted by
    /// `shift_um`.
    #[inline]
    pub fn centred_uv(&self, u: f32, v: f32, shift_um: [f64; 2]) -> (f32, f32) {
        let n = self.index as f32;
        let h = 1.0 / self.height_um;
        self.shifted(u, v, n, (shift_um[0] * h) as f32, (shift_um[1] * h) as f32)
    }

    /// [`Self::centred_uv`] of many rays under one lens, in place. Slices of equal length (the shorter one counts).
    pub fn centred_batch(&self, shift_um: [f64; 2], u: &mut [f32], v: &mut [f32]) {
        if shift_um == [0.0, 0.0] {
            return;
        }
        let n = self.index as f32;
        let h = 1.0 / self.height_um;
        let (a, b) = ((shift_um[0] * h) as f32, (shift_um[1] * h) as f32);
        for (u, v) in u.iter_mut().zip(v) {
            (*u, *v) = self.shifted(*u, *v, n, a, b);
        }
    }

    #[inline]
    fn shifted(&self, u: f32, v: f32, n: f32, a: f32, b: f32) -> (f32, f32) {
        // A floor keeps directions at and beyond grazing finite when n = 1.
        let w = 1.0 / (n * n - u * u - v * v).max(1e-6).sqrt();
        let (tx, ty) = (u * w + a, v * w + b);
        let c = n / (1.0 + tx * tx + ty * ty).sqrt();
        (tx * c, ty * c)
    }

    /// Shift (µm) that brings the chief ray from (u_c, v_c) to the pixel's centre: s = −H t_c.
    pub fn shift_for_chief_ray(&self, u_c: f64, v_c: f64) -> [f64; 2] {
        let w = (self.index * self.index - u_c * u_c - v_c * v_c)
            .max(1e-6)
            .sqrt();
        [-self.height_um * u_c / w, -self.height_um * v_c / w]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chief_ray_is_read_at_the_centre_under_its_own_shift() {
        let f = MovingFrame {
            index: 1.5,
            height_um: 3.0,
        };
        let s = f.shift_for_chief_ray(0.3, -0.2);
        let (u, v) = f.centred_uv(0.3, -0.2, s);
        assert!(u.abs() < 1e-6 && v.abs() < 1e-6);
        let (u, v) = f.centred_uv(0.4, 0.1, [0.0, 0.0]);
        assert!((u - 0.4).abs() < 1e-6 && (v - 0.1).abs() < 1e-6);
    }
}
