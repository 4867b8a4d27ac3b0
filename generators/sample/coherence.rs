//! What the phases of the lens's cone would change within a pixel, by `qpgen study coherent`.
//!
//! The model adds the plane waves of a cone without their phases: right on the mean over places in the pixel, and so of
//! an even wall or a blur of many pixels, wrong of what is finer. The study gives the RMS error of a half's signal in
//! parts of the RMS of the signal about its mean, for a texture of points in focus; here it is taken of the part of the
//! picture that changes from pixel to pixel.

use quadpixel::effects::Tolerance;
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::response::ResponseLookup;
use quadpixel::units::um_from_nm;
use quadpixel_datasets::{Effect, Effects, EstimatedError, Reason};

/// λF/pitch, and the error of a texture in focus: the largest of the study's pixels of about this spot
/// (`benches/runs/2026-11-22/coherent.md`).
const ERRORS: [(f64, f64); 4] = [(0.26, 1.0), (0.6, 1.0), (1.2, 1.0), (2.8, 1.0)];

/// Enters the effect, which is never simulated. `image`: on any scale.
pub(super) fn enter(
    camera: &Camera,
    image: &SubPixelImage,
    tolerance: &Tolerance,
    ledger: &mut Effects,
) {
    let effect = Effect::LensPixelCoherence;
    if matches!(camera.response(), ResponseLookup::Geometric(_)) {
        return ledger.leave_out(effect, Reason::GeometricResponse);
    }
    let reason = Reason::SumWithoutPhases;
    let Some(lens) = camera.paraxial() else {
        return ledger.leave_out(effect, Reason::NoAperture);
    };
    let wavelength_um = um_from_nm(camera.wavelengths().reference_nm());
    let spot_px = wavelength_um * lens.f_number / camera.sensor().pitch_um();
    let percent = 100.0 * error_of_texture(spot_px) * fine_contrast(image);
    if !percent.is_finite() {
        return ledger.leave_out(effect, reason);
    }
    let reason = match percent < tolerance.signal_percent {
        true => Reason::BelowTolerance {
            signal_percent: tolerance.signal_percent,
            shift_px: tolerance.shift_px,
        },
        false => reason,
    };
    ledger.leave_out_at(effect, reason, vec![EstimatedError::SignalPercent(percent)]);
}

/// Between the study's spots linear in the logarithm; beyond them as of the nearest.
fn error_of_texture(spot_px: f64) -> f64 {
    let (first, last) = (ERRORS[0], ERRORS[ERRORS.len() - 1]);
    let between = ERRORS
        .windows(2)
        .find(|w| (w[0].0..w[1].0).contains(&spot_px));
    match between {
        Some([(a, at_a), (b, at_b)]) => {
            let t = (spot_px / a).ln() / (b / a).ln();
            at_a + t * (at_b - at_a)
        }
        _ if spot_px < first.0 => first.1,
        _ => last.1,
    }
}

/// RMS of what changes from pixel to pixel, over the mean: of differences of neighbours in a row and in a column of each
/// view, a half of whose square is theirs.
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
    fn errors_between_the_study_s_spots_lie_between_theirs() {
        for (spot, error) in ERRORS {
            assert!((error_of_texture(spot) - error).abs() < 1e-12);
        }
        for w in ERRORS.windows(2) {
            let middle = error_of_texture((w[0].0 * w[1].0).sqrt());
            assert!((middle - 0.5 * (w[0].1 + w[1].1)).abs() < 1e-12);
        }
        assert_eq!(error_of_texture(0.01), ERRORS[0].1);
    }
}
