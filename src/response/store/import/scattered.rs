//! A smooth function of (u, v) from values at scattered places: moving least squares.
//!
//! At each place a quadratic is fitted to the nearest [`NEIGHBOURS`] samples with weights `(1 − d/R)² / (d² + ε²)`
//! (Lancaster & Salkauskas, Math. Comp. 37, 141 (1981)), d the distance and R that of the first sample left out; its
//! value there is the answer. So quadratics come back exactly, samples nearly so, and where samples do not determine a
//! quadratic (few of them, or in a line) a plane is fitted, or their mean taken.

/// Samples in a fit; a quadratic has six coefficients.
const NEIGHBOURS: usize = 16;
/// ε in lengths of R.
const SOFTNESS: f64 = 1e-3;
/// A pivot below this part of the largest entry means that the samples do not determine the fit.
const SINGULAR: f64 = 1e-9;

/// One direction: (u, v) and P of every sub-pixel.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub at: [f64; 2],
    pub p: Vec<f64>,
}

/// Samples of one wavelength.
pub(super) struct Scattered {
    samples: Vec<Sample>,
    count: usize,
}

impl Scattered {
    pub fn new(samples: Vec<Sample>, count: usize) -> Self {
        Self { samples, count }
    }

    /// sin θ of the outermost sample.
    pub fn rim(&self) -> f64 {
        let sines = self.samples.iter().map(|s| s.at[0].hypot(s.at[1]));
        sines.fold(0.0, f64::max)
    }

    /// Distance of the nearest sample.
    pub fn nearest(&self, at: [f64; 2]) -> f64 {
        let distances = self.samples.iter().map(|s| distance(s.at, at));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// The value of every sub-pixel at (u, v).
    pub fn at(&self, at: [f64; 2]) -> Vec<f64> {
        let mut near: Vec<(f64, &Sample)> = self
            .samples
            .iter()
            .map(|s| (distance(s.at, at), s))
            .collect();
        let neighbours = NEIGHBOURS.min(near.len() - 1);
        near.select_nth_unstable_by(neighbours, |a, b| a.0.total_cmp(&b.0));
        let reach = near[neighbours].0.max(1e-9);
        let weighed: Vec<(f64, [f64; 6], &Sample)> = near[..neighbours.max(1)]
            .iter()
            .map(|&(d, sample)| {
                let (x, y) = (
                    (sample.at[0] - at[0]) / reach,
                    (sample.at[1] - at[1]) / reach,
                );
                let d = d / reach;
                // A lone sample lies at its own reach and still counts.
                let weight = (1.0 - d).powi(2).max(1e-12) / (d * d + SOFTNESS * SOFTNESS);
                (weight, [1.0, x, y, x * x, x * y, y * y], sample)
            })
            .collect();
        [6, 3, 1]
            .into_iter()
            .find_map(|terms| self.fit(&weighed, terms))
            .unwrap_or_else(|| weighed[0].2.p.clone())
    }

    /// The fit's value at the origin, by normal equations; `None` if the samples do not determine it.
    fn fit(&self, weighed: &[(f64, [f64; 6], &Sample)], terms: usize) -> Option<Vec<f64>> {
        if weighed.len() < terms {
            return None;
        }
        let columns = terms + self.count;
        let mut m = vec![0.0; terms * columns];
        for (w, basis, sample) in weighed {
            for i in 0..terms {
                let row = &mut m[i * columns..(i + 1) * columns];
                for (entry, b) in row.iter_mut().zip(&basis[..terms]) {
                    *entry += w * basis[i] * b;
                }
                for (entry, p) in row[terms..].iter_mut().zip(&sample.p) {
                    *entry += w * basis[i] * p;
                }
            }
        }
        // Each unknown by its own size, so that pivots can be compared: the value itself is pinned far harder than the
        // curvature.
        let size: Vec<f64> = (0..terms).map(|i| m[i * columns + i].sqrt()).collect();
        for i in 0..terms {
            for j in 0..columns {
                let by = size[i] * if j < terms { size[j] } else { 1.0 };
                m[i * columns + j] /= by;
            }
        }
        // The matrix is positive definite: elimination needs no exchange of rows.
        for i in 0..terms {
            let pivot = m[i * columns + i];
            if pivot.is_nan() || pivot < SINGULAR {
                return None;
            }
            for r in 0..terms {
                if r != i {
                    let by = m[r * columns + i] / pivot;
                    for j in i..columns {
                        m[r * columns + j] -= by * m[i * columns + j];
                    }
                }
            }
        }
        let value = |k: usize| m[terms + k] / m[0] / size[0];
        Some((0..self.count).map(value).collect())
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
