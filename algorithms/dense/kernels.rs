//! The blur of a point out of focus in the left and the right view: a family of one parameter.
//!
//! The pupil's image is a disk of radius r. The left view takes the share ½(1 − p x/r), within 0 and 1, of its light,
//! and the right view the rest: mirror images, not copies. With p = 1 the shares fall linearly over the whole pupil to
//! nothing, and the centroids lie r/2 apart, a quarter of the blur's diameter; with p → ∞ the pupil is parted sharply,
//! 4/(3π); with p < 1, a pixel that hardly parts a narrow pupil, it is p/4. A measured phone has 0.244, a measured
//! full-frame camera at F/4 0.10. Split into an even and an odd part, k_R = A + B and k_L = A − B (times ½),
//!
//! ```text
//! L ⊗ k_R − R ⊗ k_L = (L − R) ⊗ A + (L + R) ⊗ B.
//! ```

/// Lobes of the Lanczos kernel by which the disk's points reach the pixels: it keeps their phase.
pub(super) const LOBES: f64 = 2.0;
/// κ of shares that fall linearly over the pupil.
pub(super) const LINEAR_RATIO: f64 = 0.25;
/// Least κ that is taken for one: a pixel that parts the pupil less shows shifts of hundredths of a px only, and the
/// blur that belongs to one px would be wider than a window.
pub(super) const LEAST_RATIO: f64 = 0.01;
/// κ of a pupil parted sharply, 4/(3π).
pub const SHARP_RATIO: f64 = 4.0 / (3.0 * std::f64::consts::PI);

/// Even and odd part of a pair of kernels, (2 R + 1)² numbers each, row-major.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    /// R, px.
    pub radius: usize,
    /// A.
    pub even: Vec<f32>,
    /// B.
    pub odd: Vec<f32>,
    /// Whether both are symmetric in y.
    pub is_symmetric: bool,
}

impl Kernels {
    /// R of a blur of this diameter, px.
    pub fn radius(blur_px: f64) -> usize {
        (0.5 * blur_px + LOBES).floor() as usize
    }

    /// The kernels of a blur of the diameter `blur_px`, positive in front of the focus as x_L − x_R is, for the
    /// steepness `p` of the shares.
    pub fn new(blur_px: f64, p: f64) -> Self {
        let disk = 0.5 * blur_px.abs();
        let radius = Self::radius(blur_px.abs());
        let side = 2 * radius + 1;
        let (mut even, mut odd) = (vec![0.0f64; side * side], vec![0.0f64; side * side]);
        let step = (disk / 8.0).min(0.25);
        let count = if step > 0.0 {
            (disk / step).ceil() as i64
        } else {
            0
        };
        let places: Vec<f64> = (-count..=count).map(|i| i as f64 * step).collect();
        let taps: Vec<Taps> = places.iter().map(|x| Taps::new(*x, radius)).collect();
        let (mut of_even, mut of_odd) = (vec![0.0f64; side], vec![0.0f64; side]);
        let mut sum = 0.0;
        for (y, down) in places.iter().zip(&taps) {
            of_even.fill(0.0);
            of_odd.fill(0.0);
            for (x, across) in places.iter().zip(&taps) {
                if x * x + y * y > disk * disk {
                    continue;
                }
                let along = if disk > 0.0 {
                    (p * x / disk).clamp(-1.0, 1.0)
                } else {
                    0.0
                };
                // A point nearer than the focus is imaged behind the sensor: its left view lies on the right.
                let odd_share = -along * blur_px.signum();
                sum += 1.0;
                for (i, weight) in across.weights().iter().enumerate() {
                    of_even[across.first + i] += weight;
                    of_odd[across.first + i] += weight * odd_share;
                }
            }
            for (j, weight) in down.weights().iter().enumerate() {
                let line = (down.first + j) * side;
                for i in 0..side {
                    even[line + i] += weight * of_even[i];
                    odd[line + i] += weight * of_odd[i];
                }
            }
        }
        let scaled = |v: Vec<f64>| v.into_iter().map(|v| (v / sum) as f32).collect();
        Self {
            radius,
            even: scaled(even),
            odd: scaled(odd),
            is_symmetric: true,
        }
    }

    /// Of k_L and k_R.
    pub fn of_views(radius: usize, [left, right]: [Vec<f64>; 2]) -> Self {
        let pairs = || left.iter().zip(&right);
        Self {
            radius,
            even: pairs().map(|(l, r)| (0.5 * (l + r)) as f32).collect(),
            odd: pairs().map(|(l, r)| (0.5 * (r - l)) as f32).collect(),
            is_symmetric: false,
        }
    }

    /// Where the pupil is parted `gain` times as much.
    pub fn parted(&self, gain: f64) -> Self {
        let odd = self.odd.iter().map(|v| (f64::from(*v) * gain) as f32);
        Self {
            odd: odd.collect(),
            ..self.clone()
        }
    }

    /// Σ(A² + B²): what white noise of variance 1 in L − R and L + R leaves.
    pub fn energy(&self) -> f64 {
        let squares = self
            .even
            .iter()
            .chain(&self.odd)
            .map(|&v| f64::from(v).powi(2));
        squares.sum()
    }
}

/// The pixels that a point reaches along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps {
    /// The first of them, counted from −R.
    pub first: usize,
    weights: [f64; 4],
    /// Those of `weights` that are within R.
    within: [usize; 2],
}

impl Taps {
    /// Of a point at `x` and an R: by the Lanczos kernel of two lobes, sinc t · sinc t/2.
    pub fn new(x: f64, radius: usize) -> Self {
        let below = x.floor();
        let part = x - below;
        // sin π t · sin π t/2 at t = −1 − f, −f, 1 − f, 2 − f is sin π f times −cos, sin, cos, −sin of π f/2.
        let (sin, cos) = (0.5 * std::f64::consts::PI * part).sin_cos();
        let product = 2.0 * sin * cos;
        let weight = |k: usize| {
            let t = std::f64::consts::PI * (k as f64 - 1.0 - part);
            match t.abs() < 1e-9 {
                true => 1.0,
                false => product * [-cos, sin, cos, -sin][k] * 2.0 / (t * t),
            }
        };
        // As a float has it: a point that is far away reaches nothing.
        let reach = radius as f64;
        let first = (-reach - (below - 1.0)).clamp(0.0, 4.0) as usize;
        let end = (reach - (below - 1.0) + 1.0).clamp(0.0, 4.0) as usize;
        Self {
            first: ((below - 1.0 + first as f64 + reach).max(0.0) as usize).min(2 * radius),
            weights: std::array::from_fn(weight),
            within: [first, end.max(first)],
        }
    }

    /// Of each, from the first on; none where the point is too far away.
    pub fn weights(&self) -> &[f64] {
        &self.weights[self.within[0]..self.within[1]]
    }
}

/// The steepness p whose ratio of the centroids' distance to the disk's diameter is `ratio`.
pub(super) fn steepness(ratio: f64) -> f64 {
    if ratio <= LINEAR_RATIO {
        return ratio / LINEAR_RATIO;
    }
    let (mut low, mut high) = (1.0f64, 1e3f64);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if ratio_of(middle) < ratio {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// κ of the steepness p: the mean of x·clamp(p x) over the unit disk, of which each view has half the light.
fn ratio_of(p: f64) -> f64 {
    const STEPS: usize = 2000;
    let terms = (0..STEPS).map(|i| {
        let x = (i as f64 + 0.5) / STEPS as f64;
        (
            x * (p * x).min(1.0) * (1.0 - x * x).sqrt(),
            (1.0 - x * x).sqrt(),
        )
    });
    let (moment, area) = terms.fold((0.0, 0.0), |(m, a), (tm, ta)| (m + tm, a + ta));
    moment / area
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centroids_lie_the_disparity_apart() {
        for (ratio, disparity) in [
            (0.25, 0.3),
            (0.25, -2.0),
            (0.35, 1.7),
            (0.42, 5.0),
            (0.1, 1.0),
        ] {
            let k = Kernels::new(disparity / ratio, steepness(ratio));
            let side = 2 * k.radius + 1;
            let x = |i: usize| (i % side) as f64 - k.radius as f64;
            let sum: f64 = k.even.iter().map(|&v| f64::from(v)).sum();
            let odd: f64 = k
                .odd
                .iter()
                .enumerate()
                .map(|(i, &v)| x(i) * f64::from(v))
                .sum();
            // k_L = A − B at the left centroid, k_R = A + B at the right one. The Lanczos kernel keeps the phase of the
            // frequencies that a view holds; the centroid of a blur narrower than itself it keeps less well.
            assert!(
                (-2.0 * odd / sum - disparity).abs() < 0.06 * disparity.abs(),
                "{ratio} {disparity} {odd}"
            );
        }
    }

    #[test]
    fn taps_are_those_of_the_lanczos_kernel_within_the_radius() {
        let sinc = |t: f64| if t == 0.0 { 1.0 } else { t.sin() / t };
        let pi = std::f64::consts::PI;
        for x in [0.0, 1e-12, 0.3, -0.3, 1.0, -2.6, 3.999, 5.2, -7.5, 300.0] {
            let taps = Taps::new(x, 4);
            let mut line = [0.0; 9];
            for (i, weight) in taps.weights().iter().enumerate() {
                line[taps.first + i] += weight;
            }
            for (i, found) in line.iter().enumerate() {
                let t = i as f64 - 4.0 - x;
                let wanted = sinc(pi * t) * sinc(0.5 * pi * t);
                let wanted = if t.abs() < LOBES { wanted } else { 0.0 };
                assert!((found - wanted).abs() < 1e-12, "{x} {i} {found} {wanted}");
            }
        }
    }

    #[test]
    fn linear_shares_give_a_quarter_and_sharp_ones_the_half_disk() {
        assert!((ratio_of(1.0) - LINEAR_RATIO).abs() < 1e-4);
        assert!((ratio_of(1e3) - SHARP_RATIO).abs() < 1e-3);
        assert!((ratio_of(steepness(0.33)) - 0.33).abs() < 1e-6);
    }
}
