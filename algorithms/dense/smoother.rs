//! A surface through uncertain numbers, bent where the picture has edges.
//!
//! ```text
//! u minimises  Σ c ρ((u − v)/o) + λ Σ w ψ(∇u / t),    ρ(x) = x²/(1 + x²) · o²,    ψ(x) = √(1 + x²) · t²
//! ```
//!
//! c is the curvature of the cost at v, w small across edges of the picture. ρ (Geman & McClure) lets a wrong number
//! give in, ψ (Charbonnier) lets a depth step stay one. Each round of reweighted least squares is solved by conjugate
//! gradients.

use rayon::prelude::*;

use super::guide::Guide;

/// How stiff the surface is.
#[derive(Clone, Copy)]
pub(super) struct Stiffness {
    /// λ, in units of the median c.
    pub weight: f64,
    /// Contrast across which λ is e times less, parts of white, where there is no noise.
    pub contrast: f64,
}

/// Where, and how much, the surface may bend.
pub(super) struct Edges<'a> {
    /// The picture whose edges count.
    pub guide: &'a Guide,
    /// Standard deviation of the noise of a contrast between its neighbours, parts of white.
    pub noise: f64,
    /// Between the edges, and across them.
    pub stiffness: Stiffness,
}

/// Standard deviations of the noise that are added (in quadrature) to the contrast that counts.
const DEVIATIONS: f64 = 2.0;
/// What is left of λ across the sharpest edge.
const LEAST: f64 = 0.01;
/// t, px of the level per pixel.
const STEP_PX: f32 = 0.004;
/// o, px of the level.
const OUTLIER_PX: f32 = 0.125;
/// Rounds of reweighting, and steps of each.
const ROUNDS: usize = 6;
const STEPS: usize = 40;

/// The surface through `v` with the weights `c` (median 1), row-major as the guide; lengths in px of the level.
pub(super) fn surface(v: &[f64], c: &[f64], edges: &Edges<'_>) -> Vec<f64> {
    let guide = edges.guide;
    let (width, height) = (guide.width(), guide.height());
    let Stiffness { weight, contrast } = edges.stiffness;
    let contrast = contrast.hypot(DEVIATIONS * edges.noise);
    let edge = |i: usize, j: usize| {
        let alike = (-f64::from(guide.contrast(i, j)) / contrast).exp();
        weight * (alike + LEAST)
    };
    let (mut right, mut down) = (vec![0.0f32; v.len()], vec![0.0f32; v.len()]);
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            if x + 1 < width {
                right[i] = edge(i, i + 1) as f32;
            }
            if y + 1 < height {
                down[i] = edge(i, i + width) as f32;
            }
        }
    }
    let single = |values: &[f64]| -> Vec<f32> { values.iter().map(|x| *x as f32).collect() };
    let (v, c) = (single(v), single(c));
    let mut u = v.clone();
    for _ in 0..ROUNDS {
        let slope = |a: f32, b: f32| 1.0 / (1.0 + ((a - b) / STEP_PX).powi(2)).sqrt();
        let pixels = || (0..v.len()).into_par_iter();
        let data = |i: usize| c[i] / (1.0 + ((u[i] - v[i]) / OUTLIER_PX).powi(2)).powi(2);
        // At the last pixel of a row or column the weight is 0, whatever the slope.
        let to_next = |i: usize, next: usize| u.get(next).map_or(0.0, |next| slope(u[i], *next));
        let system = System {
            width,
            data: pixels().map(data).collect(),
            right: pixels().map(|i| right[i] * to_next(i, i + 1)).collect(),
            down: pixels().map(|i| down[i] * to_next(i, i + width)).collect(),
        };
        system.solve(&v, &mut u);
    }
    u.iter().map(|u| f64::from(*u)).collect()
}

/// (diag(data) + Laplacian) u = data v; `right` and `down`: weights to the next pixel, 0 at the last ones.
///
/// Single precision, as memory is the floor: a step reads and writes about 16 arrays. Sums are double.
struct System {
    width: usize,
    data: Vec<f32>,
    right: Vec<f32>,
    down: Vec<f32>,
}

impl System {
    /// Conjugate gradients, scaled by the diagonal, from the `u` given. Sums go row by row: the same whatever the
    /// threads.
    fn solve(&self, v: &[f32], u: &mut [f32]) {
        let width = self.width;
        let inverse = self.inverse_diagonal();
        let mut product = vec![0.0; v.len()];
        self.apply(u, &mut product);
        let mut residual: Vec<f32> = (0..v.len())
            .map(|i| self.data[i] * v[i] - product[i])
            .collect();
        let mut direction: Vec<f32> = residual.iter().zip(&inverse).map(|(r, d)| r * d).collect();
        let mut size = dot(&residual, &direction);
        for _ in 0..STEPS {
            let bend = self.apply(&direction, &mut product);
            if bend <= 0.0 || size <= 0.0 {
                return;
            }
            let step = (size / bend) as f32;
            let rows = (u.par_chunks_mut(width)).zip(residual.par_chunks_mut(width));
            let moves = (direction.par_chunks(width)).zip(product.par_chunks(width));
            let sums: Vec<f64> = (rows.zip(moves).zip(inverse.par_chunks(width)))
                .map(|(((u, r), (d, p)), scale)| {
                    u.iter_mut().zip(d).for_each(|(u, d)| *u += step * d);
                    r.iter_mut().zip(p).for_each(|(r, p)| *r -= step * p);
                    let squares = r.iter().zip(scale).map(|(r, s)| f64::from(r * r * s));
                    squares.sum()
                })
                .collect();
            let next: f64 = sums.iter().sum();
            let back = (next / size) as f32;
            size = next;
            let rows = (residual.par_chunks(width)).zip(inverse.par_chunks(width));
            (direction.par_chunks_mut(width).zip(rows)).for_each(|(d, (r, scale))| {
                let row = d.iter_mut().zip(r.iter().zip(scale));
                row.for_each(|(d, (r, scale))| *d = r * scale + back * *d);
            });
        }
    }

    /// 1 over the diagonal.
    fn inverse_diagonal(&self) -> Vec<f32> {
        let width = self.width;
        let of = |i: usize| {
            let left = if i.is_multiple_of(width) {
                0.0
            } else {
                self.right[i - 1]
            };
            let above = i.checked_sub(width).map_or(0.0, |above| self.down[above]);
            // A pixel without data and neighbours would divide by 0.
            let sum = self.data[i] + self.right[i] + self.down[i] + left + above;
            sum.max(f32::MIN_POSITIVE).recip()
        };
        (0..self.data.len()).into_par_iter().map(of).collect()
    }

    /// The left side of `u`; its scalar product with `u`.
    fn apply(&self, u: &[f32], to: &mut [f32]) -> f64 {
        let width = self.width;
        let rows = to.par_chunks_mut(width).enumerate();
        let sums: Vec<f64> = rows
            .map(|(y, to)| {
                let at = y * width..(y + 1) * width;
                let row = &u[at.clone()];
                let own = row.iter().zip(&self.data[at.clone()]);
                to.iter_mut().zip(own).for_each(|(to, (u, d))| *to = d * u);
                // Each difference to the next pixel of the row is that of both.
                let right = &self.right[at.clone()];
                for x in 0..width - 1 {
                    let pull = right[x] * (row[x] - row[x + 1]);
                    to[x] += pull;
                    to[x + 1] -= pull;
                }
                let mut pull = |other: &[f32], weights: &[f32]| {
                    let pairs = row.iter().zip(other).zip(weights);
                    (to.iter_mut().zip(pairs))
                        .for_each(|(to, ((u, other), w))| *to += w * (u - other));
                };
                if let Some(below) = u.get(at.end..at.end + width) {
                    pull(below, &self.down[at.clone()]);
                }
                if y > 0 {
                    let above = at.start - width..at.start;
                    pull(&u[above.clone()], &self.down[above]);
                }
                dot(row, to)
            })
            .collect();
        sums.iter().sum()
    }
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::image::Image;

    #[test]
    fn a_step_at_an_edge_stays_and_an_outlier_goes() {
        let (width, height) = (24, 16);
        let step = |i: usize| if i % width < 12 { 0.0 } else { 1.0 };
        let guide = (0..width * height).map(|i| step(i) as f32).collect();
        let guide = Guide::new(&Image::from_vec(width, height, 1, guide).unwrap(), false);
        let mut v: Vec<f64> = (0..width * height).map(|i| 2.0 * step(i)).collect();
        let mut c = vec![1.0; v.len()];
        (v[8 * width + 5], c[8 * width + 5]) = (3.0, 0.3);
        let edges = Edges {
            guide: &guide,
            noise: 0.0,
            stiffness: Stiffness {
                weight: 100.0,
                contrast: 0.015,
            },
        };
        let u = surface(&v, &c, &edges);
        for (i, u) in u.iter().enumerate() {
            assert!((u - 2.0 * step(i)).abs() < 0.1, "{i}: {u}");
        }
    }

    #[test]
    fn the_solution_is_that_of_the_plain_equations() {
        let (width, height) = (9, 6);
        let count = width * height;
        let number = |i: usize, k: usize| ((i * 37 + k * 11) % 23) as f32 / 23.0;
        let system = System {
            width,
            data: (0..count).map(|i| 0.05 + number(i, 0)).collect(),
            right: (0..count)
                .map(|i| {
                    if i % width + 1 < width {
                        2.0 * number(i, 1)
                    } else {
                        0.0
                    }
                })
                .collect(),
            down: (0..count)
                .map(|i| {
                    if i + width < count {
                        2.0 * number(i, 2)
                    } else {
                        0.0
                    }
                })
                .collect(),
        };
        let v: Vec<f32> = (0..count).map(|i| number(i, 3) - 0.5).collect();
        // (diag(data) + Laplacian) u, pair by pair.
        let plain = |u: &[f32]| -> Vec<f64> {
            let mut sum: Vec<f64> = (0..count)
                .map(|i| f64::from(system.data[i]) * f64::from(u[i]))
                .collect();
            for i in 0..count {
                for (weight, next) in [(system.right[i], i + 1), (system.down[i], i + width)] {
                    if weight > 0.0 {
                        let pull = f64::from(weight) * (f64::from(u[i]) - f64::from(u[next]));
                        (sum[i], sum[next]) = (sum[i] + pull, sum[next] - pull);
                    }
                }
            }
            sum
        };
        let mut product = vec![0.0; count];
        let square = system.apply(&v, &mut product);
        let wanted = plain(&v);
        for (found, wanted) in product.iter().zip(&wanted) {
            assert!((f64::from(*found) - wanted).abs() < 1e-6);
        }
        let wanted: f64 = wanted.iter().zip(&v).map(|(a, b)| a * f64::from(*b)).sum();
        assert!((square - wanted).abs() < 1e-5);
        let mut u = vec![0.0; count];
        system.solve(&v, &mut u);
        for (i, left) in plain(&u).iter().enumerate() {
            let right = f64::from(system.data[i]) * f64::from(v[i]);
            assert!((left - right).abs() < 1e-4, "{i}: {left} for {right}");
        }
    }
}
