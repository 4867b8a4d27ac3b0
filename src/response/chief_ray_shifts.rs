//! The lens shift that each chief ray needs (section 2.1.4 of Chataignier et al., Opt. Express 27, 30486 (2019)): the
//! sub-pixels share the light of its cone equally.
//!
//! s is kept in parts along and across the azimuth φ of the chief ray, over sin θ and φ: the one is even, the other odd
//! about every mirror axis of the pixel, so cosine and sine series in φ have no wrap and no kink, and cubics in sin θ
//! none either. Beyond the last θ the shift of the last one is taken and said to be so.

use serde::{Deserialize, Serialize};

use super::ResponseError;
use crate::sensor::Subpixels;

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

impl ChiefRayShifts {
    /// Ranges and lengths.
    ///
    /// # Errors
    /// The first field out of its range.
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
pub(super) fn fold_deg(subpixels: Subpixels) -> f64 {
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
