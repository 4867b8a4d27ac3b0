//! From the shift that aligns two pictures best to the shift of their spots' centroids.
//!
//! A view is the chart convolved with its spot h_i, the reference with h. Matching finds where both correlate best,
//! which for spots of different skew depends on the chart: ∫ S(f) h*(f) h_i(f) exp(2πi f·d) df, S the chart's power, is
//! largest at the shift of the centroids only as f → 0. What depth needs is the shift of the centroids. The spots'
//! ratio has the phase and modulus of a series in the frequency whose first terms are that shift, the difference of
//! widths and that of skews, so
//!
//! ```text
//! b(x) = o + Σ_{k ≤ 5} c_k(x) : ∇ᵏ a(x)        d = −c₁/c₀
//! ```
//!
//! with a, b: reference and view, both smoothed by one Gaussian σ that makes the series short. All c are polynomials
//! over the picture, fitted together by least squares with Tukey's biweight: d and the gain c₀ of the wanted degree,
//! widths and skews (k = 2, 3) linear, k = 4, 5 constant. The view is looked up where the last d
//! points, so that d is a sum of small steps. (By its own series: Lanczos' kernel does not keep straight lines
//! straight, and moves what is smooth by up to 0.008 px.)
//!
//! σ costs noise and border (3σ and 3 px on each side are not used), but wide spots need it: where the series is too
//! short for them, what the fit leaves over falls as σ grows. [`Reference::for_views`] takes the smallest σ that leaves
//! about as little as any.

mod derivatives;
mod model;

use quadpixel::image::Image;

use crate::field::{FieldError, SmoothField};
use derivatives::{DERIVATIVES, Gaussian, REACH_PX, SMALLEST_SIGMA_PX, Smoothed};
use model::Model;

/// σ that are tried: each is this many times the one before, from the smallest for which differences are derivatives
const LADDER: f64 = std::f64::consts::SQRT_2;
/// to this share of the shorter side, so that three quarters of it remain inside the borders.
const LARGEST_SHARE: f64 = 1.0 / 24.0;
/// About as little: this many times the least.
const ENOUGH: f64 = 1.3;
/// Samples are taken this many σ apart: closer ones tell the same.
const SPACING: f64 = 1.0 / 1.5;
/// More samples than this make nothing better.
const MOST_SAMPLES: usize = 50_000;
/// Rounds of warping and fitting, and the step (RMS, px) at which they end.
const ROUNDS: usize = 6;
const LAST_STEP_PX: f64 = 5e-4;
/// The reference, ready for its views.
pub struct Reference {
    gaussian: Gaussian,
    sigma_px: f64,
    size: (usize, usize),
    mean: f64,
    /// Zero field of the wanted degree over the picture: the basis.
    basis: SmoothField,
    samples: Vec<Sample>,
}

struct Sample {
    at: [usize; 2],
    derivatives: [f64; DERIVATIVES],
    basis: Vec<f64>,
}

/// A view's field of centroids.
#[derive(Clone, Debug)]
pub struct CentroidFit {
    /// Shift of the view's centroid against the reference's, px.
    pub field: SmoothField,
    /// Root mean square of what the fit leaves over, as the shift (px per axis) that would make as much of a
    /// difference.
    pub rms_px: f64,
    /// Share of samples that the fit rejected, 0 to 1.
    pub rejected_share: f64,
}

impl Reference {
    /// Prepares single-channel `image` for fields of `degree` with the σ that its views ask for, given with the fields
    /// to start from.
    ///
    /// # Errors
    /// A degree out of range, or too few samples inside the borders for the fits.
    pub fn for_views(
        image: &Image,
        degree: usize,
        views: &[(&Image, &SmoothField)],
    ) -> Result<Self, FieldError> {
        let largest = image.width().min(image.height()) as f64 * LARGEST_SHARE;
        let mut tried: Vec<(Self, f64)> = Vec::new();
        let mut sigma_px = SMALLEST_SIGMA_PX;
        loop {
            let reference = Self::new(image, degree, sigma_px)?;
            match reference.left_over(views) {
                Ok(left) => tried.push((reference, left)),
                Err(error) if tried.is_empty() => return Err(error),
                // A wider one left too few samples.
                Err(_) => break,
            }
            sigma_px *= LADDER;
            if sigma_px > largest {
                break;
            }
        }
        let least = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
        let chosen = tried.into_iter().find(|t| t.1 <= ENOUGH * least);
        chosen.map(|t| t.0).ok_or(FieldError::Singular(degree))
    }

    /// Root mean square over `views` of what their fits leave over, px.
    fn left_over(&self, views: &[(&Image, &SmoothField)]) -> Result<f64, FieldError> {
        let mut squares = 0.0;
        for (view, start) in views {
            squares += self.fit(view, start)?.rms_px.powi(2);
        }
        Ok((squares / views.len().max(1) as f64).sqrt())
    }

    /// Prepares single-channel `image` for fields of `degree` with `sigma_px` (raised to 1.5 px).
    ///
    /// # Errors
    /// A degree out of range.
    pub fn new(image: &Image, degree: usize, sigma_px: f64) -> Result<Self, FieldError> {
        let size = (image.width(), image.height());
        let sigma_px = sigma_px.max(SMALLEST_SIGMA_PX);
        let gaussian = Gaussian::new(sigma_px);
        let margin = gaussian.radius_px() + REACH_PX;
        let inner = [size.0, size.1].map(|s| s.saturating_sub(2 * margin));
        let crowded = ((inner[0] * inner[1]) as f64 / MOST_SAMPLES as f64).sqrt();
        let stride = (SPACING * sigma_px).max(crowded).ceil() as usize;
        let half = [size.0, size.1].map(|s| 0.5 * (s.max(2) - 1) as f64);
        let zeros = [0, 1].map(|_| vec![0.0; SmoothField::terms(degree)]);
        let basis = SmoothField::from_parts(half, half, zeros).ok_or(FieldError::Degree(degree))?;
        let smoothed = Smoothed::new(values(image), image.width(), &gaussian);
        let columns = (margin..margin + inner[0]).step_by(stride);
        let samples = (margin..margin + inner[1])
            .step_by(stride)
            .flat_map(|y| columns.clone().map(move |x| [x, y]))
            .map(|at| Sample {
                at,
                derivatives: smoothed.derivatives(at),
                basis: basis.basis(at.map(|v| v as f64)),
            })
            .collect();
        Ok(Self {
            gaussian,
            sigma_px,
            size,
            mean: mean(image),
            basis,
            samples,
        })
    }

    /// σ of the smoothing, px.
    pub fn sigma_px(&self) -> f64 {
        self.sigma_px
    }

    /// The field of `view` (single-channel, of the reference's size), searched from `start`, right to about σ.
    ///
    /// # Errors
    /// Samples that are too few or do not fix the coefficients.
    pub fn fit(&self, view: &Image, start: &SmoothField) -> Result<CentroidFit, FieldError> {
        let degree = self.basis.degree();
        let mut field = start.clone();
        let model = Model::new(degree);
        let mut gains = vec![self.mean / mean(view); self.size.0 * self.size.1];
        let mut last = None;
        for _ in 0..ROUNDS {
            let used = self.observe(view, &field, &gains);
            let solution = model.solve(&used)?;
            let next = solution.field(&model, &self.basis, degree)?;
            for (i, gain) in gains.iter_mut().enumerate() {
                let at = [i % self.size.0, i / self.size.0].map(|v| v as f64);
                *gain /= solution.gain(&model, &self.basis.basis(at));
            }
            let squares: f64 = (used.iter())
                .map(|o| {
                    let at = o.sample.at.map(|v| v as f64);
                    let (a, b) = (next.at(at), o.shift);
                    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
                })
                .sum();
            let step = (squares / used.len() as f64).sqrt();
            field = next;
            last = Some(solution);
            if step < LAST_STEP_PX {
                break;
            }
        }
        let solution = last.ok_or(FieldError::Singular(degree))?;
        Ok(CentroidFit {
            field,
            rms_px: solution.rms_px,
            rejected_share: solution.rejected_share,
        })
    }

    /// The view, multiplied by `gains` and smoothed, at the samples moved by `field`, where it shows their
    /// surroundings. The gain must be evened out before: one with the slope g' would look like a shift by σ²g'/g after.
    fn observe(&self, view: &Image, field: &SmoothField, gains: &[f64]) -> Vec<Observed<'_>> {
        let values = view.data().iter().zip(gains);
        let values = values.map(|(v, gain)| f64::from(*v) * gain).collect();
        let smoothed = Smoothed::new(values, self.size.0, &self.gaussian);
        let margin = (self.gaussian.radius_px() + REACH_PX) as f64;
        let limits = [self.size.0, self.size.1].map(|s| s as f64 - 1.0 - margin);
        (self.samples.iter())
            .filter_map(|sample| {
                let at = sample.at.map(|v| v as f64);
                let shift = field.at(at);
                let moved = [0, 1].map(|i| at[i] + shift[i]);
                let shown = (0..2).all(|i| moved[i] >= margin && moved[i] <= limits[i]);
                shown.then(|| Observed {
                    sample,
                    value: smoothed.between(moved),
                    shift,
                })
            })
            .collect()
    }
}

/// What a view shows where a sample moved by `shift`, brought to the reference's brightness.
struct Observed<'a> {
    sample: &'a Sample,
    value: f64,
    shift: [f64; 2],
}

fn values(image: &Image) -> Vec<f64> {
    image.data().iter().map(|&v| f64::from(v)).collect()
}

fn mean(image: &Image) -> f64 {
    let sum: f64 = image.data().iter().map(|&v| f64::from(v)).sum();
    sum / image.data().len() as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
