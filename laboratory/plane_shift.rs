//! The shift between two views of a textured plane, over windows as large as the picture allows.

use glam::{DMat3, DVec3};
use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};

/// Room around a window for the shift and the kernel, px.
const ROOM: usize = 12;
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

/// d of a(x) = g b(x + d) + o over a window, by Gauss-Newton from 0 with the exact Lanczos kernel; d to the right, px.
/// `None` where it does not settle. (The matcher's own windows end at 31 px.)
pub fn window_shift_px(a: &Image, b: &Image, window: Window) -> Option<f64> {
    let whole = [a.width(), a.height()];
    let span = |axis: usize| {
        let (from, size) = (window.corner[axis], window.size[axis]);
        (
            from.max(ROOM),
            (from + size).min(whole[axis].saturating_sub(ROOM)),
        )
    };
    let ((x0, x1), (y0, y1)) = (span(0), span(1));
    if x1 <= x0 || y1 <= y0 {
        return None;
    }
    // Only what the window needs is moved.
    let around = |image: &Image| {
        let [width, height] = [x1 - x0 + 2 * ROOM, y1 - y0 + 2 * ROOM];
        let mut part = Image::zeros(width, height, 1);
        for y in 0..height {
            for x in 0..width {
                part.pixel_mut(x, y)[0] = image.pixel(x0 - ROOM + x, y0 - ROOM + y)[0];
            }
        }
        part
    };
    let (a, b) = (around(a), around(b));
    let mut d = 0.0;
    for _ in 0..STEPS {
        let map = Map::shift(b.width(), b.height(), d, 0.0).ok()?;
        let moved = warp(
            &b,
            &map,
            Lobes::Four,
            Border::Replicate,
            SimdLevel::detect(),
        )
        .image;
        // Unknowns: g, o, and g times the step; normal equations of the three.
        let (mut m, mut v) = (DMat3::ZERO, DVec3::ZERO);
        for y in ROOM..b.height() - ROOM {
            for x in ROOM..b.width() - ROOM {
                let at = |x: usize| f64::from(moved.pixel(x, y)[0]);
                let slope = (8.0 * (at(x + 1) - at(x - 1)) - (at(x + 2) - at(x - 2))) / 12.0;
                let row = DVec3::new(at(x), 1.0, slope);
                m += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
                v += row * f64::from(a.pixel(x, y)[0]);
            }
        }
        let solved = m.inverse() * v;
        let step = (solved.z / solved.x).clamp(-0.5, 0.5);
        d += step;
        if step.abs() < SETTLED_PX {
            return (d.abs() < ROOM as f64).then_some(d);
        }
    }
    None
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
        // Lanczos's kernel of four lobes moves slow waves 0.2 px off a pixel by 0.005 px too little.
        for block in &found {
            assert!(
                (block.shift_px - 1.2).abs() < 8e-3 && block.sigma_px < 2e-3,
                "{block:?}"
            );
        }
        assert_eq!(found[0].place_px, [-40.0, -30.0]);
        assert!(block_shifts(&Image::zeros(160, 120, 1), &right, [2, 2]).is_empty());
    }
}
