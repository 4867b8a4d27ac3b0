//! Products of a field, known by its plane-wave orders, with a function of (x, y), by FFT.

use std::sync::Arc;

use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftDirection, FftPlannerScalar};

type S = Complex32;

/// One plane-wave order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    /// Indices along x and y: k = k_Bloch + 2π (a, b) / pitch.
    pub a: i64,
    pub b: i64,
    /// |k⊥|² in 1/µm².
    pub k_perp_squared: f64,
}

/// The plane-wave orders of a period whose transverse wavenumber is `most` or less.
pub(super) fn orders_within(most: f64, k0: f64, period_um: f64, bloch: [f64; 2]) -> Vec<Order> {
    let g = 2.0 * std::f64::consts::PI / period_um;
    let reach = (most / g).ceil() as i64 + 1 + (k0 / g).ceil() as i64;
    let mut orders = Vec::new();
    for a in -reach..=reach {
        for b in -reach..=reach {
            let (kx, ky) = (bloch[0] + g * a as f64, bloch[1] + g * b as f64);
            let k_perp_squared = kx * kx + ky * ky;
            if k_perp_squared <= most * most {
                orders.push(Order {
                    a,
                    b,
                    k_perp_squared,
                });
            }
        }
    }
    orders
}

/// FFTs of one length. The scalar planner: the vector ones use fused multiplies where the CPU has them, and a table
/// would depend on the CPU.
pub(super) struct Transforms {
    /// Points a side.
    pub grid: usize,
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
}

impl Transforms {
    pub fn new(grid: usize) -> Self {
        let mut planner = FftPlannerScalar::new();
        Self {
            grid,
            forward: planner.plan_fft(grid, FftDirection::Forward),
            inverse: planner.plan_fft(grid, FftDirection::Inverse),
        }
    }
}

/// The product for one set of orders, with its scratch.
pub(super) struct Product<'a> {
    fft: &'a Transforms,
    /// Place of each order on the grid: (row of a, column of b).
    places: Vec<(usize, usize)>,
    /// Rows of a that hold orders.
    rows: Vec<usize>,
    by_row: Vec<S>,
    by_column: Vec<S>,
    scratch: Vec<S>,
}

impl<'a> Product<'a> {
    pub fn new(fft: &'a Transforms, orders: &[Order]) -> Self {
        let grid = fft.grid;
        let place = |i: i64| i.rem_euclid(grid as i64) as usize;
        let places: Vec<_> = orders.iter().map(|o| (place(o.a), place(o.b))).collect();
        let mut rows: Vec<usize> = places.iter().map(|p| p.0).collect();
        rows.sort_unstable();
        rows.dedup();
        let scratch = fft
            .forward
            .get_inplace_scratch_len()
            .max(fft.inverse.get_inplace_scratch_len());
        Self {
            fft,
            places,
            rows,
            by_row: vec![S::ZERO; grid * grid],
            by_column: vec![S::ZERO; grid * grid],
            scratch: vec![S::ZERO; scratch],
        }
    }

    /// Orders of V ψ from the orders of ψ; V is `[y][x]`.
    pub fn multiply(&mut self, potential: &[S], psi: &[S], out: &mut [S]) {
        let g = self.fft.grid;
        for &row in &self.rows {
            self.by_row[row * g..(row + 1) * g].fill(S::ZERO);
        }
        for (&(a, b), &p) in self.places.iter().zip(psi) {
            self.by_row[a * g + b] = p;
        }
        // Rows of a without orders stay zero in the other direction, too.
        self.by_column.fill(S::ZERO);
        for &a in &self.rows {
            let row = &mut self.by_row[a * g..(a + 1) * g];
            self.fft
                .inverse
                .process_with_scratch(row, &mut self.scratch);
            for (y, &v) in row.iter().enumerate() {
                self.by_column[y * g + a] = v;
            }
        }
        self.fft
            .inverse
            .process_with_scratch(&mut self.by_column, &mut self.scratch);
        for (f, v) in self.by_column.iter_mut().zip(potential) {
            *f *= v;
        }
        self.fft
            .forward
            .process_with_scratch(&mut self.by_column, &mut self.scratch);
        for &a in &self.rows {
            let row = &mut self.by_row[a * g..(a + 1) * g];
            for (y, v) in row.iter_mut().enumerate() {
                *v = self.by_column[y * g + a];
            }
            self.fft
                .forward
                .process_with_scratch(row, &mut self.scratch);
        }
        let scale = 1.0 / (g * g) as f32;
        for (&(a, b), o) in self.places.iter().zip(out) {
            *o = self.by_row[a * g + b] * scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_is_the_convolution_of_orders() {
        // V = 1 + 2 cos(2πx/p) + i e^(−2πi y/p): each order is copied to itself, its two neighbours in x and one in y.
        let fft = Transforms::new(12);
        let potential: Vec<S> = (0..144)
            .map(|i| {
                let at = |n: usize| 2.0 * std::f32::consts::PI * n as f32 / 12.0;
                let (y, x) = (at(i / 12), at(i % 12));
                S::new(1.0 + 2.0 * x.cos(), 0.0) + S::I * S::from_polar(1.0, -y)
            })
            .collect();
        let orders: Vec<Order> = (-2..=2)
            .flat_map(|a| {
                (-2..=2).map(move |b| Order {
                    a,
                    b,
                    k_perp_squared: 0.0,
                })
            })
            .collect();
        let psi: Vec<S> = (0..25).map(|i| S::new(i as f32, 1.0)).collect();
        let mut out = vec![S::ZERO; 25];
        Product::new(&fft, &orders).multiply(&potential, &psi, &mut out);
        let at = |a: i64, b: i64| {
            if a.abs() > 2 || b.abs() > 2 {
                S::ZERO
            } else {
                psi[((a + 2) * 5 + b + 2) as usize]
            }
        };
        for (o, got) in orders.iter().zip(&out) {
            let wanted =
                at(o.a, o.b) + at(o.a - 1, o.b) + at(o.a + 1, o.b) + S::I * at(o.a, o.b + 1);
            assert!((got - wanted).norm() < 1e-4);
        }
    }
}
