//! A trial: the lens as polynomials from sensor place and pupil point to the ray in the scene, to see whether tracing could be faster.
//!
//! With x the place on the sensor, p the point in the plane that rays are aimed at (both as parts of their largest), an aligned lens turns
//! about its axis, so that with a = x·x, b = x·p, c = p·p
//!
//! ```text
//! X = x f₁(a, b, c) + p f₂(a, b, c)        M = x f₃(a, b, c) + p f₄(a, b, c)
//! ```
//!
//! are exact for some f: X where the ray meets a plane, M its slope (D_x, D_y)/D_z. Each f is a polynomial in Chebyshev terms of total degree n,
//! fitted by least squares to traced rays of the whole field or of a ring of it. It knows no aperture, and nothing of tilted or decentred
//! elements.

use glam::DVec2;
use quadpixel::rays::Ray;

/// Rays evaluated together.
const LANES: usize = 8;

/// The polynomials.
pub struct LensMap {
    degree: usize,
    sensor_mm: f64,
    pupil_mm: f64,
    /// Middle and inverse half width of a, b, c over the rays fitted: the terms' arguments are −1 to 1 there.
    ranges: [(f64, f64); 3],
    /// f₁ to f₄ of each term.
    terms: Vec<[f64; 4]>,
}

/// A traced ray: where it starts, where it is aimed, where it goes.
#[derive(Clone, Copy)]
pub struct Traced {
    /// On the sensor, camera frame, mm.
    pub sensor_mm: DVec2,
    /// In the plane aimed at, mm.
    pub pupil_mm: DVec2,
    /// On the plane of the scene, mm.
    pub place_mm: DVec2,
    /// (D_x, D_y)/D_z.
    pub slope: DVec2,
}

impl Traced {
    /// From the ray that leaves the lens, on the plane z.
    pub fn new(sensor_mm: DVec2, pupil_mm: DVec2, out: Ray, plane_z_mm: f64) -> Self {
        let slope = out.direction.truncate() / out.direction.z;
        Self {
            sensor_mm,
            pupil_mm,
            place_mm: out.origin_mm.truncate() + (plane_z_mm - out.origin_mm.z) * slope,
            slope,
        }
    }
}

impl LensMap {
    /// Fits rays all over the sensor and the pupil. `None` where there are too few.
    pub fn fit(rays: &[Traced], degree: usize) -> Option<Self> {
        let largest =
            |of: &dyn Fn(&Traced) -> DVec2| rays.iter().map(|r| of(r).length()).fold(0.0, f64::max);
        let mut map = Self {
            degree,
            sensor_mm: largest(&|r| r.sensor_mm),
            pupil_mm: largest(&|r| r.pupil_mm),
            ranges: [(0.0, 1.0); 3],
            terms: Vec::new(),
        };
        let invariants = rays
            .iter()
            .map(|r| map.invariants(r.sensor_mm / map.sensor_mm, r.pupil_mm / map.pupil_mm));
        let ends = invariants.fold([(f64::INFINITY, f64::NEG_INFINITY); 3], |ends, at| {
            std::array::from_fn(|i| (ends[i].0.min(at[i]), ends[i].1.max(at[i])))
        });
        map.ranges = ends.map(|(low, high)| (0.5 * (low + high), 2.0 / (high - low).max(1e-9)));
        let count = terms(degree);
        // Unknowns of a pair: its f of x, then that of p; equations: both components of every ray.
        let n = 2 * count;
        let (mut normal, mut right) = (vec![0.0; n * n], [vec![0.0; n], vec![0.0; n]]);
        let mut row = vec![0.0; n];
        for ray in rays {
            let (x, p) = (ray.sensor_mm / map.sensor_mm, ray.pupil_mm / map.pupil_mm);
            let values = map.values(x, p);
            for axis in 0..2 {
                for (k, t) in values.iter().enumerate() {
                    (row[k], row[count + k]) = (t * x[axis], t * p[axis]);
                }
                for i in 0..n {
                    for j in 0..=i {
                        normal[i * n + j] += row[i] * row[j];
                    }
                    right[0][i] += row[i] * ray.place_mm[axis];
                    right[1][i] += row[i] * ray.slope[axis];
                }
            }
        }
        let root = cholesky(normal, n)?;
        let [place, slope] = right.map(|b| solved(&root, n, b));
        map.terms = (0..count)
            .map(|k| [place[k], place[count + k], slope[k], slope[count + k]])
            .collect();
        Some(map)
    }

    /// a, b, c, each as an argument of the terms.
    #[inline(always)]
    fn invariants(&self, x: DVec2, p: DVec2) -> [f64; 3] {
        let of = [x.dot(x), x.dot(p), p.dot(p)];
        std::array::from_fn(|i| (of[i] - self.ranges[i].0) * self.ranges[i].1)
    }

    /// Terms at one ray, in the order in which [`Self::map`] sums them.
    fn values(&self, x: DVec2, p: DVec2) -> Vec<f64> {
        let [a, b, c] = self.invariants(x, p).map(|t| chebyshev(t, self.degree));
        let mut all = Vec::with_capacity(terms(self.degree));
        for (i, a) in a.iter().enumerate() {
            for (j, b) in b[..=self.degree - i].iter().enumerate() {
                all.extend(c[..=self.degree - i - j].iter().map(|c| a * b * c));
            }
        }
        all
    }

    /// Place on the scene's plane and slope of many rays, `[x, y, slope x, slope y]` each. All slices are of one length.
    pub fn map(&self, sensor_mm: &[DVec2], pupil_mm: &[DVec2], out: &mut [[f64; 4]]) {
        let chunks = sensor_mm
            .chunks(LANES)
            .zip(pupil_mm.chunks(LANES))
            .zip(out.chunks_mut(LANES));
        for ((sensor, pupil), out) in chunks {
            // Lanes beyond the end repeat the first ray.
            let x: [DVec2; LANES] =
                std::array::from_fn(|l| sensor.get(l).unwrap_or(&sensor[0]) / self.sensor_mm);
            let p: [DVec2; LANES] =
                std::array::from_fn(|l| pupil.get(l).unwrap_or(&pupil[0]) / self.pupil_mm);
            let f = self.sums(&x, &p);
            for (l, out) in out.iter_mut().enumerate() {
                let (place, slope) = (
                    x[l] * f[0][l] + p[l] * f[1][l],
                    x[l] * f[2][l] + p[l] * f[3][l],
                );
                *out = [place.x, place.y, slope.x, slope.y];
            }
        }
    }

    /// f₁ to f₄ of [`LANES`] rays.
    #[inline]
    fn sums(&self, x: &[DVec2; LANES], p: &[DVec2; LANES]) -> [[f64; LANES]; 4] {
        // As of `invariants`, but lane beside lane.
        let argument = |i: usize, of: [f64; LANES]| {
            let (middle, scale) = self.ranges[i];
            powers(of.map(|t| (t - middle) * scale), self.degree)
        };
        let a = argument(0, std::array::from_fn(|l| x[l].dot(x[l])));
        let b = argument(1, std::array::from_fn(|l| x[l].dot(p[l])));
        let c = argument(2, std::array::from_fn(|l| p[l].dot(p[l])));
        let mut f = [[0.0; LANES]; 4];
        let mut terms = self.terms.iter();
        for (i, a) in a.iter().enumerate().take(self.degree + 1) {
            for (j, b) in b.iter().enumerate().take(self.degree + 1 - i) {
                let ab: [f64; LANES] = std::array::from_fn(|l| a[l] * b[l]);
                for (c, term) in c.iter().take(self.degree + 1 - i - j).zip(&mut terms) {
                    for l in 0..LANES {
                        let t = ab[l] * c[l];
                        for (f, coefficient) in f.iter_mut().zip(term) {
                            f[l] += coefficient * t;
                        }
                    }
                }
            }
        }
        f
    }
}

/// Largest degree.
pub const LARGEST_DEGREE: usize = 9;

/// T_0 to T_n of many numbers; places beyond n stay 0.
fn powers(t: [f64; LANES], degree: usize) -> [[f64; LANES]; LARGEST_DEGREE + 1] {
    let mut all = [[0.0; LANES]; LARGEST_DEGREE + 1];
    all[0] = [1.0; LANES];
    all[1] = t;
    for k in 2..=degree {
        all[k] = std::array::from_fn(|l| 2.0 * t[l] * all[k - 1][l] - all[k - 2][l]);
    }
    all
}

fn chebyshev(t: f64, degree: usize) -> Vec<f64> {
    let all = powers([t; LANES], degree);
    all[..=degree].iter().map(|p| p[0]).collect()
}

/// Terms T_i T_j T_k with i + j + k ≤ n.
fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) * (degree + 3) / 6
}

/// Lower root of a symmetric matrix, its lower half given row by row; `None` where it is not positive.
fn cholesky(mut m: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    // Terms that rounding cannot tell apart (b² ≤ a c leaves corners empty) are held down.
    let ridge = 1e-12 * (0..n).map(|i| m[i * n + i]).fold(0.0, f64::max);
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| m[i * n + k] * m[j * n + k]).sum();
            let rest = m[i * n + j] - dot;
            m[i * n + j] = if i == j {
                (rest + ridge > 0.0).then(|| (rest + ridge).sqrt())?
            } else {
                rest / m[j * n + j]
            };
        }
    }
    Some(m)
}

fn solved(root: &[f64], n: usize, mut b: Vec<f64>) -> Vec<f64> {
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| root[i * n + k] * b[k]).sum();
        b[i] = (b[i] - dot) / root[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| root[k * n + i] * b[k]).sum();
        b[i] = (b[i] - dot) / root[i * n + i];
    }
    b
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_lens_that_is_a_polynomial_comes_back() {
        let at =
            |i: usize, k: i32| (0.5 + i as f64 * 1.324_717_95_f64.powi(-k)).fract() * 2.0 - 1.0;
        let rays: Vec<Traced> = (0..600)
            .map(|i| {
                let (x, p) = (
                    DVec2::new(at(i, 1), at(i, 2)) * 3.0,
                    DVec2::new(at(i, 3), at(i, 4)) * 0.7,
                );
                let (a, b, c) = (x.dot(x), x.dot(p), p.dot(p));
                Traced {
                    sensor_mm: x,
                    pupil_mm: p,
                    place_mm: x * (1.0 + 0.1 * a * b) + p * (0.2 * c - 0.03 * a * a * c),
                    slope: p * (1.0 - 0.4 * b) + x * 0.3,
                }
            })
            .collect();
        let map = LensMap::fit(&rays, 3).unwrap();
        let (sensor, pupil): (Vec<DVec2>, Vec<DVec2>) =
            rays.iter().map(|r| (r.sensor_mm, r.pupil_mm)).unzip();
        let mut out = vec![[0.0; 4]; rays.len()];
        map.map(&sensor, &pupil, &mut out);
        for (ray, out) in rays.iter().zip(&out) {
            let off = [
                ray.place_mm.x - out[0],
                ray.place_mm.y - out[1],
                ray.slope.x - out[2],
                ray.slope.y - out[3],
            ];
            // What the ridge of 1e-12 bends.
            assert!(off.iter().all(|d| d.abs() < 1e-6), "{off:?}");
        }
    }
}
