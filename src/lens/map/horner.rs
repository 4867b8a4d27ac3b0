//! Polynomials of many rays by Horner's rule, with the vectors of each instruction set.
//!
//! Written with intrinsics, as compilers part the sums of few rays across outputs, which takes three to four times as
//! long. Every operation is a fused multiply-add of one lane, so that all sets give the same bits.

/// Rays side by side in f32.
pub(super) trait Lanes: Copy {
    /// How many.
    const COUNT: usize;
    /// All the same.
    fn splat(x: f32) -> Self;
    /// The first [`Lanes::COUNT`] of `from`.
    fn load(from: &[f32]) -> Self;
    /// Into the first [`Lanes::COUNT`] of `to`.
    fn store(self, to: &mut [f32]);
    /// self · p + c.
    fn times_plus(self, p: Self, c: Self) -> Self;
}

/// Without instructions of any set.
impl Lanes for [f32; 8] {
    const COUNT: usize = 8;
    #[inline(always)]
    fn splat(x: f32) -> Self {
        [x; 8]
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        std::array::from_fn(|i| from[i])
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..8].copy_from_slice(&self);
    }
    #[inline(always)]
    fn times_plus(self, p: Self, c: Self) -> Self {
        std::array::from_fn(|i| self[i].mul_add(p[i], c[i]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use std::arch::x86_64::{
        __m256, __m512, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_set1_ps, _mm256_storeu_ps,
        _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_set1_ps, _mm512_storeu_ps,
    };

    use super::Lanes;

    /// AVX2 with FMA; to be used where these were found only.
    impl Lanes for __m256 {
        const COUNT: usize = 8;
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: the instructions are there, see the type.
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn load(from: &[f32]) -> Self {
            let from = &from[..8];
            // SAFETY: the instructions are there, see the type; eight values are.
            unsafe { _mm256_loadu_ps(from.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f32]) {
            let to = &mut to[..8];
            // SAFETY: the instructions are there, see the type; there is room for eight values.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self) }
        }
        #[inline(always)]
        fn times_plus(self, p: Self, c: Self) -> Self {
            // SAFETY: the instructions are there, see the type.
            unsafe { _mm256_fmadd_ps(self, p, c) }
        }
    }

    /// AVX-512 F; to be used where it was found only.
    impl Lanes for __m512 {
        const COUNT: usize = 16;
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: the instructions are there, see the type.
            unsafe { _mm512_set1_ps(x) }
        }
        #[inline(always)]
        fn load(from: &[f32]) -> Self {
            let from = &from[..16];
            // SAFETY: the instructions are there, see the type; sixteen values are.
            unsafe { _mm512_loadu_ps(from.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f32]) {
            let to = &mut to[..16];
            // SAFETY: the instructions are there, see the type; there is room for sixteen values.
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self) }
        }
        #[inline(always)]
        fn times_plus(self, p: Self, c: Self) -> Self {
            // SAFETY: the instructions are there, see the type.
            unsafe { _mm512_fmadd_ps(self, p, c) }
        }
    }
}

/// Sums that hide each other's latency.
const SUMS: usize = 8;

/// K polynomials by Horner's rule, in q of those in p. `coefficients`: of all K of a term, term after term. N is a
/// multiple of two vectors.
#[inline(always)]
pub(super) fn polynomial<V: Lanes, const N: usize, const K: usize>(
    coefficients: &[f32],
    degree: usize,
    at: (&[f32; N], &[f32; N]),
    out: &mut [[f32; N]; K],
) {
    // Vectors that go through the terms together.
    if N.is_multiple_of(4 * V::COUNT) && 4 * K <= SUMS {
        sums::<V, N, K, 4>(coefficients, degree, at, out);
    } else {
        sums::<V, N, K, 2>(coefficients, degree, at, out);
    }
}

#[inline(always)]
fn sums<V: Lanes, const N: usize, const K: usize, const TOGETHER: usize>(
    coefficients: &[f32],
    degree: usize,
    (p, q): (&[f32; N], &[f32; N]),
    out: &mut [[f32; N]; K],
) {
    for first in (0..N).step_by(TOGETHER * V::COUNT) {
        let vector = |from: &[f32; N], v: usize| V::load(&from[first + v * V::COUNT..]);
        let p: [V; TOGETHER] = std::array::from_fn(|v| vector(p, v));
        let q: [V; TOGETHER] = std::array::from_fn(|v| vector(q, v));
        let mut sums = [[V::splat(0.0); TOGETHER]; K];
        let mut terms = coefficients.chunks_exact(K);
        for count in 1..=degree + 1 {
            let mut row = [[V::splat(0.0); TOGETHER]; K];
            for term in terms.by_ref().take(count) {
                for k in 0..K {
                    let c = V::splat(term[k]);
                    for v in 0..TOGETHER {
                        row[k][v] = row[k][v].times_plus(p[v], c);
                    }
                }
            }
            for k in 0..K {
                for v in 0..TOGETHER {
                    sums[k][v] = sums[k][v].times_plus(q[v], row[k][v]);
                }
            }
        }
        for k in 0..K {
            for v in 0..TOGETHER {
                sums[k][v].store(&mut out[k][first + v * V::COUNT..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_plain_rule() {
        let degree = 5;
        let count = (degree + 1) * (degree + 2) / 2;
        let coefficients: Vec<f32> = (0..4 * count)
            .map(|k| ((7 * k) % 13) as f32 - 6.0)
            .collect();
        let p: [f32; 32] = std::array::from_fn(|i| (i as f32 - 15.5) / 16.0);
        let q: [f32; 32] = std::array::from_fn(|i| ((5 * i) % 32) as f32 / 32.0 - 0.5);
        let mut out = [[0.0; 32]; 4];
        polynomial::<[f32; 8], 32, 4>(&coefficients, degree, (&p, &q), &mut out);
        for i in 0..32 {
            for k in 0..4 {
                let mut place = 0;
                let mut sum = 0.0f64;
                // Rows from the highest power of q down, each from its highest power of p.
                for row in 0..=degree {
                    for term in 0..=row {
                        let c = f64::from(coefficients[4 * place + k]);
                        let power = |x: f32, n: usize| f64::from(x).powi(n as i32);
                        sum += c * power(q[i], degree - row) * power(p[i], row - term);
                        place += 1;
                    }
                }
                assert!((f64::from(out[k][i]) - sum).abs() < 1e-4);
            }
        }
    }
}
