//! Warping by the exact Lanczos kernel: out(p) = image(map(p)).
//!
//! ```text
//! out(x', y') = Σ_r Σ_k ŵ(y − y0 − r) ŵ(x − x0 − k) I(x0 + k, y0 + r)        (x, y) = map(x', y'),  x0 = ⌊x⌋, y0 = ⌊y⌋
//! w(t) = sinc(t) sinc(t/a) for |t| < a, else 0;   sinc(t) = sin(πt)/(πt);   ŵ = w / Σ w
//! ```
//!
//! - a: lobes of the kernel, 3 or 4; k and r run over the 2a taps from 1 − a to a.
//! - The weights are normalised to the sum 1 on each axis, so a constant image stays constant at every position.
//! - Coordinates are not quantised, and a position on the grid gives its sample, bit for bit.
//! - Values are not clipped: the negative lobes may leave the image's range.
//!
//! Kernel: C. E. Duchon, "Lanczos filtering in one and two dimensions", J. Appl. Meteorol. 18, 1016 (1979). [`plain`]
//! is the definition in f64 and the oracle of [`warp`], which computes in f32 and gives the same bits at each
//! [`SimdLevel`].
//!
//! Pixel (x, y) is column x, row y; integer coordinates are pixel centres.

mod border;
mod kernel;
mod map;
pub mod plain;
pub(crate) mod weights;

pub use border::Border;
pub use map::{Map, MapError};

use quadpixel::image::Image;
use rayon::prelude::*;

use kernel::Source;
use quadpixel::simd::SimdLevel;

/// Lobes a of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobes {
    /// 6 × 6 taps.
    Three,
    /// 8 × 8 taps.
    Four,
}

impl Lobes {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Three, Self::Four];

    /// The number a.
    pub fn count(self) -> usize {
        match self {
            Self::Three => 3,
            Self::Four => 4,
        }
    }
}

/// What [`warp`] gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Warped {
    /// The warped image, of the map's size. Where the map holds no position (NaN, ±∞, beyond ±2³⁰ px): 0.
    pub image: Image,
    /// Per pixel, row-major: the position lies within the image, 0 ≤ x ≤ width − 1 and 0 ≤ y ≤ height − 1. Elsewhere
    /// the border alone speaks.
    pub valid: Vec<bool>,
}

/// Warps all channels of `image` (finite; of an empty one nothing is valid) by `map`, on rayon's threads; they and
/// `level` change the speed only. A level above what the CPU has is lowered.
pub fn warp(image: &Image, map: &Map, lobes: Lobes, border: Border, level: SimdLevel) -> Warped {
    let level = level.min(SimdLevel::detect());
    match (image.channels(), lobes) {
        (1, Lobes::Three) => run::<3, 1, 8>(image, map, border, level),
        (1, Lobes::Four) => run::<4, 1, 8>(image, map, border, level),
        (3, Lobes::Three) => run::<3, 3, 24>(image, map, border, level),
        (3, Lobes::Four) => run::<4, 3, 24>(image, map, border, level),
        _ => channel_by_channel(image, map, lobes, border, level),
    }
}

fn channel_by_channel(
    image: &Image,
    map: &Map,
    lobes: Lobes,
    border: Border,
    level: SimdLevel,
) -> Warped {
    let channels = image.channels();
    let mut warped = Warped {
        image: Image::zeros(map.width(), map.height(), channels),
        valid: vec![false; map.width() * map.height()],
    };
    for channel in 0..channels {
        let mut plane = Image::zeros(image.width(), image.height(), 1);
        let from = image.data().iter().skip(channel).step_by(channels);
        plane
            .data_mut()
            .iter_mut()
            .zip(from)
            .for_each(|(to, v)| *to = *v);
        let done = warp(&plane, map, lobes, border, level);
        let to = warped.image.data_mut().iter_mut().skip(channel);
        to.step_by(channels)
            .zip(done.image.data())
            .for_each(|(to, v)| *to = *v);
        warped.valid = done.valid;
    }
    warped
}

/// `LANES` = 8 · `CHANNELS`: the samples under a row of the kernel.
fn run<const A: usize, const CHANNELS: usize, const LANES: usize>(
    image: &Image,
    map: &Map,
    border: Border,
    level: SimdLevel,
) -> Warped {
    let (width, height) = (map.width(), map.height());
    let mut warped = Warped {
        image: Image::zeros(width, height, CHANNELS),
        valid: vec![false; width * height],
    };
    if image.data().is_empty() {
        return warped;
    }
    let source = Source::new(image, border);
    warped
        .image
        .data_mut()
        .par_chunks_mut(width * CHANNELS)
        .zip(warped.valid.par_chunks_mut(width))
        .enumerate()
        .for_each(|(row, (out, valid))| {
            let (x, y) = map.row(row);
            match level {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `warp` lowered the level to what `detect` found on this CPU: AVX-512 F, DQ and VL.
                SimdLevel::Avx512 => unsafe {
                    row_avx512::<A, CHANNELS, LANES>(&source, x, y, out, valid);
                },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `warp` lowered the level to what `detect` found on this CPU: AVX2 or more.
                SimdLevel::Avx2 => unsafe {
                    row_avx2::<A, CHANNELS, LANES>(&source, x, y, out, valid);
                },
                _ => kernel::row::<A, CHANNELS, LANES>(&source, x, y, out, valid),
            }
        });
    warped
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn row_avx2<const A: usize, const CHANNELS: usize, const LANES: usize>(
    source: &Source<'_>,
    x: &[f64],
    y: &[f64],
    out: &mut [f32],
    valid: &mut [bool],
) {
    kernel::row::<A, CHANNELS, LANES>(source, x, y, out, valid);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn row_avx512<const A: usize, const CHANNELS: usize, const LANES: usize>(
    source: &Source<'_>,
    x: &[f64],
    y: &[f64],
    out: &mut [f32],
    valid: &mut [bool],
) {
    kernel::row::<A, CHANNELS, LANES>(source, x, y, out, valid);
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
