//! The definition, computed as it stands in f64: the oracle of the fast warp.

use std::f64::consts::PI;

use quadpixel::image::Image;

use super::{Border, Lobes};

/// w(t) = sinc(t) sinc(t/a), not normalised; 0 from |t| = a on.
pub fn lanczos(t: f64, lobes: Lobes) -> f64 {
    let a = lobes.count() as f64;
    let sinc = |t: f64| {
        if t == 0.0 {
            1.0
        } else {
            (PI * t).sin() / (PI * t)
        }
    };
    if t.abs() < a {
        sinc(t) * sinc(t / a)
    } else {
        0.0
    }
}

/// Normalised weights of the taps at ⌊x⌋ − 3 to ⌊x⌋ + 4 for the position x; three lobes leave the outer two at 0.
pub fn weights(x: f64, lobes: Lobes) -> [f64; 8] {
    let fraction = x - x.floor();
    if fraction == 0.0 {
        return [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]; // sin(πk) is 1e-16 in floating point
    }
    let raw: [f64; 8] = std::array::from_fn(|k| lanczos(fraction - (k as f64 - 3.0), lobes));
    let sum: f64 = raw.iter().sum();
    raw.map(|w| w / sum)
}

/// One channel at a position; `None` where that is no number or beyond ±2³⁰ px.
pub fn sample(
    image: &Image,
    channel: usize,
    x: f64,
    y: f64,
    lobes: Lobes,
    border: Border,
) -> Option<f64> {
    let limit = f64::from(1 << 30);
    if !(x.abs() < limit && y.abs() < limit) {
        return None;
    }
    let (wx, wy) = (weights(x, lobes), weights(y, lobes));
    let (x0, y0) = (x.floor() as i64 - 3, y.floor() as i64 - 3);
    let outside = match border {
        Border::Constant(value) => f64::from(value),
        _ => 0.0,
    };
    let mut sum = 0.0;
    for (r, wy) in (0..).zip(wy) {
        for (k, wx) in (0..).zip(wx) {
            let column = border.index(x0 + k, image.width());
            let row = border.index(y0 + r, image.height());
            let value = match (column, row) {
                (Some(column), Some(row)) => f64::from(image.pixel(column, row)[channel]),
                _ => outside,
            };
            sum += wy * wx * value;
        }
    }
    Some(sum)
}
