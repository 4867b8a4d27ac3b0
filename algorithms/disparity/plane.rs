//! One channel of a picture, brought to zero mean and unit deviation so that sums keep their digits at any scale.

use quadpixel::image::Image;

use crate::plane_error::PlaneError;

/// Samples behind the last one.
pub(super) const PADDING: usize = 40;

/// A finite, single-channel image, row-major: (v − mean)/deviation, all zero where the picture is constant.
pub(super) struct Plane {
    pub width: usize,
    pub height: usize,
    /// Followed by [`PADDING`] zeros, so that a whole vector can be read from every pixel on.
    pub data: Vec<f32>,
    /// Contrast (deviation) below which a window shows nothing but the rounding of the f32 input.
    pub rounding: f32,
}

impl Plane {
    /// Takes a single-channel picture over; NaN and infinity are refused.
    pub fn new(image: &Image) -> Result<Self, PlaneError> {
        PlaneError::check(image)?;
        let values = image.data();
        let n = values.len().max(1) as f64;
        let mean = sum(values, |v| v) / n;
        let deviation = (sum(values, |v| (v - mean) * (v - mean)) / n).sqrt();
        let largest = values.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        let scale = if deviation > 0.0 {
            1.0 / deviation
        } else {
            0.0
        };
        let mut data = Vec::with_capacity(values.len() + PADDING);
        data.extend(
            values
                .iter()
                .map(|&v| ((f64::from(v) - mean) * scale) as f32),
        );
        data.resize(values.len() + PADDING, 0.0);
        Ok(Self {
            width: image.width(),
            height: image.height(),
            data,
            // Half a unit in the last place is at most ε/2 · v; a few of them are no texture.
            rounding: (4.0 * f64::from(f32::EPSILON) * f64::from(largest) * scale)
                .max(4.0 * f64::from(f32::EPSILON)) as f32,
        })
    }

    pub fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// The picture at half the resolution: binomial 1-4-6-4-1 on both axes, every other sample kept; coarse pixel i
    /// lies on fine pixel 2 i. Edges are replicated.
    pub fn halved(&self) -> Self {
        const TAPS: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let near = |i: usize, k: usize, n: usize| (2 * i + k).saturating_sub(2).min(n - 1);
        let mut narrow = vec![0.0f32; width * self.height];
        for y in 0..self.height {
            let row = self.row(y);
            for x in 0..width {
                narrow[y * width + x] = (0..5).map(|k| TAPS[k] * row[near(x, k, self.width)]).sum();
            }
        }
        let mut data = vec![0.0f32; width * height + PADDING];
        for y in 0..height {
            for x in 0..width {
                data[y * width + x] = (0..5)
                    .map(|k| TAPS[k] * narrow[near(y, k, self.height) * width + x])
                    .sum();
            }
        }
        Self {
            width,
            height,
            data,
            rounding: self.rounding,
        }
    }
}

/// Sum of `f` over all values in f64, as four sums that the CPU can run side by side.
fn sum(values: &[f32], f: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0f64; 4];
    for four in values.chunks(4) {
        for (sum, &v) in sums.iter_mut().zip(four) {
            *sum += f(f64::from(v));
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Mean and inverse norm 1/√Σ(v − mean)² of the window about every pixel, from running sums: the cost does not depend
/// on the window. Where the window is not complete the mean is 0 and the norm NaN; the norm is 0 where the window shows
/// only rounding.
pub(super) struct WindowStatistics {
    pub mean: Vec<f32>,
    pub inverse_norm: Vec<f32>,
}

impl WindowStatistics {
    /// Of all windows of `2 half + 1` pixels per side.
    pub fn new(plane: &Plane, half: usize) -> Self {
        let (width, height, window) = (plane.width, plane.height, 2 * half + 1);
        let mut mean = vec![0.0f32; width * height];
        let mut inverse_norm = vec![f32::NAN; width * height];
        if width < window || height < window {
            return Self { mean, inverse_norm };
        }
        let n = (window * window) as f64;
        let least = n * f64::from(plane.rounding) * f64::from(plane.rounding);
        let (mut sums, mut squares) = (vec![0.0f64; width], vec![0.0f64; width]);
        // Of the columns to the left.
        let mut prefix = [vec![0.0f64; width + 1], vec![0.0f64; width + 1]];
        for bottom in 0..height {
            let row = plane.row(bottom);
            if let Some(top) = bottom.checked_sub(window) {
                for (((sum, square), &new), &old) in (sums.iter_mut().zip(&mut squares))
                    .zip(row)
                    .zip(plane.row(top))
                {
                    let (new, old) = (f64::from(new), f64::from(old));
                    *sum += new - old;
                    *square += new * new - old * old;
                }
            } else {
                for ((sum, square), &v) in sums.iter_mut().zip(&mut squares).zip(row) {
                    *sum += f64::from(v);
                    *square += f64::from(v) * f64::from(v);
                }
            }
            if bottom + 1 < window {
                continue;
            }
            let [of_sums, of_squares] = &mut prefix;
            let (mut sum, mut square) = (0.0f64, 0.0f64);
            for (((to_sum, to_square), more), more_square) in (of_sums[1..].iter_mut())
                .zip(&mut of_squares[1..])
                .zip(&sums)
                .zip(&squares)
            {
                sum += more;
                square += more_square;
                (*to_sum, *to_square) = (sum, square);
            }
            let to = (bottom - half) * width + half;
            let count = width + 1 - window;
            let windows = (of_sums[window..].iter().zip(&of_sums[..count]))
                .zip(of_squares[window..].iter().zip(&of_squares[..count]));
            for ((mean, norm), ((right, left), (right_square, left_square))) in
                (mean[to..to + count].iter_mut())
                    .zip(&mut inverse_norm[to..to + count])
                    .zip(windows)
            {
                let sum = right - left;
                let energy = (right_square - left_square) - sum * (sum / n);
                *mean = (sum / n) as f32;
                *norm = if energy > least {
                    1.0 / (energy as f32).sqrt()
                } else {
                    0.0
                };
            }
        }
        Self { mean, inverse_norm }
    }
}
