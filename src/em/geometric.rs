//! The geometric pixel (eq. 2 of Chataignier et al., Opt. Express 27, 30486 (2019)): no diffraction, no crosstalk, no
//! loss.
//!
//! The microlens brings light from (u, v) to the point `x = f u / w, y = f v / w`, `w = √(1 − u² − v²)`, of the
//! photodiode plane; the sub-pixel whose box holds the point gets all of it. So the outer edge of a 2×2 pixel's
//! sub-pixel lies at `θ_L = arctan(sub-pixel size / f)`, and R_a = 0. Light that misses the pixel is lost.
//!
//! The boxes are evaluated exactly (a sampled table would blur their edges).

use serde::{Deserialize, Serialize};

use super::light::{
    Incidence, Light, PixelSolver, Powers, SolverError, SolverProgress, SolverTask,
};
use super::{PixelStack, light};
use crate::range::{OutOfRange, require};
use crate::sensor::{MovingFrame, Subpixels, by_count, check_simulated};

/// Name and version of the model: part of every table's key.
pub(super) const MODEL: &str = "geometric-1";

/// The ideal pixel: one box per sub-pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometricResponse {
    subpixels: Subpixels,
    pitch_um: f64,
    focal_length_um: f64,
}

impl GeometricResponse {
    /// Pitch and microlens focal length (in air) in µm.
    ///
    /// # Errors
    /// Lengths that are not positive and finite, or a partition that is not simulated.
    pub fn new(
        subpixels: Subpixels,
        pitch_um: f64,
        focal_length_um: f64,
    ) -> Result<Self, OutOfRange> {
        check_simulated("response", subpixels)?;
        for (field, value) in [("pitch_um", pitch_um), ("focal_length_um", focal_length_um)] {
            require(value > 0.0 && value.is_finite(), || {
                OutOfRange::new("response", field, value, "finite and > 0")
            })?;
        }
        Ok(Self {
            subpixels,
            pitch_um,
            focal_length_um,
        })
    }

    /// The microlens whose F-number is the main lens's: f = pitch × F-number, so that the pupil fills the pixel.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn matched_to_f_number(
        subpixels: Subpixels,
        pitch_um: f64,
        f_number: f64,
    ) -> Result<Self, OutOfRange> {
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

    /// The weights of one direction (see [`crate::response::Interpolator::weights`]).
    pub fn weights(&self, u: f32, v: f32, out: &mut [f32]) {
        if let Some(out) = out.get_mut(..self.subpixels.count()) {
            self.weights_batch(&[u], &[v], out);
        }
    }

    /// The weights of many directions: `out` is `[direction][sub-pixel]`. The shortest of the three slices counts.
    pub fn weights_batch(&self, u: &[f32], v: &[f32], out: &mut [f32]) {
        by_count!(self.subpixels.count(), self.batch(u, v, out));
    }

    /// The weights averaged over a bundle of directions: a square cell of `spread` in slope (tan θ) around each. What
    /// sums few directions over a smooth measure errs by the square of the cell, not by which side of an edge each
    /// direction lies on.
    pub fn weights_spread(&self, u: &[f32], v: &[f32], spread: f64, out: &mut [f32]) {
        let (m, n) = (self.subpixels.m(), self.subpixels.n());
        let f = self.focal_length_um / self.pitch_um;
        let (width, height) = (f * spread * m as f64, f * spread * n as f64);
        // The part of a cell around x of a width that lies in sub-pixel k of a row.
        let part = |x: f64, width: f64, k: usize| {
            let (low, high) = (x - 0.5 * width, x + 0.5 * width);
            ((high.min(k as f64 + 1.0) - low.max(k as f64)) / width).max(0.0)
        };
        for ((&u, &v), out) in u.iter().zip(v).zip(out.chunks_exact_mut(m * n)) {
            let (u, v) = (f64::from(u), f64::from(v));
            let c = f / (1.0 - u * u - v * v).max(1e-12).sqrt();
            let (x, y) = ((u * c + 0.5) * m as f64, (v * c + 0.5) * n as f64);
            for (k, p) in out.iter_mut().enumerate() {
                *p = (part(x, width, k % m) * part(y, height, k / m)) as f32;
            }
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

/// The geometric pixel as a solver.
pub(super) struct GeometricSolver {
    stack: PixelStack,
    pixel: GeometricResponse,
    wavelength_nm: [f64; 1],
}

impl GeometricSolver {
    /// # Errors
    /// A pixel that cannot be, a mosaic or a table of lens shifts (with the reason), or a focal length that is not
    /// positive.
    pub fn new(
        task: &SolverTask,
        wavelength_nm: f64,
        focal_length_um: f64,
    ) -> Result<Self, SolverError> {
        let stack = task.stack;
        stack.check()?;
        if stack.mosaic.is_some() {
            let allowed = "none in the geometric model, which has no neighbours";
            return Err(SolverError::value("mosaic", "there", allowed));
        }
        if task.any_shift {
            let allowed =
                "a wave-optical one; a shifted geometric pixel is exact in its moving frame";
            return Err(SolverError::value("model", "geometric", allowed));
        }
        Ok(Self {
            stack: stack.clone(),
            pixel: GeometricResponse::new(stack.subpixels, stack.pitch_um, focal_length_um)?,
            wavelength_nm: [wavelength_nm],
        })
    }
}

impl PixelSolver for GeometricSolver {
    fn stack(&self) -> &PixelStack {
        &self.stack
    }

    fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    fn light(
        &self,
        waves: &[Incidence],
        _: usize,
        _: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        light::by_direction(waves, |[u, v], shifts_um| {
            let mut p = vec![0f32; self.pixel.subpixels().count()];
            self.pixel.weights(u as f32, v as f32, &mut p);
            let absorbed: Vec<f64> = p.into_iter().map(f64::from).collect();
            let light = Light {
                mean: Powers {
                    elsewhere: 1.0 - absorbed.iter().sum::<f64>(),
                    absorbed,
                    ..Powers::default()
                },
                ..Light::default()
            };
            Ok(vec![light; shifts_um.len()])
        })
    }

    fn frame(&self) -> Result<MovingFrame, SolverError> {
        Ok(self.pixel.frame())
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

    #[test]
    fn a_cell_of_directions_has_the_mean_of_their_weights() {
        let g = GeometricResponse::new(Subpixels::QUAD, 3.5, 6.0).unwrap();
        let spread = 0.2;
        let uv = |x: f64, y: f64| {
            let w = (1.0 + x * x + y * y).sqrt();
            ((x / w) as f32, (y / w) as f32)
        };
        // On a corner of four, on an outer edge, within one, outside.
        for (x, y) in [(0.03, -0.05), (0.25, 0.1), (0.15, 0.15), (0.45, 0.0)] {
            const SIDE: usize = 400;
            let (mut sum, mut p) = ([0f64; 4], [0f32; 4]);
            let at = |k: usize| spread * ((k as f64 + 0.5) / SIDE as f64 - 0.5);
            for k in 0..SIDE * SIDE {
                let (u, v) = uv(x + at(k % SIDE), y + at(k / SIDE));
                g.weights(u, v, &mut p);
                (sum.iter_mut().zip(&p)).for_each(|(s, &p)| *s += f64::from(p));
            }
            let (u, v) = uv(x, y);
            g.weights_spread(&[u], &[v], spread, &mut p);
            for (s, p) in sum.iter().zip(&p) {
                let mean = s / (SIDE * SIDE) as f64;
                assert!((mean - f64::from(*p)).abs() < 0.006, "{x} {y}: {mean} {p}");
            }
        }
    }
}
