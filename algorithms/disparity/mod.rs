//! Sub-pixel block matching: how far each part of one view is shifted against another.
//!
//! ```text
//! A, B ─ plane ─▶ zero mean, unit deviation ─ search ─▶ whole pixels + summit ─ refine ─▶ shift, covariance, verdict
//!          └ halved (beyond 4 px) ─ search ─▶ guess ─┘
//! ```
//!
//! The model of a window is `a(x) = g·b(x + d) + o`: what lies at x in A lies at x + d in B; d in pixels, x to the right, y
//! down, gain g and offset o free in each window. Whole pixels come from the largest zero-mean normalised
//! cross-correlation (ZNCC), d from inverse-compositional Gauss–Newton (Baker & Matthews, IJCV 56, 221 (2004)) with the exact
//! Lanczos kernel (a = 4). It begins at the summit of the correlations, or where the node to the left ended.
//!
//! The covariance is `C = σ²(Σ∇a∇aᵀ)⁻¹` with σ² from the residual, which holds both images' noise; without noise models of
//! its own it tells which directions a window can measure. It knows nothing of systematic errors: up to 0.04 px where B's
//! point spread is wider by 1 px at half its maximum (σ 0.85 to 1.27 px; much the same as a further blur of σ = 1 px), and
//! 0.07 px where σ itself grows by 1 px; even out the blur first.
//!
//! # Cost
//!
//! The least that this algorithm needs a node, at stride 4, window 21 and ±4 px:
//!
//! | | operations |
//! |---|---|
//! | search: 81 shifts of 16 products, 34 sums | 4 050 |
//! | sampling, 28 + 21 rows of 21 samples, 15 operations each | 15 400 |
//! | its five sums with the reference, 11 operations a pixel | 4 900 |
//! | gradient and Hessian of a reference: 12 operations a pixel of 4 columns, sums of 21 columns | 1 200 |
//!
//! One sampling with its sums there (1.2 on average) and one back, and two references: 51 000 operations, 3.2 G/Mpx, or 0.09
//! s/Mpx with 16 a clock (two AVX2 units, no fused multiply-add, as results must be the same everywhere) at 2.3 GHz. Memory: 2
//! pictures of 4 bytes a pixel in, and 8 planes (values, mean, norm, gradients of both) written and read once: 72 MB/Mpx,
//! 0.01 s/Mpx. So it is the refinement's arithmetic that counts, and what helps is to need fewer samplings.

mod geometry;
mod lanes;
mod matches;
mod peak;
mod plane;
mod reference;
mod refine;
mod sampler;
mod search;
mod settings;
mod surfaces;
mod tile;

pub use geometry::{Axes, Grid};
pub use matches::{DisparityMap, Match, Verdict};
pub use settings::{Limits, MatchSettings};
pub use surfaces::{ZnccSurfaces, zncc_surfaces};

use matches::largest_eigenvalue;
use plane::{Plane, WindowStatistics};
use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;

/// Largest search, in pixels, done at full resolution; beyond it the search goes from coarse to fine.
pub const DIRECT_SEARCH_PX: usize = 4;

/// Pictures or settings that cannot be matched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MatchError {
    /// Not a single channel.
    #[error("{0} channels: matching takes one channel at a time")]
    Channels(usize),
    /// NaN or infinity.
    #[error("pixel (x {x}, y {y}) holds {value}: only finite numbers are allowed")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// NaN or ±∞.
        value: f32,
    },
    /// A and B differ in size.
    #[error("A has {} × {} pixels and B {} × {}: both must be of one size", .a.0, .a.1, .b.0, .b.1)]
    Size {
        /// Columns and rows of A.
        a: (usize, usize),
        /// Columns and rows of B.
        b: (usize, usize),
    },
    /// No window fits.
    #[error(
        "{width} × {height} pixels: a window of {window} px and its interpolation need at least {least} × {least}"
    )]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Window.
        window: usize,
        /// Smallest side.
        least: usize,
    },
    /// A setting out of its range.
    #[error("{name} = {value}: allowed is {allowed}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Range.
        allowed: &'static str,
    },
}

/// Matches single-channel `a` against `b`, both of one size; rows of nodes run in parallel and do not depend on each other,
/// so that the result is the same for any number of threads.
pub fn match_images(
    a: &Image,
    b: &Image,
    settings: &MatchSettings,
) -> Result<DisparityMap, MatchError> {
    match_with(a, b, settings, SimdLevel::detect())
}

/// With given instructions, which change the speed only.
fn match_with(
    a: &Image,
    b: &Image,
    settings: &MatchSettings,
    level: SimdLevel,
) -> Result<DisparityMap, MatchError> {
    let Prepared {
        a,
        b,
        grid,
        statistics,
    } = Prepared::new(a, b, settings)?;
    let starts = search::whole_pixels(&a, &b, &statistics, &grid, settings, level);
    let matches = refine::refine(&a, &b, &statistics, &grid, &starts, settings, level);
    Ok(DisparityMap { grid, matches })
}

/// Two pictures that can be matched.
struct Prepared {
    a: Plane,
    b: Plane,
    grid: Grid,
    statistics: [WindowStatistics; 2],
}

impl Prepared {
    fn new(a: &Image, b: &Image, settings: &MatchSettings) -> Result<Self, MatchError> {
        settings::check(settings)?;
        if (a.width(), a.height()) != (b.width(), b.height()) {
            return Err(MatchError::Size {
                a: (a.width(), a.height()),
                b: (b.width(), b.height()),
            });
        }
        let (a, b) = (Plane::new(a)?, Plane::new(b)?);
        let grid = Grid::new(a.width, a.height, settings).ok_or(MatchError::TooSmall {
            width: a.width,
            height: a.height,
            window: settings.window_px,
            least: settings.window_px + 2 * geometry::TAPS_PX,
        })?;
        let half = settings.window_px / 2;
        let statistics = [
            WindowStatistics::new(&a, half),
            WindowStatistics::new(&b, half),
        ];
        Ok(Self {
            a,
            b,
            grid,
            statistics,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        // A smooth, irregular picture, and the same moved by (1.3, −2.6) px.
        let picture = |dx: f64, dy: f64| {
            let value = |i: usize| {
                let (x, y) = ((i % 97) as f64 - dx, (i / 97) as f64 - dy);
                let wave = |a: f64, b: f64| (a * x + b * y + 0.02 * a * x * y / 9.0).sin();
                (wave(0.9, 0.3) + wave(-0.4, 1.1) + wave(0.2, -0.6) * wave(1.3, 0.8)) as f32
            };
            Image::from_vec(97, 81, 1, (0..97 * 81).map(value).collect()).unwrap()
        };
        let (a, b) = (picture(0.0, 0.0), picture(1.3, -2.6));
        for (window_px, stride_px, search_px) in [(21, 4, 4), (15, 3, 4), (31, 5, 9), (9, 11, 4)] {
            let settings = MatchSettings {
                window_px,
                stride_px,
                search_px,
                limits: Limits {
                    second_peak: 2.0, // waves repeat themselves; that is not the question here
                    ..Limits::default()
                },
                ..MatchSettings::default()
            };
            // NaN is not equal to itself; its text is.
            let of = |level| {
                let map = match_with(&a, &b, &settings, level).unwrap();
                let verdicts = Verdict::ALL.map(|v| map.count(v));
                assert!(verdicts[0] > 0, "window {window_px}: {verdicts:?}");
                format!("{map:?}")
            };
            let plain = of(SimdLevel::Scalar);
            for level in SimdLevel::ALL {
                if level <= SimdLevel::detect() {
                    assert_eq!(of(level), plain, "{level:?}, window {window_px}");
                }
            }
        }
    }
}
