//! Polynomials over the unit disk, fitted to values at points that fill it.

use glam::DVec2;

use super::map::{basis, least_squares::Factor};

pub(crate) use super::map::basis::terms;

/// Σ c_n B_n over the unit disk, B orthonormal there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DiskPolynomial {
    degree: usize,
    /// Of the orthonormal polynomials, by their degree.
    orthonormal: Vec<f64>,
    /// Of the powers, as [`basis`] orders them.
    powers: Vec<f64>,
}

/// The least-squares fit of a degree to values at given points.
pub(crate) struct DiskFit {
    degree: usize,
    points: Vec<DVec2>,
    /// The orthonormal polynomials at each point.
    rows: Vec<f64>,
    factor: Factor,
}

impl DiskFit {
    /// `None` where the points leave a term open.
    pub fn new(degree: usize, points: Vec<DVec2>) -> Option<Self> {
        let count = terms(degree);
        let mut rows = vec![0.0; count * points.len()];
        for (point, row) in points.iter().zip(rows.chunks_exact_mut(count)) {
            basis::values(degree, point.x, point.y, row);
        }
        let factor = Factor::new(&rows, count)?;
        Some(Self {
            degree,
            points,
            rows,
            factor,
        })
    }

    /// Where values are asked for.
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// The polynomial through values at the points.
    pub fn of(&self, values: &[f64]) -> DiskPolynomial {
        let count = terms(self.degree);
        let mut orthonormal = vec![0.0; count];
        for (value, row) in values.iter().zip(self.rows.chunks_exact(count)) {
            for (sum, b) in orthonormal.iter_mut().zip(row) {
                *sum += *b * value;
            }
        }
        self.factor.solve(&mut orthonormal);
        DiskPolynomial::of(self.degree, orthonormal)
    }
}

impl DiskPolynomial {
    fn of(degree: usize, orthonormal: Vec<f64>) -> Self {
        let count = terms(degree);
        let mut powers = vec![0.0; count];
        let rows = basis::in_powers(degree);
        for (c, row) in orthonormal.iter().zip(rows.chunks_exact(count)) {
            powers
                .iter_mut()
                .zip(row)
                .for_each(|(sum, power)| *sum += c * power);
        }
        Self {
            degree,
            orthonormal,
            powers,
        }
    }

    /// At a point.
    pub fn value(&self, at: DVec2) -> f64 {
        self.value_and_gradient(at).0
    }

    /// Along x and y.
    pub fn gradient(&self, at: DVec2) -> DVec2 {
        self.value_and_gradient(at).1
    }

    /// By Horner's rule in y over rows in x.
    fn value_and_gradient(&self, at: DVec2) -> (f64, DVec2) {
        let (mut value, mut gradient) = (0.0, DVec2::ZERO);
        let mut from = 0;
        for length in 1..=self.degree + 1 {
            let (mut row, mut slope) = (0.0, 0.0);
            for c in &self.powers[from..from + length] {
                slope = slope * at.x + row;
                row = row * at.x + c;
            }
            from += length;
            gradient.y = gradient.y * at.y + value;
            gradient.x = gradient.x * at.y + slope;
            value = value * at.y + row;
        }
        (value, gradient)
    }

    /// RMS over the disk without its mean and tilt: by Parseval, the basis being orthonormal.
    pub fn rms_beyond_tilt(&self) -> f64 {
        self.orthonormal
            .iter()
            .skip(3)
            .map(|c| c * c)
            .sum::<f64>()
            .sqrt()
    }

    /// The difference to another of the same degree.
    pub fn minus(&self, other: &Self) -> Self {
        let differ = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        Self {
            degree: self.degree,
            orthonormal: differ(&self.orthonormal, &other.orthonormal),
            powers: differ(&self.powers, &other.powers),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::sampling::concentric_disk;

    #[test]
    fn a_polynomial_is_found_again_with_its_slopes() {
        let f = |p: DVec2| 3.0 + p.x - 2.0 * p.y * p.y + p.x.powi(3) * p.y - 0.5 * p.y.powi(6);
        let slope = |p: DVec2| {
            let x = 1.0 + 3.0 * p.x * p.x * p.y;
            DVec2::new(x, -4.0 * p.y + p.x.powi(3) - 3.0 * p.y.powi(5))
        };
        let at = |k: usize| concentric_disk((k as f64 + 0.5) / 300.0, (k as f64 * 0.618).fract());
        let points: Vec<DVec2> = (0..300).map(|k| DVec2::from(at(k))).collect();
        let values: Vec<f64> = points.iter().map(|p| f(*p)).collect();
        let fitted = DiskFit::new(8, points).unwrap().of(&values);
        for p in [(0.3, -0.7), (0.0, 0.0), (-0.9, 0.1)].map(DVec2::from) {
            assert!((fitted.value(p) - f(p)).abs() < 1e-8);
            assert!((fitted.gradient(p) - slope(p)).length() < 1e-7);
        }
        assert_eq!(fitted.minus(&fitted).rms_beyond_tilt(), 0.0);
    }

    #[test]
    fn the_root_mean_square_is_that_over_the_disk() {
        // r² has mean 1/2 and mean square 1/3: 1/√12 about its mean.
        let at = |k: usize| concentric_disk((k as f64 + 0.5) / 99.0, (k as f64 * 0.618).fract());
        let points: Vec<DVec2> = (0..99).map(|k| DVec2::from(at(k))).collect();
        let value = |p: &DVec2| 7.0 + p.x + p.length_squared();
        let values: Vec<f64> = points.iter().map(value).collect();
        let fitted = DiskFit::new(4, points).unwrap().of(&values);
        assert!((fitted.rms_beyond_tilt() - 1.0 / 12f64.sqrt()).abs() < 1e-6);
    }
}
