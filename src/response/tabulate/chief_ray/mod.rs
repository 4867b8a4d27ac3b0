//! The lens shift that each chief ray needs (section 2.1.4 of Chataignier et al., Opt. Express 27, 30486 (2019)): the
//! sub-pixels share the light of its cone equally.
//!
//! With the sub-pixels' centres x_i (in parts of the pitch) and P_i averaged over the cone, the shift s solves
//! `Σ P_i x_i = 0, Σ P_i y_i = 0`: left and right halves equal, and top and bottom. The cone is a disk of radius 1/(2F)
//! in (u, v) about the chief ray (there `du dv = cos θ dΩ`, the irradiance). An axis that is not parted takes the
//! moving frame's shift.

use rayon::prelude::*;

use crate::em::light::{PixelSolver, direction_cosines};
use crate::progress::Progress;
use crate::response::chief_ray_shifts::fold_deg;
use crate::response::{AngularResponse, ChiefRayShifts, ResponseError};
use crate::sensor::{MovingFrame, Subpixels};

/// Directions of the cone, in radii.
const CONE: [[f64; 2]; 13] = {
    const A: f64 = 0.45;
    const B: f64 = 0.9;
    [
        [0.0, 0.0],
        [A, 0.0],
        [-A, 0.0],
        [0.0, A],
        [0.0, -A],
        [A, A],
        [A, -A],
        [-A, A],
        [-A, -A],
        [B, 0.0],
        [-B, 0.0],
        [0.0, B],
        [0.0, -B],
    ]
};
/// Directions of the cone beyond are left out: no model is to be trusted there.
const LARGEST_SINE: f64 = 0.94;
/// Imbalance at which a shift is accepted.
const BALANCED: f64 = 1e-4;
const MOST_STEPS: usize = 20;

/// What is asked of a pixel: P of every sub-pixel for light from (u, v) under several shifts.
type Shares<'a> = dyn Fn([f64; 2], &[[f64; 2]]) -> Result<Vec<Vec<f64>>, ResponseError> + Sync + 'a;

impl ChiefRayShifts {
    /// Those of a pixel, by simulation, at `theta_deg` (increasing, above 0, at most 60) and `azimuths` azimuths.
    ///
    /// # Errors
    /// Angles out of range, or a chief ray that no lens shift is found for.
    pub fn for_pixel(
        pixel: &dyn PixelSolver,
        cone_f_number: f64,
        theta_deg: &[f64],
        azimuths: usize,
        progress: &dyn Progress,
    ) -> Result<Self, ResponseError> {
        let shares = |[u, v]: [f64; 2], shifts: &[[f64; 2]]| {
            let all = pixel.under_shifts(u, v, shifts)?;
            Ok(all.into_iter().map(|a| a.mean.absorbed).collect())
        };
        let balance = Balance {
            subpixels: pixel.stack().subpixels,
            frame: pixel.frame()?,
            pitch_um: pixel.stack().pitch_um,
            cone_f_number,
            shares: &shares,
        };
        Self::balanced(&balance, theta_deg, azimuths, progress)
    }

    /// Those of a table of shifted lenses: every 5° up to 40°, as far as the table holds the whole cone and a shift is
    /// found: under a mosaic of filters, light that is steep enough falls on neighbours under any.
    pub(super) fn from_table(
        table: &AngularResponse,
        cone_f_number: f64,
    ) -> Result<Self, ResponseError> {
        let lookup = table.shifted_interpolator(550.0).ok_or_else(|| {
            ResponseError::value("shift_grid", "none", "a table of shifted lenses")
        })?;
        let count = table.subpixels().count();
        let shares = |[u, v]: [f64; 2], shifts: &[[f64; 2]]| {
            let one = |&shift: &[f64; 2]| {
                let mut p = vec![0f32; count];
                lookup.weights_batch(shift, &[u as f32], &[v as f32], &mut p);
                p.into_iter().map(f64::from).collect()
            };
            Ok(shifts.iter().map(one).collect())
        };
        let balance = Balance {
            subpixels: table.subpixels(),
            frame: table.frame(),
            pitch_um: table.meta().pitch_um,
            cone_f_number,
            shares: &shares,
        };
        let edge = table.axes().u.last().copied().unwrap_or(0.0);
        let reach = 0.5 / cone_f_number * CONE.iter().flatten().fold(0.0, |m: f64, c| m.max(*c));
        let theta_deg: Vec<f64> = (1..=8)
            .map(|i| 5.0 * f64::from(i))
            .take_while(|theta| *theta <= 5.0 || theta.to_radians().sin() + reach <= edge)
            .collect();
        let found = |count: usize| Self::balanced(&balance, &theta_deg[..count], 3, &());
        let farthest = (2..=theta_deg.len()).rev().find_map(|n| found(n).ok());
        farthest.map_or_else(|| found(1), Ok)
    }

    fn balanced(
        balance: &Balance,
        theta_deg: &[f64],
        azimuths: usize,
        progress: &dyn Progress,
    ) -> Result<Self, ResponseError> {
        let fold = fold_deg(balance.subpixels);
        let phi_deg = (0..azimuths).map(|i| fold * i as f64 / (azimuths.max(2) - 1) as f64);
        let mut map = Self {
            cone_f_number: balance.cone_f_number,
            theta_deg: theta_deg.to_vec(),
            phi_deg: phi_deg.collect(),
            shift_um: vec![[0.0; 2]; theta_deg.len() * azimuths],
        };
        map.check(balance.subpixels)?;
        for (i, &theta) in theta_deg.iter().enumerate() {
            for (j, &phi) in map.phi_deg.clone().iter().enumerate() {
                let [x, y] = balance.shift(theta, phi)?;
                let (sin, cos) = phi.to_radians().sin_cos();
                map.shift_um[i * azimuths + j] = [x * cos + y * sin, y * cos - x * sin];
                progress.incidences(i * azimuths + j + 1, theta_deg.len() * azimuths);
            }
        }
        Ok(map)
    }
}

/// A pixel whose lens is to be balanced.
struct Balance<'a> {
    subpixels: Subpixels,
    frame: MovingFrame,
    pitch_um: f64,
    cone_f_number: f64,
    shares: &'a Shares<'a>,
}

impl Balance<'_> {
    /// The shift at which the cone's light is shared equally, by Newton's method from the moving frame's.
    fn shift(&self, theta_deg: f64, phi_deg: f64) -> Result<[f64; 2], ResponseError> {
        let chief = direction_cosines(theta_deg, phi_deg);
        let parted = [self.subpixels.m() > 1, self.subpixels.n() > 1];
        let mut s = self.frame.shift_for_chief_ray(chief[0], chief[1]);
        let reach = 0.02 * self.pitch_um;
        for _ in 0..MOST_STEPS {
            let trial = [s, [s[0] + reach, s[1]], [s[0], s[1] + reach]];
            let off = self.imbalances(chief, &trial)?;
            let open = |a: usize| parted[a] && off[0][a].abs() > BALANCED;
            if !open(0) && !open(1) {
                return Ok(s);
            }
            let slope = |a: usize, b: usize| (off[1 + b][a] - off[0][a]) / reach;
            let step = match parted {
                [true, true] => {
                    let [[a, b], [c, d]] = [[slope(0, 0), slope(0, 1)], [slope(1, 0), slope(1, 1)]];
                    let det = a * d - b * c;
                    [
                        (d * off[0][0] - b * off[0][1]) / det,
                        (a * off[0][1] - c * off[0][0]) / det,
                    ]
                }
                [true, false] => [off[0][0] / slope(0, 0), 0.0],
                _ => [0.0, off[0][1] / slope(1, 1)],
            };
            // No further than the lobe's slope reaches.
            let most = 0.1 * self.pitch_um;
            let length = step[0].hypot(step[1]);
            let part = if length > most { most / length } else { 1.0 };
            if !length.is_finite() {
                break;
            }
            s = [s[0] - part * step[0], s[1] - part * step[1]];
        }
        Err(ResponseError::value(
            "chief ray",
            format!("{theta_deg} deg at azimuth {phi_deg}"),
            "one for which some lens shift lets the sub-pixels share its cone equally",
        ))
    }

    /// (Σ P_i x_i, Σ P_i y_i) / Σ P_i over the cone, per shift.
    fn imbalances(
        &self,
        chief: [f64; 2],
        shifts: &[[f64; 2]],
    ) -> Result<Vec<[f64; 2]>, ResponseError> {
        let radius = 0.5 / self.cone_f_number;
        let directions = CONE.map(|c| [chief[0] + radius * c[0], chief[1] + radius * c[1]]);
        let inside = directions
            .into_par_iter()
            .filter(|d| d[0].hypot(d[1]) <= LARGEST_SINE);
        let answers = inside
            .map(|d| (self.shares)(d, shifts))
            .collect::<Result<Vec<_>, _>>()?;
        let one = |k: usize| {
            let mut sums = [0.0; 3];
            for answer in &answers {
                for (i, p) in answer[k].iter().enumerate() {
                    let (x, y) = self.subpixels.centre(i);
                    for (sum, w) in sums.iter_mut().zip([1.0, x, y]) {
                        *sum += p * w;
                    }
                }
            }
            [sums[1] / sums[0], sums[2] / sums[0]]
        };
        Ok((0..shifts.len()).map(one).collect())
    }
}

#[cfg(test)]
mod tests;
