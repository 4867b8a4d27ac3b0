//! Sharpness of one channel of a picture, with every choice explicit.
//!
//! **De** (K. De and V. Masilamani, Procedia Eng. 64, 149 (2013)): F = FFT2(I), no window, mean kept;
//!
//! ```text
//! De = #{|F| > max|F| / 1000} / (M N)
//! ```
//!
//! max|F| is as a rule that of the mean, so De does not see a gain but does see an offset, and falls with the size:
//! compare equal crops only. It is a count; codes may differ by a few where |F| lies on the threshold.
//!
//! **Wee** (C.-Y. Wee and R. Paramesran, ICSP 2008, 840): with f = scale · I, M rows and N columns,
//!
//! ```text
//! E = Σf² or √Σf²,   g = f/E − mean(f/E),   S = g gᵀ/(N − 1),   Wee = Σ of the k largest λ(S) or λ(S)²
//! ```
//!
//! The paper's pictures are square; of others N may also be taken for the rows ([`Samples`]).
//! λ = σ²/(N − 1) from the singular values σ of g; S is never formed, which would halve the digits. Over all k the
//! plain sum is the trace, Σ(f − mean)²/(E² (N − 1)).
//!
//! **Gradient**: mean of √(Gx² + Gy²) of scale · I, by one of the [`GradientKernel`]s.
//!
//! I is f64 throughout: the input is f32, but σ spans many decades.

mod error;
mod settings;

pub use error::SharpnessError;
pub use settings::{Eigenvalues, Energy, GradientKernel, Mean, Samples, SharpnessSettings};

use faer::Mat;
use quadpixel::image::Image;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// The three measures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sharpness {
    /// De's fraction of strong frequencies, 0 to 1; 0 for an image of zeros, and 1/(M N) for any other constant.
    pub de: f64,
    /// The count behind it.
    pub de_count: usize,
    /// Wee's sum; 0 for a constant image, and where N is 1.
    pub wee: f64,
    /// Mean gradient magnitude, in units of the scaled image a pixel; 0 for a constant image, and for Sobel on fewer
    /// than 3 rows or columns.
    pub gradient: f64,
}

/// One channel of a picture: row-major, finite, not empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    data: Vec<f64>,
}

impl Plane {
    /// Wraps values; `data.len()` must be `width` × `height` and above 0.
    ///
    /// # Errors
    /// No pixel, values that are not as many as pixels, or one that is not finite.
    pub fn new(width: usize, height: usize, data: Vec<f64>) -> Result<Self, SharpnessError> {
        if data.is_empty() || data.len() != width * height {
            return Err(SharpnessError::Empty);
        }
        match data.iter().position(|v| !v.is_finite()) {
            None => Ok(Self {
                width,
                height,
                data,
            }),
            Some(i) => Err(SharpnessError::NotFinite {
                x: i % width,
                y: i / width,
                value: data[i],
            }),
        }
    }

    /// One channel of an image.
    ///
    /// # Errors
    /// No such channel, no pixel, or a value that is not finite.
    pub fn from_image(image: &Image, channel: usize) -> Result<Self, SharpnessError> {
        let channels = image.channels();
        if channel >= channels {
            return Err(SharpnessError::Channel { channel, channels });
        }
        let values = image.data().iter().skip(channel).step_by(channels);
        Self::new(
            image.width(),
            image.height(),
            values.map(|v| f64::from(*v)).collect(),
        )
    }
}

/// All three measures of a plane.
///
/// # Errors
/// Settings without meaning, or a picture of which a measure is not defined.
pub fn sharpness(plane: &Plane, settings: &SharpnessSettings) -> Result<Sharpness, SharpnessError> {
    for (field, value) in [
        ("wee_scale", settings.wee_scale),
        ("gradient_scale", settings.gradient_scale),
        ("wee_k", settings.wee_k.map_or(1.0, |k| k as f64)),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(SharpnessError::Setting { field, value });
        }
    }
    let de_count = strong_frequencies(plane);
    Ok(Sharpness {
        de: de_count as f64 / plane.data.len() as f64,
        de_count,
        wee: wee(plane, settings)?,
        gradient: settings.gradient_scale * gradient(plane, settings.gradient_kernel),
    })
}

/// De's count.
fn strong_frequencies(plane: &Plane) -> usize {
    let (width, height) = (plane.width, plane.height);
    let mut planner = FftPlanner::new();
    let mut rows: Vec<Complex<f64>> = plane.data.iter().map(|v| Complex::from(*v)).collect();
    planner.plan_fft_forward(width).process(&mut rows);
    let mut columns: Vec<Complex<f64>> = (0..width)
        .flat_map(|x| (0..height).map(move |y| y * width + x))
        .map(|i| rows[i])
        .collect();
    planner.plan_fft_forward(height).process(&mut columns);
    let strengths: Vec<f64> = columns.iter().map(|c| c.norm()).collect();
    let threshold = strengths.iter().fold(0.0, |a: f64, b| a.max(*b)) / 1000.0;
    strengths.iter().filter(|s| **s > threshold).count()
}

fn wee(plane: &Plane, settings: &SharpnessSettings) -> Result<f64, SharpnessError> {
    let (width, height) = (plane.width, plane.height);
    // The largest value is taken out, so that no square overflows or vanishes.
    let largest = plane.data.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let samples = match settings.wee_samples {
        Samples::Columns => width,
        Samples::Rows => height,
    };
    if largest == 0.0 || samples < 2 {
        return Ok(0.0);
    }
    let unit: Vec<f64> = plane.data.iter().map(|v| v / largest).collect();
    let scale = largest * settings.wee_scale;
    let squares: f64 = unit.iter().map(|v| v * v).sum();
    let factor = match settings.wee_energy {
        Energy::SumOfSquares => 1.0 / (scale * squares),
        Energy::Root => 1.0 / squares.sqrt(),
    };
    let means: Vec<f64> = match settings.wee_mean {
        Mean::Image => vec![unit.iter().sum::<f64>() / unit.len() as f64; width],
        Mean::Column => (0..width)
            .map(|x| unit.iter().skip(x).step_by(width).sum::<f64>() / height as f64)
            .collect(),
    };
    let centred = Mat::from_fn(height, width, |y, x| unit[y * width + x] - means[x]);
    let values = centred
        .singular_values()
        .map_err(|_| SharpnessError::Singular)?;
    let eigenvalues = values
        .iter()
        .take(settings.wee_k.unwrap_or(usize::MAX))
        .map(|s| (s * factor) * (s * factor) / (samples as f64 - 1.0));
    Ok(match settings.wee_eigenvalues {
        Eigenvalues::Plain => eigenvalues.sum(),
        Eigenvalues::Squared => eigenvalues.map(|l| l * l).sum(),
    })
}

/// Mean gradient magnitude of the plane as it is.
fn gradient(plane: &Plane, kernel: GradientKernel) -> f64 {
    match kernel {
        GradientKernel::Sobel => sobel(plane),
        GradientKernel::Central => central(plane),
    }
}

fn sobel(plane: &Plane) -> f64 {
    let (width, height) = (plane.width, plane.height);
    if width < 3 || height < 3 {
        return 0.0;
    }
    let at = |x: usize, y: usize| plane.data[y * width + x];
    let mut sum = 0.0;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let across = |y| at(x + 1, y) - at(x - 1, y);
            let along = |x| at(x, y + 1) - at(x, y - 1);
            let gx = across(y - 1) + 2.0 * across(y) + across(y + 1);
            let gy = along(x - 1) + 2.0 * along(x) + along(x + 1);
            sum += gx.hypot(gy);
        }
    }
    sum / ((width - 2) * (height - 2)) as f64
}

fn central(plane: &Plane) -> f64 {
    let (width, height) = (plane.width, plane.height);
    let at = |x: usize, y: usize| plane.data[y * width + x];
    let slope = |difference: f64, steps: usize| difference / steps.max(1) as f64;
    let mut sum = 0.0;
    for y in 0..height {
        let (up, down) = (y.saturating_sub(1), (y + 1).min(height - 1));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let gx = slope(at(right, y) - at(left, y), right - left);
            let gy = slope(at(x, down) - at(x, up), down - up);
            sum += gx.hypot(gy);
        }
    }
    sum / plane.data.len() as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
