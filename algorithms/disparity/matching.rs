//! From two pictures to the shifts of their windows: whole pixels first, then fractions.

use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;

use super::error::MatchError;
use super::matches::DisparityMap;
use super::prepared::Prepared;
use super::settings::MatchSettings;
use super::{refine, search};

/// Matches single-channel `a` against `b`, both of one size; rows of nodes run in parallel and do not depend on each
/// other, so that the result is the same for any number of threads.
///
/// # Errors
/// More than one channel, numbers that are not finite, unlike or too small sizes, a setting out of its range.
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
    let pictures = Prepared::new(a, b, settings)?;
    let starts = search::whole_pixels(&pictures, settings, level);
    let matches = refine::refine(&pictures, &starts, settings, level);
    Ok(DisparityMap {
        grid: pictures.grid,
        matches,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::disparity::{Limits, Verdict};

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
        let settings: &[_] = match cfg!(miri) {
            true => &[(9, 37, 4)],
            false => &[(21, 4, 4), (15, 3, 4), (31, 5, 9), (9, 11, 4)],
        };
        for &(window_px, stride_px, search_px) in settings {
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
            let text = |level| {
                let map = match_with(&a, &b, &settings, level).unwrap();
                let verdicts = Verdict::ALL.map(|v| map.count(v));
                assert!(verdicts[0] > 0, "window {window_px}: {verdicts:?}");
                format!("{map:?}")
            };
            let plain = text(SimdLevel::Scalar);
            for level in SimdLevel::ALL {
                if level <= SimdLevel::detect() {
                    assert_eq!(text(level), plain, "{level:?}, window {window_px}");
                }
            }
        }
    }
}
