//! A surface through uncertain numbers, bent where the picture has edges.
//!
//! ```text
//! u minimises  Σ c ρ((u − v)/o) + λ Σ w ψ(∇u / t),    ρ(x) = x²/(1 + x²) · o²,    ψ(x) = √(1 + x²) · t²
//! ```
//!
//! c is the curvature of the cost at v, w small across edges of the picture. ρ (Geman & McClure) lets a wrong number
//! give in, ψ (Charbonnier) lets a depth step stay one. Each round of reweighted least squares is solved by conjugate
//! gradients.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::filters::row_of;

/// How much the picture says of the surface.
pub(super) struct Edges<'a> {
    /// At whose edges the surface may bend.
    pub guide: &'a Image,
    /// Standard deviation of the noise of a contrast between neighbours.
    pub noise: f64,
    /// λ, in units of the median c.
    pub weight: f64,
    /// Contrast across which λ is e times less, parts of white, where there is no noise.
    pub contrast: f64,
}

/// Standard deviations of the noise that are added (in quadrature) to the contrast that counts.
const DEVIATIONS: f64 = 2.0;
/// What is left of λ across the sharpest edge.
const LEAST: f64 = 0.01;
/// t, px of the level per pixel.
const STEP_PX: f64 = 0.004;
/// o, px of the level.
const OUTLIER_PX: f64 = 0.125;
/// Rounds of reweighting, and steps of each.
const ROUNDS: usize = 6;
const STEPS: usize = 40;

/// The surface through `v` with the weights `c` (median 1), row-major as the guide; lengths in px of the level.
pub(super) fn surface(v: &[f64], c: &[f64], edges: &Edges<'_>) -> Vec<f64> {
    let guide = edges.guide;
    let (width, height) = (guide.width(), guide.height());
    let contrast = edges.contrast.hypot(DEVIATIONS * edges.noise);
    let edge = |a: f32, b: f32| {
        let alike = (-f64::from((a - b).abs()) / contrast).exp();
        edges.weight * (alike + LEAST)
    };
    let (mut right, mut down) = (vec![0.0; v.len()], vec![0.0; v.len()]);
    for y in 0..height {
        let row = row_of(guide, y);
        for x in 0..width {
            if x + 1 < width {
                right[y * width + x] = edge(row[x], row[x + 1]);
            }
            if y + 1 < height {
                down[y * width + x] = edge(row[x], row_of(guide, y + 1)[x]);
            }
        }
    }
    let mut u = v.to_vec();
    for _ in 0..ROUNDS {
        let slope = |a: f64, b: f64| 1.0 / (1.0 + ((a - b) / STEP_PX).powi(2)).sqrt();
        let mut system = System {
            width,
            data: vec![0.0; v.len()],
            right: right.clone(),
            down: down.clone(),
        };
        for i in 0..v.len() {
            let off = (u[i] - v[i]) / OUTLIER_PX;
            system.data[i] = c[i] / (1.0 + off * off).powi(2);
            if i % width + 1 < width {
                system.right[i] *= slope(u[i], u[i + 1]);
            }
            if i + width < v.len() {
                system.down[i] *= slope(u[i], u[i + width]);
            }
        }
        system.solve(v, &mut u);
    }
    u
}

/// (diag(data) + Laplacian) u = data v; `right` and `down`: weights to the next pixel, 0 at the last ones.
struct System {
    width: usize,
    data: Vec<f64>,
    right: Vec<f64>,
    down: Vec<f64>,
}

impl System {
    /// Conjugate gradients, scaled by the diagonal, from the `u` given.
    fn solve(&self, v: &[f64], u: &mut [f64]) {
        let diagonal = self.diagonal();
        let mut product = vec![0.0; v.len()];
        self.apply(u, &mut product);
        let mut residual: Vec<f64> = (0..v.len())
            .map(|i| self.data[i] * v[i] - product[i])
            .collect();
        let mut direction: Vec<f64> = residual.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
        let mut size = self.sum(|i| residual[i] * residual[i] / diagonal[i]);
        for _ in 0..STEPS {
            self.apply(&direction, &mut product);
            let bend = self.sum(|i| direction[i] * product[i]);
            if bend <= 0.0 || size <= 0.0 {
                return;
            }
            let step = size / bend;
            for i in 0..u.len() {
                u[i] += step * direction[i];
                residual[i] -= step * product[i];
            }
            let next = self.sum(|i| residual[i] * residual[i] / diagonal[i]);
            let back = next / size;
            size = next;
            for i in 0..u.len() {
                direction[i] = residual[i] / diagonal[i] + back * direction[i];
            }
        }
    }

    /// Σ of `term` over all pixels, row by row: the same whatever the threads.
    fn sum(&self, term: impl Fn(usize) -> f64 + Sync) -> f64 {
        let width = self.width;
        let rows: Vec<f64> = (0..self.data.len() / width)
            .into_par_iter()
            .map(|y| (y * width..(y + 1) * width).map(&term).sum())
            .collect();
        rows.iter().sum()
    }

    /// Weights to the pixels on the left and above.
    fn before(&self, i: usize) -> [f64; 2] {
        let left = if i.is_multiple_of(self.width) {
            0.0
        } else {
            self.right[i - 1]
        };
        [
            left,
            i.checked_sub(self.width)
                .map_or(0.0, |above| self.down[above]),
        ]
    }

    fn diagonal(&self) -> Vec<f64> {
        (0..self.data.len())
            .map(|i| {
                let [left, above] = self.before(i);
                // A pixel without data and neighbours would divide by 0.
                (self.data[i] + self.right[i] + self.down[i] + left + above).max(f64::MIN_POSITIVE)
            })
            .collect()
    }

    fn apply(&self, u: &[f64], to: &mut [f64]) {
        let width = self.width;
        (to.par_chunks_mut(width).enumerate()).for_each(|(y, to)| {
            for (x, to) in to.iter_mut().enumerate() {
                let i = y * width + x;
                let [left, above] = self.before(i);
                let mut sum = self.data[i] * u[i];
                for (weight, j) in [
                    (self.right[i], i + 1),
                    (left, i.wrapping_sub(1)),
                    (self.down[i], i + width),
                    (above, i.wrapping_sub(width)),
                ] {
                    if let Some(other) = u.get(j) {
                        sum += weight * (u[i] - other);
                    }
                }
                *to = sum;
            }
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_step_at_an_edge_stays_and_an_outlier_goes() {
        let (width, height) = (24, 16);
        let step = |i: usize| if i % width < 12 { 0.0 } else { 1.0 };
        let guide = (0..width * height).map(|i| step(i) as f32).collect();
        let guide = Image::from_vec(width, height, 1, guide).unwrap();
        let mut v: Vec<f64> = (0..width * height).map(|i| 2.0 * step(i)).collect();
        let mut c = vec![1.0; v.len()];
        (v[8 * width + 5], c[8 * width + 5]) = (3.0, 0.3);
        let edges = Edges {
            guide: &guide,
            noise: 0.0,
            weight: 100.0,
            contrast: 0.015,
        };
        let u = surface(&v, &c, &edges);
        for (i, u) in u.iter().enumerate() {
            assert!((u - 2.0 * step(i)).abs() < 0.1, "{i}: {u}");
        }
    }
}
