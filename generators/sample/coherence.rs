//! What the phases of the lens's cone would change within a pixel, by `qpgen study coherent`.
//!
//! The model adds the plane waves of a cone without their phases: right on the mean over places in the pixel, and so of
//! an even wall, wrong of what is finer. The study gives the RMS error of a half's signal in parts of the RMS of the
//! signal about its mean, for a texture of points; here it is taken of the part of the picture that changes from pixel
//! to pixel. It also tells how far the view of a half is from where the model has it.

use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::response::ResponseLookup;
use quadpixel_datasets::{Effect, Effects, EstimatedError, Reason};

/// Pitch, µm; the largest error of a texture, in focus and with blurs of up to 4 px; the largest shift of a half's
/// view, px: F/1.7 to F/8 (`benches/runs/2026-11-22/coherent.md`).
const ERRORS: [(f64, f64, f64); 3] = [(1.6, 0.15, 0.12), (2.8, 0.38, 0.16), (3.5, 0.49, 0.19)];
/// What these stand for.
const PITCHES_UM: std::ops::RangeInclusive<f64> = 1.4..=3.7;
const F_NUMBERS: std::ops::RangeInclusive<f64> = 1.7..=8.0;

/// Enters the effect, which is never simulated. `image`: on any scale.
pub(super) fn enter(camera: &Camera, image: &SubPixelImage, ledger: &mut Effects) {
    let effect = Effect::LensPixelCoherence;
    if matches!(camera.response(), ResponseLookup::Geometric(_)) {
        return ledger.leave_out(effect, Reason::GeometricResponse);
    }
    let pitch_um = camera.sensor().pitch_um();
    let f_number = camera.paraxial().map_or(0.0, |lens| lens.f_number);
    let mut errors = Vec::new();
    if PITCHES_UM.contains(&pitch_um) && F_NUMBERS.contains(&f_number) {
        let (texture, shift_px) = of_pitch(pitch_um);
        errors = vec![
            EstimatedError::SignalPercent(100.0 * texture * fine_contrast(image)),
            EstimatedError::ShiftPx(shift_px),
        ];
    }
    ledger.leave_out_at(effect, Reason::SumWithoutPhases, errors);
}

/// Error of a texture and shift, between the study's pitches linear, beyond them as of the nearest.
fn of_pitch(pitch_um: f64) -> (f64, f64) {
    let above = ERRORS.iter().position(|(pitch, ..)| pitch_um <= *pitch);
    let above = above.unwrap_or(ERRORS.len() - 1).max(1);
    let (first, texture, shift) = ERRORS[above - 1];
    let (last, more_texture, more_shift) = ERRORS[above];
    let t = ((pitch_um - first) / (last - first)).clamp(0.0, 1.0);
    let between = |a: f64, b: f64| a + t * (b - a);
    (between(texture, more_texture), between(shift, more_shift))
}

/// RMS of what changes from pixel to pixel, over the mean: of differences of neighbours in a row and in a column of
/// each view, a half of whose square is theirs.
fn fine_contrast(image: &SubPixelImage) -> f64 {
    let (mosaic, [m, n]) = (&image.mosaic, [image.subpixels.m(), image.subpixels.n()]);
    let (mut squares, mut count, mut light) = (0.0, 0u64, 0.0);
    for y in 0..mosaic.height() {
        for x in 0..mosaic.width() {
            let here = mosaic.pixel(x, y);
            light += here.iter().map(|v| f64::from(*v)).sum::<f64>();
            let right = (x + m < mosaic.width()).then(|| mosaic.pixel(x + m, y));
            let below = (y + n < mosaic.height()).then(|| mosaic.pixel(x, y + n));
            for other in [right, below].into_iter().flatten() {
                for (a, b) in here.iter().zip(other) {
                    squares += 0.5 * f64::from(a - b).powi(2);
                    count += 1;
                }
            }
        }
    }
    let mean = light / mosaic.data().len() as f64;
    match count > 0 && mean > 0.0 {
        true => (squares / count as f64).sqrt() / mean,
        false => 0.0,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::image::Image;
    use quadpixel::sensor::Subpixels;

    fn of(value: impl Fn(usize, usize) -> f32) -> f64 {
        let subpixels = Subpixels::new(2, 2).unwrap();
        let mut mosaic = Image::zeros(16, 16, 3);
        for y in 0..16 {
            for x in 0..16 {
                mosaic.pixel_mut(x, y).fill(value(x, y));
            }
        }
        fine_contrast(&SubPixelImage { subpixels, mosaic })
    }

    #[test]
    fn what_changes_from_pixel_to_pixel_counts_and_shading_of_the_views_does_not() {
        assert_eq!(of(|_, _| 0.4), 0.0);
        // Sub-pixels that differ alike in every pixel.
        assert_eq!(of(|x, y| (x % 2 + y % 2) as f32), 0.0);
        // A chequerboard of pixels of 1 and 3: neighbours differ by 2, so √2 about the mean 2.
        let chequers = of(|x, y| 1.0 + 2.0 * ((x / 2 + y / 2) % 2) as f32);
        assert!((chequers - 0.5f64.sqrt()).abs() < 1e-6, "{chequers}");
    }

    #[test]
    fn errors_are_those_of_the_study_at_its_pitches() {
        for (pitch_um, texture, shift) in ERRORS {
            assert_eq!(of_pitch(pitch_um), (texture, shift));
        }
        assert_eq!(of_pitch(1.5), of_pitch(1.6));
        assert_eq!(of_pitch(3.7), of_pitch(3.5));
        for (pitch_um, texture, shift) in [(2.2, 0.265, 0.14), (3.15, 0.435, 0.175)] {
            let found = of_pitch(pitch_um);
            assert!((found.0 - texture).abs() < 1e-12 && (found.1 - shift).abs() < 1e-12);
        }
    }
}
