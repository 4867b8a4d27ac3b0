//! The fast warp of a row: weights for a block of pixels at once, then 8 × 8 taps a pixel.
//!
//! Straight-line arithmetic that the compiler turns into vectors of whatever width the caller's instructions have,
//! hence `inline(always)`. Every sum has a fixed order, so all of them give the same bits.

use quadpixel::image::Image;

use super::Border;
use super::weights::{TAPS, weights};

/// Pixels whose weights are computed together.
const BLOCK: usize = 32;

/// Positions from here on are none; below, they and their taps are exact integers.
const LIMIT_PX: f64 = (1 << 30) as f64;

/// The image to be warped.
pub(super) struct Source<'a> {
    data: &'a [f32],
    width: usize,
    height: usize,
    border: Border,
    outside: f32,
}

impl<'a> Source<'a> {
    pub(super) fn new(image: &'a Image, border: Border) -> Self {
        Self {
            data: image.data(),
            width: image.width(),
            height: image.height(),
            border,
            outside: match border {
                Border::Constant(value) => value,
                _ => 0.0,
            },
        }
    }
}

impl Source<'_> {
    /// All taps from (left, top) on are samples of the image.
    #[inline(always)]
    fn holds(&self, left: i64, top: i64) -> bool {
        let (width, height) = (self.width as i64, self.height as i64);
        let taps = TAPS as i64;
        left >= 0 && top >= 0 && left + taps <= width && top + taps <= height
    }
}

/// Floors and weights of a block of positions on one axis.
struct Axis {
    floor: [f64; BLOCK],
    fraction: [f32; BLOCK],
    weight: [[f32; BLOCK]; TAPS],
}

impl Axis {
    #[inline(always)]
    fn new<const A: usize>(positions: &[f64; BLOCK]) -> Self {
        // Adding and taking away 1.5 · 2^52 rounds to the nearest integer, in vectors of any width.
        const ROUNDER: f64 = 6_755_399_441_055_744.0;
        let mut axis = Self {
            floor: [0.0; BLOCK],
            fraction: [0.0; BLOCK],
            weight: [[0.0; BLOCK]; TAPS],
        };
        for (i, &position) in positions.iter().enumerate() {
            let nearest = (position + ROUNDER) - ROUNDER;
            let floor = nearest - if nearest > position { 1.0 } else { 0.0 };
            axis.floor[i] = floor;
            axis.fraction[i] = (position - floor) as f32;
        }
        for i in 0..BLOCK {
            let taps = weights::<A>(axis.fraction[i]);
            for (row, tap) in axis.weight.iter_mut().zip(taps) {
                row[i] = tap;
            }
        }
        axis
    }

    #[inline(always)]
    fn taps(&self, i: usize) -> [f32; TAPS] {
        std::array::from_fn(|k| self.weight[k][i])
    }
}

/// Warps one row: `x`, `y` its positions, `out` its samples, `valid` its mask.
#[inline(always)]
pub(super) fn row<const A: usize, const CHANNELS: usize, const LANES: usize>(
    source: &Source<'_>,
    x: &[f64],
    y: &[f64],
    out: &mut [f32],
    valid: &mut [bool],
) {
    let (right, bottom) = ((source.width - 1) as f64, (source.height - 1) as f64);
    for start in (0..x.len()).step_by(BLOCK) {
        let count = BLOCK.min(x.len() - start);
        let (mut xs, mut ys) = ([0.0; BLOCK], [0.0; BLOCK]);
        xs[..count].copy_from_slice(&x[start..start + count]);
        ys[..count].copy_from_slice(&y[start..start + count]);
        let (across, down) = (Axis::new::<A>(&xs), Axis::new::<A>(&ys));
        // The sums over the rows of the kernel are kept for the whole block: carried on pixel by pixel, the compiler
        // breaks the vectors of three channels into pieces.
        let mut sums = [[0.0; LANES]; BLOCK];
        let mut open = [false; BLOCK];
        for i in 0..count {
            if !(xs[i].abs() < LIMIT_PX && ys[i].abs() < LIMIT_PX) {
                continue; // zeros and "not valid" stand there already
            }
            let inside = xs[i] >= 0.0 && xs[i] <= right && ys[i] >= 0.0 && ys[i] <= bottom;
            valid[start + i] = inside;
            // The position of the first tap.
            let left = i64::from(across.floor[i] as i32) - 3;
            let top = i64::from(down.floor[i] as i32) - 3;
            open[i] = xs[i] != across.floor[i] || ys[i] != down.floor[i];
            let to = &mut out[(start + i) * CHANNELS..(start + i + 1) * CHANNELS];
            if source.holds(left, top) {
                let first = (top as usize * source.width + left as usize) * CHANNELS;
                let stride = source.width * CHANNELS;
                let window = &source.data[first..first + (TAPS - 1) * stride + LANES];
                let rows: [&[f32; LANES]; TAPS] = std::array::from_fn(|r| {
                    // There are that many samples; the constant is never taken.
                    window[r * stride..].first_chunk().unwrap_or(&[0.0; LANES])
                });
                sum_rows::<LANES>(rows, &down.taps(i), &mut sums[i]);
                to.copy_from_slice(&rows[3][3 * CHANNELS..4 * CHANNELS]);
            } else {
                let patch = border_patch::<CHANNELS, LANES>(source, left, top);
                sum_rows::<LANES>(patch.each_ref(), &down.taps(i), &mut sums[i]);
                to.copy_from_slice(&patch[3][3 * CHANNELS..4 * CHANNELS]);
            }
        }
        for i in 0..count {
            if open[i] {
                let to = &mut out[(start + i) * CHANNELS..(start + i + 1) * CHANNELS];
                sum_taps::<CHANNELS, LANES>(&mut sums[i], &across.taps(i), to);
            }
        }
    }
}

/// The samples under the kernel whose first tap stands at (left, top), some of them outside of the image.
#[inline(never)]
fn border_patch<const CHANNELS: usize, const LANES: usize>(
    source: &Source<'_>,
    left: i64,
    top: i64,
) -> [[f32; LANES]; TAPS] {
    let mut patch = [[0.0; LANES]; TAPS];
    for (r, row) in (0..).zip(&mut patch) {
        let line = source.border.index(top + r, source.height);
        for (k, to) in (0..).zip(row.chunks_exact_mut(CHANNELS)) {
            match (source.border.index(left + k, source.width), line) {
                (Some(column), Some(line)) => {
                    let from = (line * source.width + column) * CHANNELS;
                    to.copy_from_slice(&source.data[from..from + CHANNELS]);
                }
                _ => to.fill(source.outside),
            }
        }
    }
    patch
}

/// Sum over the rows of the kernel, tap by tap.
#[inline(always)]
fn sum_rows<const LANES: usize>(
    rows: [&[f32; LANES]; TAPS],
    down: &[f32; TAPS],
    to: &mut [f32; LANES],
) {
    let mut sum = [0.0; LANES];
    for r in 0..TAPS {
        for k in 0..LANES {
            sum[k] += down[r] * rows[r][k];
        }
    }
    *to = sum;
}

/// Sum over the taps, by halves, which keeps the channels apart.
#[inline(always)]
fn sum_taps<const CHANNELS: usize, const LANES: usize>(
    sum: &mut [f32; LANES],
    across: &[f32; TAPS],
    to: &mut [f32],
) {
    for k in 0..LANES {
        sum[k] *= across[k / CHANNELS];
    }
    for half in [LANES / 2, LANES / 4, LANES / 8] {
        for k in 0..half {
            sum[k] += sum[k + half];
        }
    }
    to.copy_from_slice(&sum[..CHANNELS]);
}
