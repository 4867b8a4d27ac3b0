//! Smooth fields fitted to scattered shifts: the aberration disparity of a lens is smooth, the matches are not.
//!
//! ```text
//! d(x, y) ≈ Σ_{m+n ≤ D} c_mn T_m(u) T_n(v)        u, v: x, y scaled to −1..1;   T: Chebyshev polynomials;   D: degree
//! min Σ_i ρ(q_i / s)        q_i² = r_iᵀ (C_i + f²)⁻¹ r_i        r_i = d_i − d(x_i, y_i)
//! ```
//!
//! Both components are fitted together, each match i weighted by the inverse of its covariance C_i, to which the
//! matcher's own systematic error f is added so that noiseless matches do not outweigh all others. The robust loss ρ is
//! reached by iteratively reweighted least squares (Holland & Welsch, Commun. Stat. A6, 813 (1977)); the scale s is the
//! median of the q over that of two normal components, so it also holds when the polynomial and not the noise limits
//! the fit.

mod error;
mod loss;
mod solve;

pub use error::FieldError;
pub use loss::Loss;
pub(crate) use solve::solve_positive_definite;

use solve::Normal;

/// Largest degree of the polynomial.
pub const LARGEST_DEGREE: usize = 6;

/// Systematic error f of a match, px: what Gauss–Newton with Lanczos (a = 4) leaves on noiseless texture.
const FLOOR_PX: f64 = 0.002;

/// Median of √(x² + y²) for two standard normal numbers: √(2 ln 2).
const MEDIAN_OF_TWO: f64 = 1.177_410_022_515_474_7;

/// A match this many scales away counts as rejected under Huber's loss, which gives nothing the weight 0.
const HUBER_REJECTS: f64 = 4.0;

/// Weights settle within this many rounds or not at all.
const ROUNDS: usize = 30;

/// A shift measured at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Where: column and row, px.
    pub at_px: [f64; 2],
    /// Shift right and down, px.
    pub shift_px: [f64; 2],
    /// Covariance xx, xy, yy, px²; positive semidefinite. Zero on an axis that is known (one-dimensional matching).
    pub covariance_px2: [f64; 3],
}

/// A polynomial field of shifts.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothField {
    degree: usize,
    centre_px: [f64; 2],
    half_span_px: [f64; 2],
    /// Coefficients of the right and the down component, in the order of `basis`.
    coefficients: [Vec<f64>; 2],
}

/// A fit with what it leaves over.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldFit {
    /// The field.
    pub field: SmoothField,
    /// Observed minus fitted, px, one an observation.
    pub residuals_px: Vec<[f64; 2]>,
    /// Rejected by the loss, one an observation.
    pub rejected: Vec<bool>,
    /// Root mean square of the residuals that were accepted, px a single axis.
    pub rms_px: f64,
    /// Robust scale of the residuals over what the covariances claim: 1 when the claims and the degree are right.
    pub scale: f64,
}

impl FieldFit {
    /// Share of rejected observations, 0 to 1.
    pub fn rejected_share(&self) -> f64 {
        let count = self.rejected.iter().filter(|&&r| r).count();
        count as f64 / self.rejected.len() as f64
    }
}

impl SmoothField {
    /// Number of coefficients a component: (D + 1)(D + 2)/2.
    pub fn terms(degree: usize) -> usize {
        (degree + 1) * (degree + 2) / 2
    }

    /// A field from stored numbers: the rectangle that −1..1 stands for (its centre and half sides) and the
    /// coefficients of each component in the order (m, n) = (0,0), (1,0), (0,1), (2,0), (1,1), (0,2) …; `None` where
    /// their number fits no degree up to [`LARGEST_DEGREE`], a half side is not positive, or one is not finite.
    pub fn from_parts(
        centre_px: [f64; 2],
        half_span_px: [f64; 2],
        coefficients: [Vec<f64>; 2],
    ) -> Option<Self> {
        let count = coefficients[0].len();
        let degree = (0..=LARGEST_DEGREE).find(|&d| Self::terms(d) == count)?;
        let mut all = (centre_px.iter())
            .chain(&half_span_px)
            .chain(coefficients.iter().flatten());
        let fits = coefficients[1].len() == count
            && half_span_px.iter().all(|&h| h > 0.0)
            && all.all(|v| v.is_finite());
        fits.then_some(Self {
            degree,
            centre_px,
            half_span_px,
            coefficients,
        })
    }

    /// Degree of the polynomial.
    pub fn degree(&self) -> usize {
        self.degree
    }
    /// Middle of the rectangle that −1..1 stands for, px.
    pub fn centre_px(&self) -> [f64; 2] {
        self.centre_px
    }
    /// Half its sides, px.
    pub fn half_span_px(&self) -> [f64; 2] {
        self.half_span_px
    }
    /// Coefficients of the right and the down component, px.
    pub fn coefficients(&self) -> &[Vec<f64>; 2] {
        &self.coefficients
    }

    /// Shift right and down at column x and row y, px; outside of the fitted rectangle the polynomial goes on.
    pub fn at(&self, at_px: [f64; 2]) -> [f64; 2] {
        let basis = self.basis(at_px);
        [0, 1].map(|c| {
            self.coefficients[c]
                .iter()
                .zip(&basis)
                .map(|(c, b)| c * b)
                .sum()
        })
    }

    /// Fits `observations` by a polynomial of `degree` (0 to [`LARGEST_DEGREE`]).
    ///
    /// # Errors
    /// A degree out of range, observations that are too few, not finite, or lie so that they do not fix the
    /// coefficients.
    pub fn fit(
        observations: &[Observation],
        degree: usize,
        loss: Loss,
    ) -> Result<FieldFit, FieldError> {
        if degree > LARGEST_DEGREE {
            return Err(FieldError::Degree(degree));
        }
        let needed = Self::terms(degree);
        if observations.len() < needed {
            return Err(FieldError::TooFew {
                found: observations.len(),
                needed,
                degree,
            });
        }
        let information = (observations.iter().enumerate())
            .map(|(index, o)| information(o).ok_or(FieldError::Observation { index }))
            .collect::<Result<Vec<_>, _>>()?;
        let mut field = Self::over(observations, degree);
        let bases: Vec<Vec<f64>> = observations.iter().map(|o| field.basis(o.at_px)).collect();
        let mut weights = vec![1.0; observations.len()];
        let mut fit = field.solve(observations, &information, &bases, &weights)?;
        let stages: &[Loss] = match loss {
            Loss::Squares => &[],
            Loss::Huber => &[Loss::Huber],
            Loss::Tukey => &[Loss::Huber, Loss::Tukey],
        };
        for stage in stages {
            for _ in 0..ROUNDS {
                let mut moved = 0.0f64;
                for (weight, q) in weights.iter_mut().zip(&fit.distances) {
                    let next = stage.weight(q / fit.scale);
                    moved = moved.max((next - *weight).abs());
                    *weight = next;
                }
                if moved < 1e-6 {
                    break;
                }
                fit = field.solve(observations, &information, &bases, &weights)?;
            }
        }
        let rejected: Vec<bool> = (weights.iter().zip(&fit.distances))
            .map(|(&weight, q)| match loss {
                Loss::Squares => false,
                Loss::Huber => q / fit.scale > HUBER_REJECTS,
                Loss::Tukey => weight == 0.0,
            })
            .collect();
        let accepted = || (fit.residuals.iter().zip(&rejected)).filter(|(_, rejected)| !**rejected);
        let squares: f64 = accepted().map(|(r, _)| r[0] * r[0] + r[1] * r[1]).sum();
        let rms_px = (squares / (2 * accepted().count()).max(1) as f64).sqrt();
        Ok(FieldFit {
            field,
            rms_px,
            scale: fit.scale,
            rejected,
            residuals_px: fit.residuals,
        })
    }

    /// A zero field over the rectangle that holds `observations`.
    fn over(observations: &[Observation], degree: usize) -> Self {
        let range = [0, 1].map(|axis| {
            let values = observations.iter().map(|o| o.at_px[axis]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            (low, values.fold(f64::NEG_INFINITY, f64::max))
        });
        Self {
            degree,
            centre_px: range.map(|(low, high)| 0.5 * (low + high)),
            // Observations on a line or a point have no span; any scale will do, and the solver finds the lack.
            half_span_px: range.map(
                |(low, high)| {
                    if high > low { 0.5 * (high - low) } else { 1.0 }
                },
            ),
            coefficients: [0, 1].map(|_| vec![0.0; Self::terms(degree)]),
        }
    }

    /// T_m(u) T_n(v) in the order of the coefficients; those of a lower degree come first.
    pub(crate) fn basis(&self, at_px: [f64; 2]) -> Vec<f64> {
        let chebyshev = [0, 1].map(|axis| {
            let u = (at_px[axis] - self.centre_px[axis]) / self.half_span_px[axis];
            let mut t = [1.0; LARGEST_DEGREE + 1];
            t[1] = u;
            for k in 2..=LARGEST_DEGREE {
                t[k] = 2.0 * u * t[k - 1] - t[k - 2];
            }
            t
        });
        (0..=self.degree)
            .flat_map(|total| (0..=total).map(move |n| (total - n, n)))
            .map(|(m, n)| chebyshev[0][m] * chebyshev[1][n])
            .collect()
    }

    /// One weighted fit into `self`.
    fn solve(
        &mut self,
        observations: &[Observation],
        information: &[[f64; 3]],
        bases: &[Vec<f64>],
        weights: &[f64],
    ) -> Result<Round, FieldError> {
        let mut normal = Normal::new(Self::terms(self.degree));
        for (((o, info), basis), &weight) in
            observations.iter().zip(information).zip(bases).zip(weights)
        {
            if weight > 0.0 {
                normal.add(basis, info.map(|v| v * weight), o.shift_px);
            }
        }
        self.coefficients = normal.solve().ok_or(FieldError::Singular(self.degree))?;
        let residuals: Vec<[f64; 2]> = (observations.iter().zip(bases))
            .map(|(o, basis)| {
                [0, 1].map(|c| {
                    let value: f64 = self.coefficients[c]
                        .iter()
                        .zip(basis)
                        .map(|(c, b)| c * b)
                        .sum();
                    o.shift_px[c] - value
                })
            })
            .collect();
        let distances: Vec<f64> = (residuals.iter().zip(information))
            .map(|([x, y], [xx, xy, yy])| {
                (x * x * xx + 2.0 * x * y * xy + y * y * yy).max(0.0).sqrt()
            })
            .collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        // Exact data leave only rounding; a millionth of the claimed error is exact enough.
        let scale = (sorted[sorted.len() / 2] / MEDIAN_OF_TWO).max(1e-6);
        Ok(Round {
            residuals,
            distances,
            scale,
        })
    }
}

/// Residuals of one round, their distances q and scale s.
struct Round {
    residuals: Vec<[f64; 2]>,
    distances: Vec<f64>,
    scale: f64,
}

/// (C + f²)⁻¹ as xx, xy, yy; `None` for what is no observation.
fn information(o: &Observation) -> Option<[f64; 3]> {
    let [xx, xy, yy] = o.covariance_px2;
    let finite = o.at_px.iter().chain(&o.shift_px).all(|v| v.is_finite());
    // Rounding may leave a correlation slightly above 1.
    let semidefinite = xx >= 0.0 && yy >= 0.0 && xy * xy <= xx * yy * (1.0 + 1e-9);
    let (xx, yy) = (xx + FLOOR_PX * FLOOR_PX, yy + FLOOR_PX * FLOOR_PX);
    let determinant = xx * yy - xy * xy;
    (finite && semidefinite && determinant.is_finite() && determinant > 0.0)
        .then(|| [yy / determinant, -xy / determinant, xx / determinant])
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
