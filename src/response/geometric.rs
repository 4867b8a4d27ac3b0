//! The geometric pixel (eq. 2 of Chataignier et al., Opt. Express 27, 30486 (2019)): no diffraction, no crosstalk, no loss.
//!
//! The microlens brings light from (u, v) to the point `x = f u / w, y = f v / w`, `w = √(1 − u² − v²)`, of the photodiode
//! plane; the sub-pixel whose box holds the point gets all of it. So the outer edge of a 2×2 pixel's
//! sub-pixel lies at `θ_L = arctan(sub-pixel size / f)`, and R_a = 0. Light that misses the pixel is lost.
//!
//! The boxes are evaluated exactly (a sampled table would blur their edges).

use serde::{Deserialize, Serialize};

use super::{MovingFrame, ResponseError};
use crate::sensor::Subpixels;

/// The ideal pixel: a box a sub-pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometricResponse {
    subpixels: Subpixels,
    pitch_um: f64,
    focal_length_um: f64,
}

impl GeometricResponse {
    /// Pitch and microlens focal length (in air) in µm, both > 0.
    pub fn new(
        subpixels: Subpixels,
        pitch_um: f64,
        focal_length_um: f64,
    ) -> Result<Self, ResponseError> {
        for (field, value) in [("pitch_um", pitch_um), ("focal_length_um", focal_length_um)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ResponseError::value(field, value, "finite and > 0"));
            }
        }
        Ok(Self {
            subpixels,
            pitch_um,
            focal_length_um,
        })
    }

    /// The microlens whose F-number is the main lens's: f = pitch × F-number, so that the pupil fills the pixel.
    pub fn matched_to_f_number(
        subpixels: Subpixels,
        pitch_um: f64,
        f_number: f64,
    ) -> Result<Self, ResponseError> {
        Self::new(subpixels, pitch_um, pitch_um * f_number)
    }

    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }
    /// Pitch in µm.
    pub fn pitch_um(&self) -> f64 {
        self.pitch_um
    }
    /// Focal length of the microlens in µm.
    pub fn focal_length_um(&self) -> f64 {
        self.focal_length_um
    }
    /// A lens shift moves the boxes exactly as [`MovingFrame`] says, with n = 1 and H = f.
    pub fn frame(&self) -> MovingFrame {
        MovingFrame {
            index: 1.0,
            height_um: self.focal_length_um,
        }
    }

    /// The weights of one direction (see [`super::Interpolator::weights`]).
    pub fn weights(&self, u: f32, v: f32, out: &mut [f32]) {
        if let Some(out) = out.get_mut(..self.subpixels.count()) {
            self.weights_batch(&[u], &[v], out);
        }
    }

    /// The weights of many directions: `out` is `[direction][sub-pixel]`. The shortest of the three slices counts.
    pub fn weights_batch(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        match self.subpixels.count() {
            1 => self.batch::<1>(u, v, out),
            2 => self.batch::<2>(u, v, out),
            4 => self.batch::<4>(u, v, out),
            9 => self.batch::<9>(u, v, out),
            _ => self.batch::<16>(u, v, out),
        }
    }

    #[inline]
    fn batch<const N: usize>(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        let (out, _) = out.as_chunks_mut::<N>();
        let (m, n) = (self.subpixels.m() as f32, self.subpixels.n() as f32);
        let f = (self.focal_length_um / self.pitch_um) as f32;
        for ((&u, &v), out) in u.iter().zip(v).zip(out) {
            let c = f / (1.0 - u * u - v * v).max(1e-12).sqrt();
            // Place in the pixel, in sub-pixels from its corner.
            let (x, y) = ((u * c + 0.5) * m, (v * c + 0.5) * n);
            let inside = x >= 0.0 && x < m && y >= 0.0 && y < n;
            let hit = (y as usize * self.subpixels.m()) + x as usize;
            for (k, p) in out.iter_mut().enumerate() {
                *p = f32::from(inside && k == hit);
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn acceptance_ends_at_the_angle_of_equation_2() {
        let g = GeometricResponse::matched_to_f_number(Subpixels::QUAD, 3.5, 1.8).unwrap();
        let limit = (1.75f64 / (3.5 * 1.8)).atan();
        let mut p = [0.0; 4];
        // φ = 315°: aimed at A = index 1; the box ends where the x coordinate does.
        for (angle, wanted) in [
            (0.5 * limit, 1.0),
            (0.999 * limit, 1.0),
            (1.001 * limit, 0.0),
        ] {
            let t = angle.tan();
            let w = (1.0 + t * t + 1e-4).sqrt();
            g.weights((t / w) as f32, (-1e-2 / w) as f32, &mut p);
            assert_eq!(p, [0.0, wanted, 0.0, 0.0], "at {angle} rad");
        }
    }
}
