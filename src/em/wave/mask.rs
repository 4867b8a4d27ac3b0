//! A thin sheet of a mosaic of filters.

use rustfft::num_complex::Complex64;

use super::spectral::Order;
use crate::em::mosaic::MICROLENSES;

type C = Complex64;

/// Fourier series of what a sheet of the mosaic lets pass, about the middle of the four microlenses.
pub(super) struct Mask {
    /// Largest difference of orders.
    reach: i64,
    /// `[i][j]`, both from −reach.
    series: Vec<C>,
}

impl Mask {
    pub fn new(passes: [C; MICROLENSES], reach: usize) -> Self {
        let reach = reach as i64;
        // One microlens along an axis: ½ sinc(i/2), half a pitch before (0) or behind (1) the middle.
        let one = |cell: usize, i: i64| {
            let x = 0.5 * std::f64::consts::PI * i as f64;
            let sinc = if i == 0 { 1.0 } else { x.sin() / x };
            C::from_polar(0.5 * sinc, if cell == 0 { x } else { -x })
        };
        let term = |i: i64, j: i64| -> C {
            let all = passes.iter().enumerate();
            all.map(|(k, t)| t * one(k % 2, i) * one(k / 2, j)).sum()
        };
        let side = -reach..=reach;
        let series = side.clone().flat_map(|i| side.clone().map(move |j| (i, j)));
        Self {
            reach,
            series: series.map(|(i, j)| term(i, j)).collect(),
        }
    }

    /// What of the light of some orders passes into each of `orders`.
    pub fn through(&self, lit: &[([i64; 2], C)], orders: &[Order]) -> Vec<C> {
        let side = 2 * self.reach + 1;
        let into = |o: &Order| {
            let term = |([a, b], psi): &([i64; 2], C)| {
                let (i, j) = (o.a - a + self.reach, o.b - b + self.reach);
                self.series[(i * side + j) as usize] * psi
            };
            lit.iter().map(term).sum()
        };
        orders.iter().map(into).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_passes_what_each_microlens_lets_through() {
        // Four thicknesses of grey: the series summed at the middles of the microlenses.
        let grey = [0.9, 0.6, 0.4, 0.1].map(C::from);
        let mask = Mask::new(grey, 60);
        for (k, wanted) in grey.iter().enumerate() {
            let [x, y] =
                [k % 2, k / 2].map(|c| 0.5 * std::f64::consts::PI * (2.0 * c as f64 - 1.0));
            let mut sum = C::ZERO;
            for i in -60..=60i64 {
                for j in -60..=60i64 {
                    let at = ((i + 60) * 121 + j + 60) as usize;
                    sum += mask.series[at] * C::cis(i as f64 * x + j as f64 * y);
                }
            }
            assert!((sum - wanted).norm() < 0.02, "{k}: {sum}");
        }
    }
}
