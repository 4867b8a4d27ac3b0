//! GMRES for complex systems given as functions (Saad & Schultz, SIAM J. Sci. Stat. Comput. 7, 856 (1986)),
//! preconditioned from the right, so that the residual it stops at is the true one.

use rustfft::FftNum;
use rustfft::num_complex::{Complex, Complex64};
use rustfft::num_traits::Float;

/// A linear system and a rough inverse of it.
pub(super) trait System<T> {
    /// y = A x.
    fn apply(&mut self, x: &[Complex<T>], y: &mut [Complex<T>]);
    /// y ≈ A⁻¹ x; linear in x.
    fn precondition(&mut self, x: &[Complex<T>], y: &mut [Complex<T>]);
}

/// Solves A x = b from the start value in `x`; stops at |b − A x| ≤ tolerance |b| or after `most` steps. Returns the
/// relative residual reached. Vectors are of type T, norms and products are summed in f64.
pub(super) fn gmres<T: Float + FftNum>(
    system: &mut impl System<T>,
    b: &[Complex<T>],
    x: &mut [Complex<T>],
    tolerance: f64,
    most: usize,
) -> f64 {
    let zeros = || vec![Complex::new(T::zero(), T::zero()); b.len()];
    let scale = norm(b);
    if scale == 0.0 {
        x.copy_from_slice(&zeros());
        return 0.0;
    }
    let mut r = zeros();
    system.apply(x, &mut r);
    for (r, b) in r.iter_mut().zip(b) {
        *r = *b - *r;
    }
    let mut rest = norm(&r);
    if rest <= tolerance * scale {
        return rest / scale;
    }
    divide(&mut r, rest);
    let mut rough = zeros();
    let mut basis = vec![r];
    let mut hessenberg = Rotated::new(rest);
    for j in 0..most {
        let mut w = zeros();
        system.precondition(&basis[j], &mut rough);
        system.apply(&rough, &mut w);
        let mut h = Vec::with_capacity(j + 2);
        for v in &basis {
            let d = dot(v, &w);
            add(&mut w, -d, v);
            h.push(d);
        }
        let below = norm(&w);
        let Some(reached) = hessenberg.add(h, below) else {
            break;
        };
        rest = reached;
        if rest <= tolerance * scale || below == 0.0 {
            break;
        }
        divide(&mut w, below);
        basis.push(w);
    }
    let mut sum = zeros();
    for (v, y) in basis.iter().zip(hessenberg.solution()) {
        add(&mut sum, y, v);
    }
    system.precondition(&sum, &mut rough);
    for (x, r) in x.iter_mut().zip(&rough) {
        *x = *x + *r;
    }
    rest / scale
}

/// The Hessenberg matrix of the basis, made triangular by rotations as it grows.
struct Rotated {
    /// Columns of the triangle R.
    triangle: Vec<Vec<Complex64>>,
    /// The rotations that made it.
    rotations: Vec<(f64, Complex64)>,
    /// The rotated right-hand side.
    right: Vec<Complex64>,
}

impl Rotated {
    fn new(residual: f64) -> Self {
        Self {
            triangle: Vec::new(),
            rotations: Vec::new(),
            right: vec![Complex64::new(residual, 0.0)],
        }
    }

    /// Adds a column `h` with `below` under it; the norm of the residual, `None` of a column of zeros.
    fn add(&mut self, mut h: Vec<Complex64>, below: f64) -> Option<f64> {
        let j = self.rotations.len();
        h.push(Complex64::new(below, 0.0));
        for (i, &(c, s)) in self.rotations.iter().enumerate() {
            let (a, b) = (h[i], h[i + 1]);
            h[i] = a * c + s * b;
            h[i + 1] = b * c - s.conj() * a;
        }
        let top = h[j];
        let length = top.norm().hypot(below);
        if length == 0.0 {
            return None;
        }
        let phase = if top.norm() > 0.0 {
            top / top.norm()
        } else {
            Complex64::ONE
        };
        let (c, s) = (top.norm() / length, phase * (below / length));
        h[j] = phase * length;
        self.rotations.push((c, s));
        let old = self.right[j];
        self.right[j] = old * c;
        self.right.push(-s.conj() * old);
        self.triangle.push(h);
        Some(self.right[j + 1].norm())
    }

    /// The solution in the basis, by substitution from the last.
    fn solution(&self) -> Vec<Complex64> {
        let steps = self.triangle.len();
        let mut y = self.right[..steps].to_vec();
        for i in (0..steps).rev() {
            for k in i + 1..steps {
                let t = self.triangle[k][i] * y[k];
                y[i] -= t;
            }
            y[i] /= self.triangle[i][i];
        }
        y
    }
}

fn wide<T: Float>(z: Complex<T>) -> Complex64 {
    // f32 and f64 both convert; NaN stands for what cannot be, and spoils the residual visibly.
    let part = |x: T| x.to_f64().unwrap_or(f64::NAN);
    Complex64::new(part(z.re), part(z.im))
}

fn narrow<T: Float>(x: f64) -> T {
    T::from(x).unwrap_or_else(T::nan)
}

fn norm<T: Float>(v: &[Complex<T>]) -> f64 {
    dot(v, v).re.max(0.0).sqrt()
}

/// aᴴ b. In T over short runs, eight lanes wide, and in f64 over the runs: as accurate as T's data, and vectorised.
fn dot<T: Float>(a: &[Complex<T>], b: &[Complex<T>]) -> Complex64 {
    const LANES: usize = 8;
    const RUN: usize = 16 * LANES;
    let mut sum = Complex64::ZERO;
    for (a, b) in a.chunks(RUN).zip(b.chunks(RUN)) {
        let (a, a_rest) = a.as_chunks::<LANES>();
        let (b, b_rest) = b.as_chunks::<LANES>();
        let mut re = [T::zero(); LANES];
        let mut im = [T::zero(); LANES];
        for (a, b) in a.iter().zip(b) {
            for k in 0..LANES {
                re[k] = re[k] + (a[k].re * b[k].re + a[k].im * b[k].im);
                im[k] = im[k] + (a[k].re * b[k].im - a[k].im * b[k].re);
            }
        }
        for k in 0..LANES {
            sum += wide(Complex::new(re[k], im[k]));
        }
        for (&a, &b) in a_rest.iter().zip(b_rest) {
            sum += wide(a).conj() * wide(b);
        }
    }
    sum
}

/// a += f b.
fn add<T: Float>(a: &mut [Complex<T>], f: Complex64, b: &[Complex<T>]) {
    let (re, im) = (narrow::<T>(f.re), narrow::<T>(f.im));
    for (a, b) in a.iter_mut().zip(b) {
        a.re = a.re + (re * b.re - im * b.im);
        a.im = a.im + (re * b.im + im * b.re);
    }
}

fn divide<T: Float>(v: &mut [Complex<T>], by: f64) {
    let f = narrow::<T>(1.0 / by);
    for z in v {
        z.re = z.re * f;
        z.im = z.im * f;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type C = Complex64;

    struct Dense {
        a: Vec<C>,
        n: usize,
    }

    impl System<f64> for Dense {
        fn apply(&mut self, x: &[C], y: &mut [C]) {
            for (row, y) in self.a.chunks(self.n).zip(y) {
                *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
            }
        }
        fn precondition(&mut self, x: &[C], y: &mut [C]) {
            for (i, (x, y)) in x.iter().zip(y).enumerate() {
                *y = x / self.a[i * (self.n + 1)];
            }
        }
    }

    #[test]
    fn solves_a_small_complex_system() {
        let n = 12;
        let a: Vec<C> = (0..n * n)
            .map(|i| {
                let (r, c) = (i / n, i % n);
                let off = C::new((i as f64 * 1.3).sin(), (i as f64 * 0.7).cos()) * 0.2;
                if r == c { C::new(2.0, 0.5) + off } else { off }
            })
            .collect();
        let mut system = Dense { a, n };
        let b: Vec<C> = (0..n).map(|i| C::new(i as f64, 1.0)).collect();
        let mut x = vec![C::ZERO; n];
        assert!(gmres(&mut system, &b, &mut x, 1e-12, 20) < 1e-12);
        let mut back = vec![C::ZERO; n];
        system.apply(&x, &mut back);
        assert!(back.iter().zip(&b).all(|(p, q)| (p - q).norm() < 1e-9));
    }
}
