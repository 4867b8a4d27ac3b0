//! Polynomials on the unit disk: Koornwinder's orthogonal ones to fit with, powers to evaluate.
//!
//! With Gegenbauer's C and Legendre's P, made homogeneous so that there is no root (Koornwinder, in Theory and
//! Application of Special Functions, Academic Press (1975), 435; Dunkl & Xu, Orthogonal Polynomials of Several
//! Variables, section 2.3):
//!
//! ```text
//! B_nk(p, q) = C_{n−k}^{(k+1)}(p) L_k(q; 1 − p²)          L_k(q; s) = s^{k/2} P_k(q/√s)
//! ```
//!
//! Powers stand in the order in which Horner's rule takes them: those of q from the highest to none, for each of them
//! those of p from the highest to none.

/// Number of terms of a total degree.
pub(crate) const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Place of pⁱ qʲ among the powers of a total degree.
const fn place(degree: usize, i: usize, j: usize) -> usize {
    // All rows of higher powers of q are shorter: 1, 2, 3, … terms.
    let rows = degree - j;
    rows * (rows + 1) / 2 + (rows - i)
}

/// The orthogonal polynomials at a point, in the order of their numbers (n, k).
pub(in crate::lens) fn values(degree: usize, p: f64, q: f64, out: &mut [f64]) {
    let s = 1.0 - p * p;
    let (mut legendre, mut before) = (1.0, 0.0);
    for k in 0..=degree {
        let lambda = k as f64 + 1.0;
        let (mut c, mut previous) = (1.0, 0.0);
        for m in 0..=degree - k {
            out[number(m + k, k)] = c * legendre * norm(m + k, k);
            let next = gegenbauer(m, lambda);
            (c, previous) = (next[0] * p * c - next[1] * previous, c);
        }
        let next = self::legendre(k);
        (legendre, before) = (next[0] * q * legendre - next[1] * s * before, legendre);
    }
}

/// The same polynomials by their coefficients of the powers: row after row, one per polynomial.
pub(in crate::lens) fn in_powers(degree: usize) -> Vec<f64> {
    let count = terms(degree);
    let mut out = vec![0.0; count * count];
    let times = |of: &[f64], di: usize, dj: usize, factor: f64, to: &mut [f64]| {
        for j in 0..=degree {
            for i in 0..=degree - j {
                let value = of[place(degree, i, j)];
                if value != 0.0 && i + j + di + dj <= degree {
                    to[place(degree, i + di, j + dj)] += factor * value;
                }
            }
        }
    };
    let zero = vec![0.0; count];
    let mut one = zero.clone();
    one[place(degree, 0, 0)] = 1.0;
    let (mut legendre, mut before) = (one, zero.clone());
    for k in 0..=degree {
        let (mut c, mut previous) = (legendre.clone(), zero.clone());
        for m in 0..=degree - k {
            let row = &mut out[number(m + k, k) * count..][..count];
            times(&c, 0, 0, norm(m + k, k), row);
            let next = gegenbauer(m, k as f64 + 1.0);
            let mut higher = zero.clone();
            times(&c, 1, 0, next[0], &mut higher);
            times(&previous, 0, 0, -next[1], &mut higher);
            (c, previous) = (higher, c);
        }
        let next = self::legendre(k);
        let mut higher = zero.clone();
        times(&legendre, 0, 1, next[0], &mut higher);
        times(&before, 0, 0, -next[1], &mut higher);
        times(&before, 2, 0, next[1], &mut higher);
        (legendre, before) = (higher, legendre);
    }
    out
}

fn number(n: usize, k: usize) -> usize {
    n * (n + 1) / 2 + k
}

/// 1 over the root mean square over the disk.
fn norm(n: usize, k: usize) -> f64 {
    let m = n - k;
    let binomial = (1..=m).fold(1.0, |b, i| b * (2 * k + 1 + i) as f64 / i as f64);
    // ∫ (1−p²)^{k+1/2} C² dp · ∫ P_k² = 2^{−2k−1} π (m + 2k + 1)! / (m! (m+k+1) k!²) · 2/(2k+1), over π.
    let factorials = (1..=2 * k + 1).fold(1.0, |f, i| f * i as f64)
        / (1..=k).fold(1.0, |f, i| f * (i * i) as f64);
    let squared = 2f64.powi(-2 * k as i32) * binomial * factorials
        / ((m + k + 1) as f64 * (2 * k + 1) as f64);
    1.0 / squared.sqrt()
}

/// C_{m+1} = a p C_m − b C_{m−1}.
fn gegenbauer(m: usize, lambda: f64) -> [f64; 2] {
    let m = m as f64;
    [
        2.0 * (m + lambda) / (m + 1.0),
        (m + 2.0 * lambda - 1.0) / (m + 1.0),
    ]
}

/// L_{k+1} = a q L_k − b s L_{k−1}.
fn legendre(k: usize) -> [f64; 2] {
    let k = k as f64;
    [(2.0 * k + 1.0) / (k + 1.0), k / (k + 1.0)]
}

/// Σ c pⁱ qʲ, the plain way.
#[cfg(test)]
pub(in crate::lens) fn sum_of_powers(degree: usize, coefficients: &[f64], p: f64, q: f64) -> f64 {
    let each = (0..=degree).flat_map(|j| (0..=degree - j).map(move |i| (i, j)));
    each.map(|(i, j)| coefficients[place(degree, i, j)] * p.powi(i as i32) * q.powi(j as i32))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_orthonormal_and_their_powers_sum_to_them() {
        let degree = 9;
        let count = terms(degree);
        let powers = in_powers(degree);
        let mut gram = vec![0.0; count * count];
        // Gauss–Legendre would do with few; the midpoint rule in angle is exact, in r² good to 1e-5.
        let (rings, spokes) = (2000, 24);
        let mut v = vec![0.0; count];
        for ring in 0..rings {
            let r = ((ring as f64 + 0.5) / rings as f64).sqrt();
            for spoke in 0..spokes {
                let (sin, cos) = (std::f64::consts::TAU * spoke as f64 / spokes as f64).sin_cos();
                values(degree, r * cos, r * sin, &mut v);
                if ring % 500 == 3 {
                    for (n, &value) in v.iter().enumerate() {
                        let row = &powers[n * count..][..count];
                        let sum = sum_of_powers(degree, row, r * cos, r * sin);
                        assert!((sum - value).abs() < 1e-11);
                    }
                }
                for i in 0..count {
                    for j in 0..count {
                        gram[i * count + j] += v[i] * v[j] / (rings * spokes) as f64;
                    }
                }
            }
        }
        for i in 0..count {
            for j in 0..count {
                let exact = f64::from(i == j);
                assert!(
                    (gram[i * count + j] - exact).abs() < 2e-4,
                    "{i} {j} {}",
                    gram[i * count + j]
                );
            }
        }
    }
}
