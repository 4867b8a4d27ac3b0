//! A picture smoothed by a Gaussian, and its derivatives up to the fifth at chosen pixels.
//!
//! Central differences over seven pixels (Fornberg, Math. Comput. 51, 699 (1988)): of sixth order for the first and
//! second derivative, fourth for the third and fourth, second for the fifth, so the picture must be smooth (see
//! [`SMALLEST_SIGMA_PX`]).

/// Highest derivative.
pub(super) const ORDER: usize = 5;
/// Derivatives of the orders 0 to [`ORDER`] in two dimensions.
pub(super) const DERIVATIVES: usize = (ORDER + 1) * (ORDER + 2) / 2;
/// Pixels on each side of the middle that a derivative takes.
pub(super) const REACH_PX: usize = 3;
/// Below this the differences are no derivatives: at the frequency 1/σ the first is short by (1/σ)⁶/140, 0.06 % here.
pub(super) const SMALLEST_SIGMA_PX: f64 = 1.5;

/// Weights of the seven pixels, and what they are divided by.
const STENCILS: [([f64; 7], f64); ORDER + 1] = [
    ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 1.0),
    ([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0], 60.0),
    ([2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0], 180.0),
    ([1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0], 8.0),
    ([-1.0, 12.0, -39.0, 56.0, -39.0, 12.0, -1.0], 6.0),
    ([-1.0, 4.0, -5.0, 0.0, 5.0, -4.0, 1.0], 2.0),
];

/// Gaussian weights of the sum 1 from −⌈3σ⌉ to ⌈3σ⌉. Cut off or not does not matter: it is the same filter for all
/// pictures.
#[derive(Clone, Debug)]
pub(super) struct Gaussian {
    weights: Vec<f64>,
}

impl Gaussian {
    pub fn new(sigma_px: f64) -> Self {
        let radius = (3.0 * sigma_px).ceil() as i64;
        let at = |i: i64| (-0.5 * (i as f64 / sigma_px).powi(2)).exp();
        let weights: Vec<f64> = (-radius..=radius).map(at).collect();
        let sum: f64 = weights.iter().sum();
        Self {
            weights: weights.into_iter().map(|w| w / sum).collect(),
        }
    }

    /// Pixels on each side that it takes.
    pub fn radius_px(&self) -> usize {
        self.weights.len() / 2
    }
}

/// A smoothed single-channel picture; within the Gaussian's radius of the border the picture's edge is repeated.
pub(super) struct Smoothed {
    width: usize,
    values: Vec<f64>,
}

impl Smoothed {
    /// Smooths `input`, row-major in rows of `width`.
    pub fn new(input: Vec<f64>, width: usize, gaussian: &Gaussian) -> Self {
        let height = input.len() / width.max(1);
        let radius = gaussian.radius_px();
        let pass = |from: &[f64], step: usize, count: usize, at: usize, start: usize| -> f64 {
            let weights = gaussian.weights.iter().enumerate();
            weights
                .map(|(k, w)| {
                    let i = (at + k).saturating_sub(radius).min(count - 1);
                    w * from[start + i * step]
                })
                .sum()
        };
        let rows: Vec<f64> = (0..width * height)
            .map(|i| pass(&input, 1, width, i % width, i / width * width))
            .collect();
        let values = (0..width * height)
            .map(|i| pass(&rows, width, height, i / width, i % width))
            .collect();
        Self { width, values }
    }

    /// The value between pixels, by Taylor's series about the nearest one, which is at least [`REACH_PX`] from the
    /// border.
    pub fn between(&self, [x, y]: [f64; 2]) -> f64 {
        let (column, row) = (x.round(), y.round());
        let (dx, dy) = (x - column, y - row);
        let derivatives = self.derivatives([column as usize, row as usize]);
        let factorial = |n: usize| (1..=n).product::<usize>() as f64;
        let orders = (0..=ORDER).flat_map(|k| (0..=k).map(move |j| (k - j, j)));
        (derivatives.iter().zip(orders))
            .map(|(d, (i, j))| {
                d * dx.powi(i as i32) * dy.powi(j as i32) / (factorial(i) * factorial(j))
            })
            .sum()
    }

    /// ∂ₓⁱ∂ᵧʲ, in the order of `i + j`, in each with falling i; at least [`REACH_PX`] from the border.
    pub fn derivatives(&self, [x, y]: [usize; 2]) -> [f64; DERIVATIVES] {
        let side = 2 * REACH_PX + 1;
        let corner = (y - REACH_PX) * self.width + x - REACH_PX;
        let mut rows = [[0.0; 7]; ORDER + 1];
        let difference = |values: &[f64], order: usize| -> f64 {
            let (weights, divisor) = &STENCILS[order];
            let sum: f64 = values.iter().zip(weights).map(|(v, w)| v * w).sum();
            sum / divisor
        };
        for (order, sums) in rows.iter_mut().enumerate() {
            for (r, sum) in sums.iter_mut().enumerate() {
                let row = &self.values[corner + r * self.width..][..side];
                *sum = difference(row, order);
            }
        }
        let mut out = [0.0; DERIVATIVES];
        let orders = (0..=ORDER).flat_map(|k| (0..=k).map(move |j| (k - j, j)));
        for (value, (i, j)) in out.iter_mut().zip(orders) {
            *value = difference(&rows[i], j);
        }
        out
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn differences_are_exact_on_polynomials_of_the_fifth_degree() {
        // x³y² + 2x⁵ − y⁴ about the pixel (10, 12), whose derivatives there are known.
        let value = |x: f64, y: f64| x.powi(3) * y.powi(2) + 2.0 * x.powi(5) - y.powi(4);
        let values = (0..20 * 20)
            .map(|i| value((i % 20) as f64 - 9.0, (i / 20) as f64 - 11.0))
            .collect();
        let smoothed = Smoothed { width: 20, values };
        let (x, y) = (1.0, 1.0);
        let found = smoothed.derivatives([10, 12]);
        let wanted = [
            value(x, y),
            3.0 + 10.0,
            2.0 - 4.0,
            6.0 + 40.0,
            6.0,
            2.0 - 12.0,
            6.0 + 120.0,
            12.0,
            6.0,
            -24.0,
            240.0,
            12.0,
            12.0,
            0.0,
            -24.0,
            240.0,
            0.0,
            12.0,
            0.0,
            0.0,
            0.0,
        ];
        for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
            assert!((found - wanted).abs() < 1e-8, "{k}: {found}, {wanted}");
        }
    }

    #[test]
    fn smoothing_keeps_the_mean_and_damps_a_wave_as_a_gaussian_does() {
        let sigma = 2.0;
        let omega = 0.5f64;
        let values = (0..64 * 64)
            .map(|i| (omega * f64::from(i % 64)).cos())
            .collect();
        let smoothed = Smoothed::new(values, 64, &Gaussian::new(sigma));
        let wanted = (-0.5 * (omega * sigma).powi(2)).exp() * (omega * 32.0).cos();
        // Cut at 3σ: 0.3 % of the weight is missing and was spread over the rest.
        assert!((smoothed.between([32.0, 32.0]) - wanted).abs() < 5e-3);
        // Between pixels the smoothed wave goes on as a wave.
        let factor = smoothed.between([32.0, 32.0]) / (omega * 32.0).cos();
        let between = factor * (omega * 31.6).cos();
        assert!((smoothed.between([31.6, 20.3]) - between).abs() < 1e-5);
    }
}
