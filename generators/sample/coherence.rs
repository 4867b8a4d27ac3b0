//! What the phases of the lens's cone would change within a pixel, by `qpgen study coherent`.
//!
//! The model adds the plane waves of a cone without their phases: right on the mean over places in the pixel, and so of
//! an even wall, wrong of what is finer. The study gives the RMS error of a half's signal in parts of the RMS of the
//! signal about its mean, for a texture of points; here it is taken of the part of the picture that changes from pixel
//! to pixel. It also tells how far the view of a half is from where the model has it.

use quadpixel::image::Image;
use quadpixel::render::Camera;
use quadpixel::response::ResponseLookup;
use quadpixel::sensor::Subpixels;
use quadpixel_datasets::{Effect, Effects, EstimatedError, Reason};

/// Pitch, µm; the largest error of a texture, in focus and with blurs of up to 4 px; the largest shift of a half's
/// view, px: F/1.7 to F/8 (`benches/runs/2026-11-22/coherent.md`).
const ERRORS: [(f64, f64, f64); 3] = [(1.6, 0.15, 0.12), (2.8, 0.38, 0.16), (3.5, 0.49, 0.19)];
/// What these stand for.
const PITCHES_UM: std::ops::RangeInclusive<f64> = 1.4..=3.7;
const F_NUMBERS: std::ops::RangeInclusive<f64> = 1.7..=8.0;

/// Sums side by side.
const LANES: usize = 8;

/// Enters the effect, which is never simulated.
pub(super) fn enter(camera: &Camera, contrast: &FineContrast, ledger: &mut Effects) {
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
            EstimatedError::SignalPercent(100.0 * texture * contrast.rms()),
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

/// What changes from pixel to pixel, summed up while the rows of a mosaic come.
#[derive(Clone, Debug)]
pub(super) struct FineContrast {
    subpixels: Subpixels,
    /// The last row of pixels, as many rows of the mosaic.
    above: Option<Image>,
    squares: f64,
    differences: u64,
    light: f64,
    values: u64,
}

impl FineContrast {
    pub fn new(subpixels: Subpixels) -> Self {
        Self {
            subpixels,
            above: None,
            squares: 0.0,
            differences: 0,
            light: 0.0,
            values: 0,
        }
    }

    /// Goes on with the mosaic of some rows of pixels, on any scale.
    pub fn add(&mut self, mosaic: &Image) {
        let [m, n] = [self.subpixels.m(), self.subpixels.n()];
        let last = mosaic.height().saturating_sub(n);
        let above = self.above.take();
        let row = mosaic.width() * mosaic.channels();
        for y in 0..mosaic.height() {
            let here = &mosaic.data()[y * row..][..row];
            self.light += sum(here, here, |light, _| f64::from(light));
            let right = here.get(m * mosaic.channels()..).unwrap_or_default();
            let before = match y.checked_sub(n) {
                Some(before) => Some(&mosaic.data()[before * row..][..row]),
                None => above.as_ref().map(|above| &above.data()[y * row..][..row]),
            };
            for other in [Some(right), before].into_iter().flatten() {
                self.squares += sum(other, here, |a, b| 0.5 * f64::from(a - b).powi(2));
                self.differences += other.len() as u64;
            }
        }
        self.values += mosaic.data().len() as u64;
        let kept = mosaic.data()[last * row..].to_vec();
        self.above = Image::from_vec(mosaic.width(), n, mosaic.channels(), kept);
    }

    /// RMS of the changes, over the mean: of differences of neighbours in a row and in a column of each view, a half of
    /// whose square is theirs.
    pub fn rms(&self) -> f64 {
        let mean = self.light / self.values as f64;
        match self.differences > 0 && mean > 0.0 {
            true => (self.squares / self.differences as f64).sqrt() / mean,
            false => 0.0,
        }
    }
}

/// Σ of a function of pairs of values, in lanes.
fn sum(a: &[f32], b: &[f32], of: impl Fn(f32, f32) -> f64) -> f64 {
    let length = a.len().min(b.len());
    let (a, a_rest) = a[..length].as_chunks::<LANES>();
    let (b, b_rest) = b[..length].as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        (0..LANES).for_each(|i| sums[i] += of(a[i], b[i]));
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| of(*a, *b));
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// By the rows of a mosaic of 16 × 16 values, so many at once.
    fn of_rows(value: impl Fn(usize, usize) -> f32, at_once: usize) -> f64 {
        let mut contrast = FineContrast::new(Subpixels::new(2, 2).unwrap());
        for first in (0..16).step_by(at_once) {
            let mut mosaic = Image::zeros(16, at_once, 3);
            for y in 0..at_once {
                for x in 0..16 {
                    mosaic.pixel_mut(x, y).fill(value(x, first + y));
                }
            }
            contrast.add(&mosaic);
        }
        contrast.rms()
    }

    fn of(value: impl Fn(usize, usize) -> f32) -> f64 {
        let whole = of_rows(&value, 16);
        assert_eq!(of_rows(&value, 2), whole);
        assert_eq!(of_rows(&value, 4), whole);
        whole
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
