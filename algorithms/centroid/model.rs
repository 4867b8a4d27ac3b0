//! The series of a view by the derivatives of its reference, and its robust least squares ([`super`]).

use super::{Observed, Sample};
use crate::field::{FieldError, SmoothField, solve_positive_definite};

/// Median of |r| over the standard deviation of a normal r.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_750_196_081_7;
/// Tukey's biweight gives nothing beyond this many standard deviations.
const TUKEY: f64 = 4.685;

/// Which unknown stands where.
pub(super) struct Model {
    /// Coefficients of the field's degree, and of degree 1 or less.
    terms: usize,
    linear: usize,
}

/// Coefficients with what they leave over.
pub(super) struct Solution {
    coefficients: Vec<f64>,
    pub rms_px: f64,
    pub rejected_share: f64,
}

impl Model {
    pub fn new(degree: usize) -> Self {
        Self {
            terms: SmoothField::terms(degree),
            linear: SmoothField::terms(degree.min(1)),
        }
    }

    /// Gain, offset, two components of the field; seven moments; eleven constants.
    fn unknowns(&self) -> usize {
        4 * self.terms + 7 * self.linear + 11
    }

    /// The row of `sample`, to `row`.
    fn row(&self, sample: &Sample, row: &mut Vec<f64>) {
        let d = &sample.derivatives;
        row.clear();
        for factor in [d[0], 1.0, -d[1], -d[2]] {
            row.extend(sample.basis.iter().map(|b| b * factor));
        }
        for factor in &d[3..10] {
            row.extend(sample.basis[..self.linear].iter().map(|b| b * factor));
        }
        row.extend(&d[10..]);
    }

    /// Least squares, then Tukey's biweight. The view is a + (d − shift)·(−∇a) + …; what the shift takes is put back.
    pub fn solve(&self, used: &[Observed<'_>]) -> Result<Solution, FieldError> {
        let degree = (0..)
            .find(|&d| SmoothField::terms(d) >= self.terms)
            .unwrap_or(0);
        if used.len() < self.unknowns() {
            return Err(FieldError::TooFew {
                found: used.len(),
                needed: self.unknowns(),
                degree,
            });
        }
        let wanted: Vec<f64> = (used.iter())
            .map(|o| {
                let d = &o.sample.derivatives;
                o.value - o.shift[0] * d[1] - o.shift[1] * d[2]
            })
            .collect();
        let mut weights = vec![1.0; used.len()];
        let mut coefficients = self.normal(used, &wanted, &weights, degree)?;
        let mut residuals = Vec::new();
        for robust in [true, false] {
            let mut row = Vec::new();
            residuals.clear();
            residuals.extend(used.iter().zip(&wanted).map(|(o, y)| {
                self.row(o.sample, &mut row);
                let model: f64 = row.iter().zip(&coefficients).map(|(a, c)| a * c).sum();
                y - model
            }));
            if robust {
                let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
                sizes.sort_by(f64::total_cmp);
                let deviation = sizes[sizes.len() / 2] / MEDIAN_OF_NORMAL;
                // A view without any residual has no outliers.
                let reach = (TUKEY * deviation).max(f64::MIN_POSITIVE);
                for (weight, r) in weights.iter_mut().zip(&residuals) {
                    let rest = 1.0 - (r / reach).powi(2);
                    *weight = if rest > 0.0 { rest * rest } else { 0.0 };
                }
                coefficients = self.normal(used, &wanted, &weights, degree)?;
            }
        }
        let accepted = || (0..used.len()).filter(|&i| weights[i] > 0.0);
        let squares: f64 = accepted().map(|i| residuals[i].powi(2)).sum();
        let slopes: f64 = accepted()
            .map(|i| &used[i].sample.derivatives)
            .map(|d| 0.5 * (d[1] * d[1] + d[2] * d[2]))
            .sum();
        Ok(Solution {
            coefficients,
            rms_px: (squares / slopes).sqrt(),
            rejected_share: 1.0 - accepted().count() as f64 / used.len() as f64,
        })
    }

    fn normal(
        &self,
        used: &[Observed<'_>],
        wanted: &[f64],
        weights: &[f64],
        degree: usize,
    ) -> Result<Vec<f64>, FieldError> {
        let n = self.unknowns();
        let (mut matrix, mut right, mut row) = (vec![0.0; n * n], vec![0.0; n], Vec::new());
        for ((o, y), w) in used.iter().zip(wanted).zip(weights) {
            if *w == 0.0 {
                continue;
            }
            self.row(o.sample, &mut row);
            for (i, a) in row.iter().enumerate() {
                let factor = w * a;
                right[i] += factor * y;
                let line = &mut matrix[i * n..=i * n + i];
                line.iter_mut()
                    .zip(&row)
                    .for_each(|(m, b)| *m += factor * b);
            }
        }
        solve_positive_definite(&matrix, &right).ok_or(FieldError::Singular(degree))
    }
}

impl Solution {
    /// What is left of the gain: 1 at the end.
    pub fn gain(&self, model: &Model, basis: &[f64]) -> f64 {
        let terms = self.coefficients[..model.terms].iter();
        terms.zip(basis).map(|(c, b)| c * b).sum()
    }

    pub fn field(
        &self,
        model: &Model,
        basis: &SmoothField,
        degree: usize,
    ) -> Result<SmoothField, FieldError> {
        let n = model.terms;
        let parts = [2, 3].map(|k| self.coefficients[k * n..(k + 1) * n].to_vec());
        SmoothField::from_parts(basis.centre_px(), basis.half_span_px(), parts)
            .ok_or(FieldError::Singular(degree))
    }
}
