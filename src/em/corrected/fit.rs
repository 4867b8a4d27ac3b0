//! A smooth function through scattered values: the mean of a Gaussian process with the Matérn-5/2 covariance
//!
//! ```text
//! k(r) = (1 + ρ + ρ²/3) e^(−ρ) + ν [r = 0],   ρ = √5 r / ℓ        f(x) = k(x, X) K⁻¹ y
//! ```
//! (Rasmussen & Williams, Gaussian Processes for Machine Learning (2006), eqs. 2.25, 4.17). A run left out with all its
//! mirror images B is predicted with the error `(K⁻¹_BB)⁻¹ (K⁻¹ y)_B` (Dubrule, Math. Geol. 15, 687 (1983)). The length
//! ℓ and the noise ν are those of the smallest such error. All sub-pixels share K. Distances r are those of
//! [`super::design`].

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, MatRef, Side};

use super::design::{Point, Space, distance};
use crate::em::light::Incidence;

const LENGTHS: [f64; 8] = [0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 1.0];
const NOISES: [f64; 4] = [1e-4, 1e-2, 1e-1, 1.0];
/// Images nearer than this are one point; places are f32.
const SAME: f64 = 1e-6;
/// Below it rounding leaves a matrix not positive.
const SMALLEST_PIVOT: f64 = 1e-14;

/// The fitted function.
#[derive(Clone, Debug)]
pub(super) struct Process {
    space: Space,
    length: f64,
    points: Vec<Point>,
    /// K⁻¹ y, `[point][sub-pixel]`.
    coefficients: Vec<Vec<f64>>,
}

/// Points with their values, and which run each belongs to.
struct Data {
    points: Vec<Point>,
    values: Vec<Vec<f64>>,
    run: Vec<usize>,
    runs: usize,
}

impl Process {
    /// Through the values of each run and all its images; also the error of each run left out, over its sub-pixels.
    pub fn fit(runs: &[(Incidence, Vec<f64>)], space: Space) -> (Self, Vec<Vec<f64>>) {
        let data = Data::new(runs, &space);
        let mut best: Option<(f64, Self, Vec<Vec<f64>>)> = None;
        for length in LENGTHS {
            for noise in NOISES {
                let Some(inverse) = data.inverse(length, noise) else {
                    continue;
                };
                let coefficients = product(inverse.as_ref(), &data.values);
                let out = data.left_out(&inverse, &coefficients);
                let sum: f64 = out.iter().flatten().map(|x| x * x).sum();
                if best.as_ref().is_none_or(|b| sum < b.0) {
                    let process = Self {
                        space: space.clone(),
                        length,
                        points: data.points.clone(),
                        coefficients,
                    };
                    best = Some((sum, process, out));
                }
            }
        }
        let none = || {
            let nothing = Self {
                space: space.clone(),
                length: 1.0,
                points: Vec::new(),
                coefficients: Vec::new(),
            };
            (0.0, nothing, data.values.clone())
        };
        let (_, process, out) = best.unwrap_or_else(none);
        (process, out)
    }

    /// The function, a value per sub-pixel.
    pub fn at(&self, incidence: Incidence) -> Vec<f64> {
        let mut sum = vec![0.0; self.space.subpixels.count()];
        let place = self.space.point(incidence);
        for (point, c) in self.points.iter().zip(&self.coefficients) {
            let k = covariance(distance(&place, point), self.length);
            for (s, c) in sum.iter_mut().zip(c) {
                *s += k * c;
            }
        }
        sum
    }
}

impl Data {
    fn new(runs: &[(Incidence, Vec<f64>)], space: &Space) -> Self {
        let mut data = Self {
            points: Vec::new(),
            values: Vec::new(),
            run: Vec::new(),
            runs: runs.len(),
        };
        for (r, (incidence, values)) in runs.iter().enumerate() {
            let first = data.points.len();
            // Images that fall together (on an axis of symmetry) are one point, of the mean value.
            let mut times = Vec::new();
            for symmetry in &space.group {
                let (wave, sent) = space.image(*symmetry, *incidence, values);
                let at = space.point(wave);
                let near = |p: &Point| distance(p, &at) < SAME;
                match data.points[first..].iter().position(near) {
                    Some(i) => {
                        times[i] += 1.0;
                        let sum = &mut data.values[first + i];
                        sum.iter_mut().zip(sent).for_each(|(o, s)| *o += s);
                    }
                    None => {
                        data.points.push(at);
                        data.values.push(sent);
                        data.run.push(r);
                        times.push(1.0);
                    }
                }
            }
            for (values, times) in data.values[first..].iter_mut().zip(&times) {
                values.iter_mut().for_each(|v| *v /= times);
            }
        }
        data
    }

    /// K⁻¹, `None` where rounding leaves K not positive.
    fn inverse(&self, length: f64, noise: f64) -> Option<Mat<f64>> {
        let n = self.points.len();
        let entry = |i: usize, j: usize| {
            let at = distance(&self.points[i], &self.points[j]);
            covariance(at, length) + if i == j { noise } else { 0.0 }
        };
        inverse(&Mat::from_fn(n, n, entry))
    }

    /// The error of each run, left out with its images, averaged over these back to the run's own sub-pixels' sizes.
    fn left_out(&self, inverse_k: &Mat<f64>, coefficients: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut all = Vec::with_capacity(self.runs);
        let mut first = 0;
        while first < self.run.len() {
            let images = self.run[first..]
                .iter()
                .take_while(|r| **r == self.run[first]);
            let block = first..first + images.count();
            let part = inverse_k.submatrix(first, first, block.len(), block.len());
            let errors = match inverse(&part.to_owned()) {
                Some(back) => product(back.as_ref(), &coefficients[block.clone()]),
                None => self.values[block.clone()].to_vec(),
            };
            // Every image shows the same errors on other sub-pixels.
            all.extend(errors.into_iter().next());
            first = block.end;
        }
        all
    }
}

fn covariance(distance: f64, length: f64) -> f64 {
    let rho = 5f64.sqrt() * distance / length;
    (1.0 + rho + rho * rho / 3.0) * (-rho).exp()
}

fn product(matrix: MatRef<'_, f64>, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let count = columns.first().map_or(0, Vec::len);
    let columns = Mat::from_fn(columns.len(), count, |i, j| columns[i][j]);
    let product = matrix * &columns;
    let row = |i| product.row(i).iter().copied().collect();
    (0..product.nrows()).map(row).collect()
}

/// Inverse of a symmetric positive matrix by its Cholesky factor, `None` of one that is not.
fn inverse(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    let factor = matrix.llt(Side::Lower).ok()?;
    let pivots = factor.L().diagonal();
    let positive = (0..matrix.nrows()).all(|i| pivots[i].powi(2) > SMALLEST_PIVOT);
    positive.then(|| factor.inverse())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_a_positive_matrix_is_one() {
        let rows = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let back = inverse(&Mat::from_fn(3, 3, |i, j| rows[i][j])).unwrap();
        for (i, row) in rows.iter().enumerate() {
            for j in 0..3 {
                let entry: f64 = (0..3).map(|k| row[k] * back[(k, j)]).sum();
                assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        let not_positive = [[1.0, 2.0], [2.0, 1.0]];
        assert!(inverse(&Mat::from_fn(2, 2, |i, j| not_positive[i][j])).is_none());
    }
}
