//! What every sub-pixel collects of a field that falls through planes of silicon:
//! `S_ab = Σ_planes Re tr(Eᴴ X_a E Y_bᵀ)`, with E the field's modes along x and y, X_a and Y_b their overlaps over the
//! sub-pixel's columns and rows (Hermitian).
//!
//! Most of a table's time goes here: `m k_x² k_y + n k_x k_y²` complex products per plane. Real and imaginary parts lie
//! apart, rows padded to whole vectors: half as fast again as pairs (benches/runs/2026-11-26/absorption.md).

use rustfft::num_complex::Complex64;

use crate::simd::SimdLevel;

type C = Complex64;

/// Rows are padded to multiples of this.
const LANES: usize = 4;

/// A field at the first plane, modes [i][j] along x and y, and what a step to the next one multiplies each by.
pub(super) struct Falling {
    /// Modes along x and y.
    pub size: [usize; 2],
    pub upper: Vec<C>,
    pub step: Vec<C>,
    pub planes: usize,
}

/// A matrix of padded rows, real and imaginary parts apart.
struct Parts {
    width: usize,
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Parts {
    fn zeros(rows: usize, width: usize) -> Self {
        let zeros = || vec![0.0; rows * width];
        Self {
            width,
            re: zeros(),
            im: zeros(),
        }
    }

    fn new(matrix: &[C], columns: usize) -> Self {
        let width = columns.next_multiple_of(LANES);
        let mut parts = Self::zeros(matrix.len() / columns.max(1), width);
        for (k, value) in matrix.iter().enumerate() {
            let at = k / columns * width + k % columns;
            (parts.re[at], parts.im[at]) = (value.re, value.im);
        }
        parts
    }

    fn row(&self, row: usize) -> (&[f64], &[f64]) {
        let at = row * self.width..(row + 1) * self.width;
        (&self.re[at.clone()], &self.im[at])
    }

    fn row_mut(&mut self, row: usize) -> (&mut [f64], &mut [f64]) {
        let at = row * self.width..(row + 1) * self.width;
        (&mut self.re[at.clone()], &mut self.im[at])
    }
}

impl Falling {
    /// S, [b][a]: rows of sub-pixels along y.
    pub fn sums(&self, x: &[Vec<C>], y: &[Vec<C>]) -> Vec<f64> {
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx512 | SimdLevel::Avx2 => unsafe { sums_avx2(self, x, y) },
            _ => sums(self, x, y),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sums_avx2(field: &Falling, x: &[Vec<C>], y: &[Vec<C>]) -> Vec<f64> {
    sums(field, x, y)
}

/// Products and sums are never fused, and every sum has one order: the same bytes whatever the instructions.
#[inline(always)]
fn sums(falling: &Falling, x: &[Vec<C>], y: &[Vec<C>]) -> Vec<f64> {
    let [kx, ky] = falling.size;
    let mut field = Parts::new(&falling.upper, ky);
    let step = Parts::new(&falling.step, ky);
    let of_x: Vec<Parts> = x.iter().map(|overlap| Parts::new(overlap, kx)).collect();
    // Y is Hermitian, so Yᵀ is its conjugate.
    let transposed = |overlap: &Vec<C>| -> Vec<C> { overlap.iter().map(C::conj).collect() };
    let of_y: Vec<Parts> = (y.iter())
        .map(|overlap| Parts::new(&transposed(overlap), ky))
        .collect();
    let mut left: Vec<Parts> = x.iter().map(|_| Parts::zeros(kx, field.width)).collect();
    let mut right = Parts::zeros(kx, field.width);
    let mut sums = vec![0.0; x.len() * y.len()];
    for _ in 0..falling.planes {
        for (left, overlap) in left.iter_mut().zip(&of_x) {
            for i in 0..kx {
                let (re, im) = left.row_mut(i);
                re.fill(0.0);
                im.fill(0.0);
                let (or, oi) = overlap.row(i);
                for k in 0..kx {
                    add_product(re, im, (or[k], oi[k]), field.row(k));
                }
            }
        }
        for (b, overlap) in of_y.iter().enumerate() {
            for i in 0..kx {
                let (re, im) = right.row_mut(i);
                re.fill(0.0);
                im.fill(0.0);
                let (fr, fi) = field.row(i);
                for l in 0..ky {
                    add_product(re, im, (fr[l], fi[l]), overlap.row(l));
                }
            }
            for (a, left) in left.iter().enumerate() {
                sums[b * x.len() + a] += dot(&left.re, &right.re) + dot(&left.im, &right.im);
            }
        }
        let of_step = step.re.iter().zip(&step.im);
        for ((re, im), (sr, si)) in field.re.iter_mut().zip(&mut field.im).zip(of_step) {
            (*re, *im) = (*re * sr - *im * si, *re * si + *im * sr);
        }
    }
    sums
}

/// `to += factor · row`.
#[inline(always)]
fn add_product(re: &mut [f64], im: &mut [f64], (a, b): (f64, f64), (c, d): (&[f64], &[f64])) {
    for (((re, im), c), d) in re.iter_mut().zip(im).zip(c).zip(d) {
        *re += a * c - b * d;
        *im += a * d + b * c;
    }
}

/// In as many running sums as a vector has places.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σ_planes Σ_ijkl Re(E*_ij X_ik E_kl Y*_lj), as it is written.
    #[test]
    fn sums_are_those_of_the_definition() {
        let [kx, ky] = [5, 3];
        let mut state = 7u64;
        let mut next = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / 2f64.powi(30) - 1.0
        };
        let mut complex =
            |count: usize| -> Vec<C> { (0..count).map(|_| C::new(next(), next())).collect() };
        let mut hermitian = |n: usize| -> Vec<C> {
            let any = complex(n * n);
            (0..n * n)
                .map(|k| any[k] + any[k % n * n + k / n].conj())
                .collect()
        };
        let x = vec![hermitian(kx), hermitian(kx)];
        let y = vec![hermitian(ky), hermitian(ky)];
        let (upper, step) = (complex(kx * ky), complex(kx * ky));
        let mut wanted = [0.0; 4];
        let mut e = upper.clone();
        for _ in 0..3 {
            for (b, y) in y.iter().enumerate() {
                for (a, x) in x.iter().enumerate() {
                    for (i, j, k, l) in (0..kx * ky * kx * ky)
                        .map(|q| (q % kx, q / kx % ky, q / kx / ky % kx, q / kx / ky / kx))
                    {
                        let term = e[i * ky + j].conj()
                            * x[i * kx + k]
                            * e[k * ky + l]
                            * y[l * ky + j].conj();
                        wanted[b * 2 + a] += term.re;
                    }
                }
            }
            for (e, s) in e.iter_mut().zip(&step) {
                *e *= s;
            }
        }
        let falling = Falling {
            size: [kx, ky],
            upper,
            step,
            planes: 3,
        };
        let (fast, plain) = (falling.sums(&x, &y), sums(&falling, &x, &y));
        for k in 0..4 {
            assert!(
                (fast[k] - wanted[k]).abs() < 1e-11 * wanted[k].abs().max(1.0),
                "{k}"
            );
            assert_eq!(fast[k].to_bits(), plain[k].to_bits(), "{k}");
        }
    }
}
