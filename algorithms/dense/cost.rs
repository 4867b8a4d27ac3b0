//! What each disparity costs at each pixel: how much the views, each blurred by the other's kernel, still differ.
//!
//! ```text
//! cost_d(x) = Gaussian window of (L ⊗ k_R,d − R ⊗ k_L,d)² / (noise_d + ε energy_d)
//! ```
//!
//! The right d leaves noise. energy_d is the mean of the blurred views over the picture, so that a wide blur, which
//! leaves little of any texture, is no cheaper than a narrow one; a window counts by its texture. ε is the part of the
//! energy that differs in spite of the right d (other depths in the window, a pupil that is not quite as told).
//! Each pixel has the kernels of its own κ; energy_d is that of the middle one.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::filters::{by_rows, enlarged, gaussian, mirrored, row_of};
use super::kernels::Kernels;
use super::lines;
use super::prepare::{Level, Pyramid};
use super::pupils::Pupils;

/// Deviation of the window, px of the level.
const WINDOW_PX: f64 = 1.0;
/// Every so many rows enter the mean energy.
const ENERGY_STRIDE: usize = 8;

/// Candidates first, first + step, …, px of full resolution where κ is the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidates {
    pub first_px: f64,
    pub step_px: f64,
    pub count: usize,
}

impl Candidates {
    /// From `range_px[0]` to `range_px[1]`, at least three.
    pub fn new(range_px: [f64; 2], step_px: f64) -> Self {
        let count = ((range_px[1] - range_px[0]) / step_px).ceil() as usize + 1;
        Self {
            first_px: range_px[0],
            step_px,
            count: count.max(3),
        }
    }

    /// The disparity of candidate `i`, which may lie between two.
    pub fn disparity_px(&self, i: f64) -> f64 {
        self.first_px + i * self.step_px
    }
}

/// Costs of all candidates of a pixel side by side, pixels row-major.
#[derive(Clone, Debug)]
pub(super) struct Volume {
    pub width: usize,
    pub height: usize,
    pub candidates: Candidates,
    pub costs: Vec<f32>,
}

/// The costs on the grid of `levels[0]`, summed over `levels` of the pyramid (ascending).
pub(super) fn volume(
    pyramid: &Pyramid,
    levels: &[usize],
    candidates: Candidates,
    pupils: &Pupils,
) -> Volume {
    let fine = levels[0];
    let guide = &pyramid.guides[fine];
    let (width, height) = (guide.width(), guide.height());
    let all: Vec<f64> = (0..candidates.count)
        .map(|i| candidates.disparity_px(i as f64))
        .collect();
    let padded: Vec<Padded> = (levels.iter())
        .map(|&k| {
            let radii = all.iter().map(|candidate| pupils.radius(*candidate, k));
            Padded::new(&pyramid.level(k), radii.max().unwrap_or(0))
        })
        .collect();
    let layers: Vec<Image> = (all.par_iter())
        .map(|candidate| {
            let mut sum = Image::zeros(width, height, 1);
            for (&k, pair) in levels.iter().zip(&padded) {
                let cost = pair.cost(pupils, k, *candidate);
                let cost = enlarged(&cost, k - fine, width, height);
                (sum.data_mut().iter_mut().zip(cost.data())).for_each(|(s, c)| *s += c);
            }
            sum
        })
        .collect();
    let mut costs = vec![0.0f32; width * height * candidates.count];
    (costs.par_chunks_mut(width * candidates.count).enumerate()).for_each(|(y, to)| {
        for (i, layer) in layers.iter().enumerate() {
            let places = to[i..].iter_mut().step_by(candidates.count);
            places.zip(row_of(layer, y)).for_each(|(to, v)| *to = *v);
        }
    });
    Volume {
        width,
        height,
        candidates,
        costs,
    }
}

/// A level with mirrored margins.
struct Padded {
    width: usize,
    height: usize,
    margin: usize,
    /// L − R and L + R.
    rows: [Vec<f32>; 2],
    noise: f64,
}

impl Padded {
    fn new(level: &Level, margin: usize) -> Self {
        let (width, height) = (level.sum.width(), level.sum.height());
        let padded = |image: &Image| {
            let mut data = Vec::with_capacity((width + 2 * margin) * (height + 2 * margin));
            for y in 0..height + 2 * margin {
                let row = row_of(image, mirrored(y as isize - margin as isize, height));
                let columns = 0..width + 2 * margin;
                data.extend(columns.map(|x| row[mirrored(x as isize - margin as isize, width)]));
            }
            data
        };
        Self {
            width,
            height,
            margin,
            rows: [padded(&level.difference), padded(&level.sum)],
            noise: level.noise,
        }
    }

    /// The window's cost of a candidate at each pixel of the level, `k`.
    fn cost(&self, pupils: &Pupils, k: usize, candidate_px: f64) -> Image {
        let kernels = pupils.kernels(candidate_px, k);
        let energy = self.energy(&kernels[kernels.len() / 2]);
        let scale = |kernels: &Kernels| {
            let expected = self.noise * kernels.energy() + pupils.model_error() * energy;
            if expected > 0.0 {
                (1.0 / expected) as f32
            } else {
                0.0
            }
        };
        let scales: Vec<f32> = kernels.iter().map(scale).collect();
        let residual = by_rows(self.width, self.height, |y, to| {
            let mut begin = 0;
            for (end, number) in pupils.runs(k, self.width, y) {
                let run = &mut to[begin..end];
                self.convolve(&kernels[number], y, begin, false, run);
                (run.iter_mut()).for_each(|v| *v = v.powi(2) * scales[number]);
                begin = end;
            }
        });
        gaussian(&residual, WINDOW_PX)
    }

    /// The mean energy of both views, each blurred by the other's kernel, from every so many rows.
    fn energy(&self, kernels: &Kernels) -> f64 {
        let mut energy = 0.0f64;
        let mut line = vec![0.0f32; self.width];
        let mut squares = |swapped: bool, y: usize| {
            self.convolve(kernels, y, 0, swapped, &mut line);
            line.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>()
        };
        for y in (0..self.height).step_by(ENERGY_STRIDE) {
            energy += 0.5 * (squares(false, y) + squares(true, y));
        }
        energy / (self.width * self.height.div_ceil(ENERGY_STRIDE)) as f64
    }

    /// Row `y` of (L − R) ⊗ A + (L + R) ⊗ B from column `x` on; `swapped`: of (L + R) ⊗ A + (L − R) ⊗ B.
    fn convolve(&self, kernels: &Kernels, y: usize, x: usize, swapped: bool, to: &mut [f32]) {
        let (radius, side) = (kernels.radius, 2 * kernels.radius + 1);
        let stride = self.width + 2 * self.margin;
        let [even, odd] = if swapped { [1, 0] } else { [0, 1] };
        to.fill(0.0);
        let begin = x + self.margin - radius;
        let length = to.len() + 2 * radius;
        let row = |which: usize, y: usize| &self.rows[which][y * stride + begin..][..length];
        let line = |j: usize| [&kernels.even, &kernels.odd].map(|k| &k[j * side..][..side]);
        // The kernel's row and column j reach what lies on the other side.
        let opposite = |j: usize| y + self.margin + radius - j;
        if !kernels.is_symmetric {
            for j in 0..side {
                let of = [even, odd].map(|which| row(which, opposite(j)));
                lines::add(of, line(j), to);
            }
            return;
        }
        // Of symmetric ones two rows are one.
        lines::add(
            [even, odd].map(|which| row(which, opposite(radius))),
            line(radius),
            to,
        );
        let mut folded = [vec![0.0f32; length], vec![0.0f32; length]];
        for j in radius + 1..side {
            let (up, down) = (opposite(j), y + self.margin + j - radius);
            for (to, which) in folded.iter_mut().zip([even, odd]) {
                let pair = row(which, up).iter().zip(row(which, down));
                to.iter_mut().zip(pair).for_each(|(to, (u, d))| *to = u + d);
            }
            let [of_even, of_odd] = &folded;
            lines::add([of_even, of_odd], line(j), to);
        }
    }
}
