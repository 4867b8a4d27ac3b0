//! The lens shift that each chief ray needs (section 2.1.4 of Chataignier et al., Opt. Express 27, 30486 (2019)): the sub-pixels share the
//! light of its cone equally.
//!
//! With the sub-pixels' centres x_i (in parts of the pitch) and P_i averaged over the cone, the shift s solves
//! `Σ P_i x_i = 0, Σ P_i y_i = 0`: left and right halves equal, and top and bottom. The cone is a disk of radius 1/(2F) in (u, v)
//! about the chief ray (there `du dv = cos θ dΩ`, the irradiance). An axis that is not parted takes the moving frame's shift.
//!
//! s is kept in parts along and across the azimuth φ of the chief ray, over sin θ and φ: the one is even, the other odd about
//! every mirror axis of the pixel, so cosine and sine series in φ have no wrap and no kink, and cubics in sin θ none either. Beyond
//! the last θ the shift of the last one is taken and said to be so.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{AngularResponse, MovingFrame, ResponseError, ShiftedPixel, direction_cosines};
use crate::sensor::Subpixels;

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

/// Which shift each chief ray needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChiefRayShifts {
    /// F-number of the cone.
    pub cone_f_number: f64,
    /// Chief-ray angles θ in degrees, increasing, above 0; the shift at 0 is 0.
    pub theta_deg: Vec<f64>,
    /// Azimuths φ in degrees, regular from 0 to the first mirror axis: 45 of a square pixel, else 90.
    pub phi_deg: Vec<f64>,
    /// `[θ][φ]`: shift in µm along (negative: towards the lens's axis) and across the azimuth.
    pub shift_um: Vec<[f64; 2]>,
}

/// A shift that was looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundShift {
    /// (s_x, s_y) in µm.
    pub shift_um: [f64; 2],
    /// Whether the chief ray lay beyond the last θ, whose shift this is.
    pub clamped: bool,
}

/// What is asked of a pixel: P of every sub-pixel for light from (u, v) under several shifts.
type Shares<'a> = dyn Fn([f64; 2], &[[f64; 2]]) -> Result<Vec<Vec<f64>>, ResponseError> + Sync + 'a;

impl ChiefRayShifts {
    /// Of a pixel model, by simulation, at `theta_deg` (increasing, above 0, at most 60) and `azimuths` azimuths.
    pub fn of_pixel(
        pixel: &ShiftedPixel,
        cone_f_number: f64,
        theta_deg: &[f64],
        azimuths: usize,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, ResponseError> {
        let shares = |[u, v]: [f64; 2], shifts: &[[f64; 2]]| {
            let all = pixel.light(u, v, shifts)?;
            Ok(all.into_iter().map(|a| a.mean.absorbed).collect())
        };
        let balance = Balance {
            subpixels: pixel.subpixels(),
            frame: pixel.frame()?,
            pitch_um: pixel.pitch_um(),
            cone_f_number,
            shares: &shares,
        };
        Self::found(&balance, theta_deg, azimuths, progress)
    }

    /// Of a table of shifted lenses: every 5° up to 40°, as far as the table holds the whole cone.
    pub(super) fn of_table(
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
        Self::found(&balance, &theta_deg, 3, &|_, _| ())
    }

    fn found(
        balance: &Balance,
        theta_deg: &[f64],
        azimuths: usize,
        progress: &(dyn Fn(usize, usize) + Sync),
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
                progress(i * azimuths + j + 1, theta_deg.len() * azimuths);
            }
        }
        Ok(map)
    }

    /// Ranges and lengths.
    pub fn check(&self, subpixels: Subpixels) -> Result<(), ResponseError> {
        let t = &self.theta_deg;
        let increasing = t.windows(2).all(|t| t[1] > t[0]);
        if t.is_empty() || !increasing || t.iter().any(|t| !(*t > 0.0 && *t <= 60.0)) {
            let allowed = "at least one, above 0, increasing, at most 60";
            return Err(ResponseError::value(
                "chief_ray_shifts.theta_deg",
                format!("{t:?}"),
                allowed,
            ));
        }
        let (n, fold) = (self.phi_deg.len(), fold_deg(subpixels));
        let regular =
            |(i, phi): (usize, &f64)| (phi - fold * i as f64 / (n.max(2) - 1) as f64).abs() < 1e-9;
        if n < 2 || !self.phi_deg.iter().enumerate().all(regular) {
            return Err(ResponseError::value(
                "chief_ray_shifts.phi_deg",
                format!("{:?}", self.phi_deg),
                "at least two, regular from 0 to the first mirror axis (45 of a square pixel, else 90)",
            ));
        }
        let finite = self.shift_um.iter().flatten().all(|s| s.is_finite());
        if !finite || self.shift_um.len() != n * t.len() {
            return Err(ResponseError::value(
                "chief_ray_shifts.shift_um",
                self.shift_um.len(),
                "a finite pair for every θ and φ",
            ));
        }
        if !(0.8..=32.0).contains(&self.cone_f_number) {
            return Err(ResponseError::value(
                "chief_ray_shifts.cone_f_number",
                self.cone_f_number,
                "0.8 to 32",
            ));
        }
        Ok(())
    }

    /// The shift for a chief ray that arrives along (u, v).
    pub fn at(&self, u: f64, v: f64) -> FoundShift {
        let sine = u.hypot(v);
        if sine == 0.0 {
            return FoundShift {
                shift_um: [0.0, 0.0],
                clamped: false,
            };
        }
        let last = self.theta_deg[self.theta_deg.len() - 1].to_radians().sin();
        let mut nodes = vec![(0.0, [0.0; 2])];
        let phi = v.atan2(u);
        for (i, theta) in self.theta_deg.iter().enumerate() {
            nodes.push((theta.to_radians().sin(), self.around(i, phi)));
        }
        let [along, across] = odd_cubic(&nodes, sine.min(last));
        let (c, s) = (u / sine, v / sine);
        FoundShift {
            shift_um: [along * c - across * s, along * s + across * c],
            clamped: sine > last * (1.0 + 1e-12),
        }
    }

    /// Along and across the azimuth at the i-th θ: a cosine and a sine series through the nodes of φ.
    fn around(&self, i: usize, phi: f64) -> [f64; 2] {
        let n = self.phi_deg.len();
        let row = &self.shift_um[i * n..(i + 1) * n];
        let last = n - 1;
        // The φ of the last node is half a period of the lowest harmonic.
        let x = phi * std::f64::consts::PI / self.phi_deg[last].to_radians();
        let node = |j: usize| std::f64::consts::PI * j as f64 / last as f64;
        let ends = |j: usize| if j == 0 || j == last { 0.5 } else { 1.0 };
        let (mut along, mut across) = (0.0, 0.0);
        for k in 0..=last {
            let cosine: f64 = (0..=last)
                .map(|j| ends(j) * row[j][0] * (k as f64 * node(j)).cos())
                .sum();
            let sine: f64 = (1..last)
                .map(|j| row[j][1] * (k as f64 * node(j)).sin())
                .sum();
            let scale = 2.0 / last as f64;
            along += scale * ends(k) * cosine * (k as f64 * x).cos();
            across += scale * sine * (k as f64 * x).sin();
        }
        [along, across]
    }
}

/// First mirror axis beyond φ = 0, deg.
fn fold_deg(subpixels: Subpixels) -> f64 {
    if subpixels.m() == subpixels.n() {
        45.0
    } else {
        90.0
    }
}

/// Cubic Hermite through nodes (x ascending from 0) of an odd function; slopes by differences over both neighbours.
fn odd_cubic(nodes: &[(f64, [f64; 2])], x: f64) -> [f64; 2] {
    let i = nodes.partition_point(|n| n.0 < x).clamp(1, nodes.len() - 1);
    let (x0, y0) = nodes[i - 1];
    let (x1, y1) = nodes[i];
    let mirrored = |n: (f64, [f64; 2])| (-n.0, n.1.map(|y| -y));
    let before = if i >= 2 {
        nodes[i - 2]
    } else {
        mirrored(nodes[1])
    };
    let after = nodes.get(i + 1);
    let (h, t) = (x1 - x0, (x - x0) / (x1 - x0));
    std::array::from_fn(|k| {
        let slope0 = (y1[k] - before.1[k]) / (x1 - before.0);
        let secant = (y1[k] - y0[k]) / h;
        let slope1 = after.map_or(2.0 * secant - slope0, |a| (a.1[k] - y0[k]) / (a.0 - x0));
        let (s, d0, d1) = (1.0 - t, slope0 * h, slope1 * h);
        s * s * ((1.0 + 2.0 * t) * y0[k] + t * d0) + t * t * ((3.0 - 2.0 * t) * y1[k] - s * d1)
    })
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
