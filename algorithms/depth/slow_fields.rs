//! A gain and a focus that change slowly over the picture, through shifts of planes.
//!
//! ```text
//! γ(x, y) = Σ c_ij P_i(u) P_j(v),   i ≤ 4, j ≤ 2, i + j ≤ 4;   u, v: −1 to 1 over the picture; P: Legendre
//! δ(x, y) = Σ e_ij P_i(u) P_j(v),   i + j ≤ 1: a tilt; how the lens curves the field is in C
//! ```
//!
//! c and e minimise Σ ((D − γ C(1/Z + δ))/s)² + Σ (c_ij/c_s)² + Σ (e_ij/e_s)², of all but c₀₀ and e₀₀, the means, by
//! Gauss and Newton: where the planes say little, gain and focus are the same everywhere.

use super::calibrate::{CalibrateError, Part, value};
use super::field_curve::FieldCurve;
use crate::field::solve_positive_definite;

/// s, px: what the median of a block is known to.
const SHIFT_ERROR_PX: f64 = 0.02;
/// c_s.
const GAIN_SPREAD: f64 = 0.2;
/// e_s times the slope of C in the middle, px.
const FOCUS_SPREAD_PX: f64 = 0.1;
/// Degrees along x, along y, and of both together.
const GAIN_DEGREES: [usize; 3] = [4, 2, 4];
const FOCUS_DEGREES: [usize; 3] = [1, 1, 1];
/// Steps of the search, at most, and the step at which it ends.
const STEPS: usize = 50;
const SMALL: f64 = 1e-10;

/// A number that changes slowly over the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SlowField {
    size_px: [usize; 2],
    degrees: [usize; 3],
    /// Of its polynomials, the mean first.
    terms: Vec<f64>,
}

/// What the planes give.
pub(super) struct FieldFit {
    /// γ.
    pub gain: SlowField,
    /// δ, 1/m.
    pub focus: SlowField,
    /// Standard deviations of their means by what is left.
    pub sigma: [f64; 2],
}

impl SlowField {
    /// The same everywhere.
    fn even(value: f64, size_px: [usize; 2], degrees: [usize; 3]) -> Self {
        let count = basis([0.0; 2], size_px, degrees).len();
        let terms = (0..count).map(|k| if k == 0 { value } else { 0.0 });
        Self {
            size_px,
            degrees,
            terms: terms.collect(),
        }
    }

    /// Its value at a place of the picture.
    pub fn at(&self, at_px: [f64; 2]) -> f64 {
        self.by(&basis(at_px, self.size_px, self.degrees))
    }

    fn by(&self, basis: &[f64]) -> f64 {
        basis.iter().zip(&self.terms).map(|(b, c)| b * c).sum()
    }

    /// Its mean over the picture.
    pub fn mean(&self) -> f64 {
        self.terms[0]
    }

    fn step(&mut self, by: &[f64]) {
        (self.terms.iter_mut().zip(by)).for_each(|(c, s)| *c += s);
    }
}

/// Fits blocks of planes, from a gain of 1 and the curve's own focus.
///
/// # Errors
/// No gain above 0 fits.
pub(super) fn fit(curve: &FieldCurve, blocks: &[Part]) -> Result<FieldFit, CalibrateError> {
    let size_px = [curve.width_px, curve.height_px];
    let mut gain = SlowField::even(1.0, size_px, GAIN_DEGREES);
    let mut focus = SlowField::even(0.0, size_px, FOCUS_DEGREES);
    let bases: Vec<[Vec<f64>; 2]> = (blocks.iter())
        .map(|block| [GAIN_DEGREES, FOCUS_DEGREES].map(|d| basis(block.at_px, size_px, d)))
        .collect();
    let (count, n) = (gain.terms.len(), gain.terms.len() + focus.terms.len());
    let focus_spread = FOCUS_SPREAD_PX / curve.slope_in_the_middle();
    let mut normal = Vec::new();
    for _ in 0..STEPS {
        let (mut square, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for k in (1..count).chain(count + 1..n) {
            let (term, spread) = match k < count {
                true => (gain.terms[k], GAIN_SPREAD),
                false => (focus.terms[k - count], focus_spread),
            };
            square[k * n + k] = (SHIFT_ERROR_PX / spread).powi(2);
            right[k] = -square[k * n + k] * term;
        }
        for (block, [of_gain, of_focus]) in blocks.iter().zip(&bases) {
            let [c, slope] = value(curve, block, focus.by(of_focus));
            let own = gain.by(of_gain);
            let row: Vec<f64> = (of_gain.iter().map(|b| b * c))
                .chain(of_focus.iter().map(|b| own * slope * b))
                .collect();
            let rest = block.measured_px - own * c;
            for i in 0..n {
                right[i] += row[i] * rest;
                (0..=i).for_each(|j| square[i * n + j] += row[i] * row[j]);
            }
        }
        let failed = CalibrateError::NoFit(gain.mean());
        let step = solve_positive_definite(&square, &right).ok_or(failed)?;
        gain.step(&step[..count]);
        focus.step(&step[count..]);
        let mean = gain.mean();
        if !(mean > 0.0 && mean.is_finite() && focus.mean().is_finite()) {
            return Err(CalibrateError::NoFit(mean));
        }
        normal = square;
        if step.iter().all(|s| s.abs() < SMALL) {
            break;
        }
    }
    let rest = |block: &Part| {
        let delta = focus.at(block.at_px);
        (block.measured_px - gain.at(block.at_px) * value(curve, block, delta)[0]).powi(2)
    };
    let variance = blocks.iter().map(rest).sum::<f64>() / (blocks.len() as f64 - 2.0).max(1.0);
    let sigma = [0, count].map(|k| {
        let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == k))).collect();
        let inverse = solve_positive_definite(&normal, &unit).map_or(f64::NAN, |s| s[k]);
        (variance * inverse).sqrt()
    });
    Ok(FieldFit { gain, focus, sigma })
}

/// The polynomials at a place of the picture.
fn basis(at_px: [f64; 2], size_px: [usize; 2], [along, down, both]: [usize; 3]) -> Vec<f64> {
    let unit = |k: usize| match size_px[k] {
        0 | 1 => 0.0,
        n => 2.0 * at_px[k] / (n - 1) as f64 - 1.0,
    };
    let (u, v) = (legendre(unit(0), along), legendre(unit(1), down));
    let terms = (0..=along).flat_map(|i| (0..=down.min(both - i)).map(move |j| (i, j)));
    terms.map(|(i, j)| u[i] * v[j]).collect()
}

/// P₀ to P_n.
fn legendre(x: f64, n: usize) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for k in 1..n {
        let degree = k as f64;
        p.push(((2.0 * degree + 1.0) * x * p[k] - degree * p[k - 1]) / (degree + 1.0));
    }
    p.truncate(n + 1);
    p
}
