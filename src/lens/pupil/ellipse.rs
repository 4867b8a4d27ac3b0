//! The smallest ellipse around a set of points: Khachiyan's algorithm (Todd & Yıldırım, Discrete Appl. Math. 155, 1731
//! (2007)).
//!
//! Weights u_i ≥ 0, Σ u_i = 1, maximise log det Σ u_i q_i q_iᵀ with q = (x, y, 1). With the weighted mean c and
//! covariance C the ellipse is (p − c)ᵀ C⁻¹ (p − c) ≤ 2, that is c + S·(unit disk) with S = √(2 C).

use glam::{DMat2, DVec2};

/// The weights are good enough when no point stands out by more than this part of its share.
const TOLERANCE: f64 = 2e-3;
const LIMIT: usize = 400;

/// c + S·(unit disk), S symmetric and positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipse {
    pub centre: DVec2,
    pub shape: DMat2,
}

impl Ellipse {
    /// An almost smallest ellipse that contains every one of `points` (one at least).
    pub(super) fn around(points: &[DVec2]) -> Ellipse {
        let n = points.len() as f64;
        let middle = points.iter().sum::<DVec2>() / n;
        let spread = points
            .iter()
            .map(|p| (*p - middle).length())
            .fold(f64::MIN_POSITIVE, f64::max);
        let scaled: Vec<DVec2> = points.iter().map(|p| (*p - middle) / spread).collect();
        let mut weights = vec![1.0 / n; points.len()];
        let (mut centre, mut covariance) = moments(&scaled, &weights);
        for _ in 0..LIMIT {
            let inverse = covariance.inverse();
            let mut farthest = (0, 0.0);
            for (i, p) in scaled.iter().enumerate() {
                let d = *p - centre;
                let squared = d.dot(inverse * d);
                if squared > farthest.1 {
                    farthest = (i, squared);
                }
            }
            let excess = farthest.1 - 2.0;
            if excess < 2.0 * TOLERANCE {
                break;
            }
            let step = excess / (3.0 * farthest.1);
            weights.iter_mut().for_each(|u| *u *= 1.0 - step);
            weights[farthest.0] += step;
            (centre, covariance) = moments(&scaled, &weights);
        }
        let tight = Ellipse {
            centre: middle + centre * spread,
            shape: symmetric_root(covariance * 2.0) * spread,
        };
        tight.grown(tight.reach(points))
    }

    /// The same ellipse, `factor` times as wide and high.
    pub(super) fn grown(self, factor: f64) -> Ellipse {
        Ellipse {
            shape: self.shape * factor,
            ..self
        }
    }

    /// The ellipse with the signs of x and y.
    pub(super) fn mirrored(self, signs: DVec2) -> Ellipse {
        let turned = signs.x * signs.y;
        let [x, y] = [self.shape.x_axis, self.shape.y_axis];
        Ellipse {
            centre: signs * self.centre,
            shape: DMat2::from_cols(DVec2::new(x.x, turned * x.y), DVec2::new(turned * y.x, y.y)),
        }
    }

    /// By which factor the ellipse must grow to hold all `points` (below 1 when there is room).
    pub(super) fn reach(&self, points: &[DVec2]) -> f64 {
        let inverse = self.shape.inverse();
        points
            .iter()
            .map(|p| (inverse * (*p - self.centre)).length())
            .fold(0.0, f64::max)
    }
}

/// Weighted mean and covariance; a floor keeps points on a line from giving an empty ellipse.
fn moments(points: &[DVec2], weights: &[f64]) -> (DVec2, DMat2) {
    let mut mean = DVec2::ZERO;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (p, u) in points.iter().zip(weights) {
        mean += *u * *p;
        xx += u * p.x * p.x;
        xy += u * p.x * p.y;
        yy += u * p.y * p.y;
    }
    xx += 1e-8 - mean.x * mean.x;
    xy -= mean.x * mean.y;
    yy += 1e-8 - mean.y * mean.y;
    (mean, DMat2::from_cols_array(&[xx, xy, xy, yy]))
}

/// √M of a symmetric positive M: (M + √det M · 1)/√(tr M + 2 √det M).
fn symmetric_root(m: DMat2) -> DMat2 {
    let root = m.determinant().max(0.0).sqrt();
    let trace = m.x_axis.x + m.y_axis.y;
    (m + DMat2::IDENTITY * root) * (1.0 / (trace + 2.0 * root).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_an_ellipse_give_it_back() {
        let (centre, shape) = (
            DVec2::new(0.4, -2.0),
            DMat2::from_cols_array(&[3.0, 0.7, 0.7, 1.2]),
        );
        let points: Vec<DVec2> = (0..90)
            .map(|i| centre + shape * DVec2::from_angle(f64::from(i) * 4_f64.to_radians()))
            .collect();
        let e = Ellipse::around(&points);
        assert!(e.reach(&points) < 1.0 + 1e-12);
        assert!((e.shape.determinant() / shape.determinant() - 1.0).abs() < 5e-3);
        assert!((e.centre - centre).length() < 5e-3);
    }

    #[test]
    fn the_mirror_image_is_that_of_mirrored_points() {
        let points =
            [(0.1, 0.3), (1.2, 0.4), (0.9, 2.0), (-0.2, 1.1), (0.5, -0.7)].map(DVec2::from);
        for signs in [(1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(DVec2::from) {
            let mirrored = Ellipse::around(&points).mirrored(signs);
            let own = Ellipse::around(&points.map(|p| signs * p));
            assert!((mirrored.centre - own.centre).length() < 1e-12);
            assert!((mirrored.shape - own.shape).determinant().abs() < 1e-12);
            assert!((mirrored.shape.x_axis - own.shape.x_axis).length() < 1e-12);
        }
    }

    #[test]
    fn smallest_ellipse_of_a_square_is_its_circumcircle() {
        let points = [
            (-1.0, -1.0),
            (1.0, -1.0),
            (1.0, 1.0),
            (-1.0, 1.0),
            (0.2, 0.3),
        ]
        .map(DVec2::from);
        let e = Ellipse::around(&points);
        assert!((e.shape.determinant() - 2.0).abs() < 0.02, "{e:?}");
    }
}
