//! The shift between two views of a textured plane, over windows as large as the picture allows.

use glam::{DMat3, DVec3};
use quadpixel::image::Image;

/// Room that windows leave to the picture's edge, for the shift and the pixels it is interpolated from, px; the largest
/// shift.
const ROOM: usize = 12;
const FARTHEST_PX: f64 = 7.0;
/// Pixels that one between them is interpolated from.
const TAPS: usize = 8;
/// Steps until a shift settles, and what the last one may be, px.
const STEPS: usize = 40;
const SETTLED_PX: f64 = 1e-4;

/// A rectangle of a picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its left upper corner.
    pub corner: [usize; 2],
    /// Width and height.
    pub size: [usize; 2],
}

/// The shift of a block of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockShift {
    /// Middle of the block, px from the middle of the picture, right and down.
    pub place_px: [f64; 2],
    /// x_L − x_R, px.
    pub shift_px: f64,
    /// Its standard deviation, px, by the spread of the block's quarters.
    pub sigma_px: f64,
}

/// x_L − x_R over a grid of blocks of one channel of two views of a size; without those in which no shift settles.
pub fn block_shifts(left: &Image, right: &Image, grid: [usize; 2]) -> Vec<BlockShift> {
    let whole = [left.width(), left.height()];
    let span = |k: usize, axis: usize| k * whole[axis] / grid[axis];
    let block = |i: usize| {
        let at = [i % grid[0], i / grid[0]];
        let corner = [0, 1].map(|axis| span(at[axis], axis));
        let end = [0, 1].map(|axis| span(at[axis] + 1, axis));
        let size = [0, 1].map(|axis| end[axis] - corner[axis]);
        let shift_px = window_shift_px(right, left, Window { corner, size })?;
        let half = size.map(|n| n / 2);
        let quarters = (0..4).map(|q| {
            let corner = [corner[0] + q % 2 * half[0], corner[1] + q / 2 * half[1]];
            window_shift_px(right, left, Window { corner, size: half })
        });
        let quarters = quarters.collect::<Option<Vec<f64>>>()?;
        let mean = quarters.iter().sum::<f64>() / 4.0;
        let squares: f64 = quarters.iter().map(|q| (q - mean).powi(2)).sum();
        Some(BlockShift {
            place_px: [0, 1]
                .map(|axis| 0.5 * (corner[axis] + end[axis]) as f64 - 0.5 * whole[axis] as f64),
            shift_px,
            sigma_px: (squares / 3.0 / 4.0).sqrt(),
        })
    };
    (0..grid[0] * grid[1]).filter_map(block).collect()
}

/// d of a(x) = g b(x + d) + o over a window, by Gauss-Newton from 0; d to the right, px.
/// `None` where it does not settle. (The matcher's own windows end at 31 px.)
///
/// Between pixels b is Lagrange's polynomial through eight of them, which displaces no wave of eight pixels or
/// longer by a thousandth; Lanczos's kernel displaces long ones by 0.013 px.
pub fn window_shift_px(a: &Image, b: &Image, window: Window) -> Option<f64> {
    let whole = [a.width(), a.height()];
    let span = |axis: usize| {
        let end = window.corner[axis] + window.size[axis];
        window.corner[axis].max(ROOM)..end.min(whole[axis].saturating_sub(ROOM))
    };
    let (columns, rows) = (span(0), span(1));
    if columns.is_empty() || rows.is_empty() {
        return None;
    }
    let mut d = 0.0;
    for _ in 0..STEPS {
        let below = f64::floor(d);
        let (taps, slopes) = taps(d - below);
        let first = below as isize - (TAPS as isize / 2 - 1);
        // Unknowns: g, o, and g times the step; normal equations of the three.
        let (mut m, mut v) = (DMat3::ZERO, DVec3::ZERO);
        for y in rows.clone() {
            for x in columns.clone() {
                let (mut moved, mut slope) = (0.0, 0.0);
                for (k, (tap, change)) in taps.iter().zip(&slopes).enumerate() {
                    let at = x.checked_add_signed(first + k as isize)?;
                    let value = f64::from(b.pixel(at, y)[0]);
                    moved += tap * value;
                    slope += change * value;
                }
                let row = DVec3::new(moved, 1.0, slope);
                m += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
                v += row * f64::from(a.pixel(x, y)[0]);
            }
        }
        let solved = m.inverse() * v;
        let step = (solved.z / solved.x).clamp(-0.5, 0.5);
        d += step;
        if step.abs() < SETTLED_PX {
            return Some(d);
        }
        // Beyond, the taps would leave the picture.
        if d.is_nan() || d.abs() > FARTHEST_PX {
            return None;
        }
    }
    None
}

/// Lagrange's weights of the pixels −3 to 4 at 0 to 1 between the two in the middle, and their derivatives.
fn taps(t: f64) -> ([f64; TAPS], [f64; TAPS]) {
    let node = |k: usize| k as f64 - (TAPS / 2 - 1) as f64;
    let others = |k: usize| (0..TAPS).filter(move |j| *j != k);
    let weight = |k: usize, without: Option<usize>| -> f64 {
        let factors = others(k).filter(|j| Some(*j) != without);
        factors
            .map(|j| (t - node(j)) / (node(k) - node(j)))
            .product()
    };
    let slope = |k: usize| -> f64 {
        let terms = others(k).map(|j| weight(k, Some(j)) / (node(k) - node(j)));
        terms.sum()
    };
    (
        std::array::from_fn(|k| weight(k, None)),
        std::array::from_fn(slope),
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn waves(shift_px: f64, gain: f64) -> Image {
        let mut image = Image::zeros(160, 120, 1);
        for y in 0..120 {
            for x in 0..160 {
                let (x_, y_) = (x as f64 - shift_px, y as f64);
                let wave =
                    (0.31 * x_ + 0.2 * y_).sin() + (0.17 * x_ - 0.4 * y_).cos() + (0.6 * x_).sin();
                image.pixel_mut(x, y)[0] = (gain * (2.0 + 0.4 * wave)) as f32;
            }
        }
        image
    }

    #[test]
    fn copies_of_another_gain_are_as_far_apart_as_they_were_put() {
        let (left, right) = (waves(0.8, 1.0), waves(-0.4, 1.3));
        let found = block_shifts(&left, &right, [2, 2]);
        assert_eq!(found.len(), 4);
        for block in &found {
            assert!(
                (block.shift_px - 1.2).abs() < 1e-3 && block.sigma_px < 1e-3,
                "{block:?}"
            );
        }
        assert_eq!(found[0].place_px, [-40.0, -30.0]);
        assert!(block_shifts(&Image::zeros(160, 120, 1), &right, [2, 2]).is_empty());
    }

    #[test]
    fn long_and_short_waves_are_displaced_alike() {
        for t in [0.0, 0.2, 0.5, 0.97] {
            let (taps, slopes) = taps(t);
            for length_px in [200.0, 30.0, 8.0] {
                let turn = std::f64::consts::TAU / length_px;
                let of = |weights: &[f64; TAPS]| {
                    let wave = |k: usize, f: fn(f64) -> f64| f(turn * (k as f64 - 3.0 - t));
                    let sum = |f| (0..TAPS).map(|k| weights[k] * wave(k, f)).sum::<f64>();
                    [sum(f64::cos), sum(f64::sin)]
                };
                let [re, im] = of(&taps);
                assert!(
                    (im.atan2(re) / turn).abs() < 1e-3,
                    "{t} {length_px}: {re} {im}"
                );
                let [_, im] = of(&slopes);
                assert!((im / turn - 1.0).abs() < 0.02, "{t} {length_px}: {im}");
            }
        }
    }
}
