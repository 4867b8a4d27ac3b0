//! A gain that changes slowly over the picture, and a focus, through shifts of planes.
//!
//! ```text
//! γ(x, y) = Σ c_ij P_i(u) P_j(v),   i ≤ 4, j ≤ 2, i + j ≤ 4;   u, v: −1 to 1 over the picture; P: Legendre
//! ```
//!
//! c and δ minimise Σ ((D − γ C(1/Z + δ))/s)² + Σ (c_ij/c_s)², of all but c₀₀, the mean of γ, by Gauss and Newton:
//! where the planes say little, the gain is the same everywhere.

use super::calibrate::{CalibrateError, Part, value};
use super::field_curve::FieldCurve;
use crate::field::solve_positive_definite;

/// s, px: what the median of a block is known to.
const SHIFT_ERROR_PX: f64 = 0.02;
/// c_s.
const SPREAD: f64 = 0.2;
/// Degrees along x, along y, and of both together.
const DEGREES: [usize; 3] = [4, 2, 4];
/// Steps of the search, at most, and the step at which it ends.
const STEPS: usize = 50;
const SMALL: f64 = 1e-10;

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GainField {
    size_px: [usize; 2],
    /// c, c₀₀ first.
    terms: Vec<f64>,
}

/// What the planes give.
pub(super) struct GainFit {
    pub gain: GainField,
    /// δ, 1/m.
    pub delta: f64,
    /// Standard deviations of c₀₀ and δ by what is left.
    pub sigma: [f64; 2],
}

impl GainField {
    /// γ at a place of the picture.
    pub fn at(&self, at_px: [f64; 2]) -> f64 {
        let basis = basis(at_px, self.size_px);
        basis.iter().zip(&self.terms).map(|(b, c)| b * c).sum()
    }

    /// Its mean over the picture.
    pub fn mean(&self) -> f64 {
        self.terms[0]
    }

    /// Fits blocks of planes, from a gain of 1 and the curve's own focus.
    ///
    /// # Errors
    /// No gain above 0 fits.
    pub fn fit(curve: &FieldCurve, blocks: &[Part]) -> Result<GainFit, CalibrateError> {
        let size_px = [curve.width_px, curve.height_px];
        let bases: Vec<Vec<f64>> = (blocks.iter())
            .map(|block| basis(block.at_px, size_px))
            .collect();
        let count = basis([0.0; 2], size_px).len();
        let mut fit = GainFit {
            gain: Self {
                size_px,
                terms: (0..count).map(|k| f64::from(u8::from(k == 0))).collect(),
            },
            delta: 0.0,
            sigma: [0.0; 2],
        };
        let n = count + 1;
        let mut normal = Vec::new();
        for _ in 0..STEPS {
            let (mut square, mut right) = (vec![0.0; n * n], vec![0.0; n]);
            for k in 1..count {
                square[k * n + k] = (SHIFT_ERROR_PX / SPREAD).powi(2);
                right[k] = -square[k * n + k] * fit.gain.terms[k];
            }
            for (block, basis) in blocks.iter().zip(&bases) {
                let [c, slope] = value(curve, block, fit.delta);
                let gain: f64 = basis.iter().zip(&fit.gain.terms).map(|(b, c)| b * c).sum();
                let row: Vec<f64> = (basis.iter().map(|b| b * c))
                    .chain([gain * slope])
                    .collect();
                let rest = block.measured_px - gain * c;
                for i in 0..n {
                    right[i] += row[i] * rest;
                    (0..=i).for_each(|j| square[i * n + j] += row[i] * row[j]);
                }
            }
            let failed = CalibrateError::NoFit(fit.gain.mean());
            let step = solve_positive_definite(&square, &right).ok_or(failed)?;
            (fit.gain.terms.iter_mut().zip(&step)).for_each(|(c, s)| *c += s);
            fit.delta += step[count];
            let mean = fit.gain.mean();
            if !(mean > 0.0 && mean.is_finite() && fit.delta.is_finite()) {
                return Err(CalibrateError::NoFit(mean));
            }
            normal = square;
            if step.iter().all(|s| s.abs() < SMALL) {
                break;
            }
        }
        let rest = |block: &Part| {
            let after = fit.gain.at(block.at_px) * value(curve, block, fit.delta)[0];
            (block.measured_px - after).powi(2)
        };
        let variance = blocks.iter().map(rest).sum::<f64>() / (blocks.len() as f64 - 2.0).max(1.0);
        let sigma = |k: usize| {
            let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == k))).collect();
            let inverse = solve_positive_definite(&normal, &unit).map_or(f64::NAN, |s| s[k]);
            (variance * inverse).sqrt()
        };
        fit.sigma = [sigma(0), sigma(count)];
        Ok(fit)
    }
}

/// The terms of γ at a place of the picture.
fn basis(at_px: [f64; 2], size_px: [usize; 2]) -> Vec<f64> {
    let unit = |k: usize| match size_px[k] {
        0 | 1 => 0.0,
        n => 2.0 * at_px[k] / (n - 1) as f64 - 1.0,
    };
    let [along, down, both] = DEGREES;
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
