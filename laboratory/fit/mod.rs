//! A camera fitted to what anybody can measure of it: kernels of both views over the field, a white sheet, the shifts
//! of textured planes at known distances.
//!
//! ```text
//! capture.toml ─ capture ─▶ Measurements ─┐
//! parameters with priors ─────────────────┴▶ search, fit ─▶ Fitted: values, σ, correlations ─▶ tables, camera file
//!                                             ▲
//!          lens_law, pixel_table ─▶ camera_model (wave level)          truth: cameras drawn, fitted blind
//! ```
//! Bounded least squares with Gaussian priors ([`least_squares`]). A parameter that the data do not hold stays at its
//! prior, and the result says so. The noise is that of the residuals, unless it is known; where they hang
//! together over the picture, as those of a wrong model or of smoothed kernels do, they count as fewer.

pub mod camera_file;
pub mod camera_model;
pub mod capture;
mod captured;
pub mod conjugates;
pub mod dots;
pub mod error;
pub mod figures;
pub mod goals;
pub mod keeping;
pub mod least_squares;
pub mod lens_law;
pub mod measurements;
pub mod noise;
pub mod parameters;
pub mod pictures;
pub mod pixel_table;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod plane_tests;
mod planes;
pub mod prediction;
mod search;
pub mod target;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
pub mod truth;

use quadpixel_generators::camera_file::FittedParameter;
use quadpixel_generators::observer::{Event, Observer};
use rayon::prelude::*;

use self::camera_model::CameraModel;
use self::error::FitError;
use self::least_squares::{Forward, STEPS, Start, covariance, dot, minimise};
use self::measurements::{Measurements, SheetColumn, blur};
use self::noise::Noise;
use self::parameters::{LAYERS, Parameter};
use self::search::beginning;

/// Part of a prior's σ above which the data are said not to hold a parameter.
const HELD: f64 = 0.7;

/// A fitted camera.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// As they were before.
    pub parameters: Vec<Parameter>,
    /// Of each parameter.
    pub values: Vec<f64>,
    /// Of the parameters, n × n.
    pub covariance: Vec<f64>,
    /// The noise that the weights came from.
    pub noise: Noise,
    /// Steps of the search.
    pub steps: usize,
}

impl Fitted {
    /// Standard deviation of each parameter.
    pub fn sigmas(&self) -> Vec<f64> {
        let n = self.values.len();
        (0..n)
            .map(|i| self.covariance[i * n + i].max(0.0).sqrt())
            .collect()
    }

    /// The parameters with what is known of them.
    pub fn table(&self) -> Vec<FittedParameter> {
        let rows = self.parameters.iter().zip(&self.values).zip(self.sigmas());
        rows.map(|((p, &value), sigma)| FittedParameter {
            name: p.name.clone(),
            value,
            sigma,
            prior: [p.prior, p.sigma],
            held_by_data: p.sigma > 0.0 && sigma < HELD * p.sigma,
            at_bound: value <= p.bounds[0] || value >= p.bounds[1],
        })
        .collect()
    }

    /// Pairs of parameters whose correlation is `least` or more in size, the strongest first.
    pub fn correlations(&self, least: f64) -> Vec<(String, String, f64)> {
        let (n, sigmas) = (self.values.len(), self.sigmas());
        let mut pairs = Vec::new();
        for i in 0..n {
            for j in 0..i {
                let r = self.covariance[i * n + j] / (sigmas[i] * sigmas[j]);
                if r.abs() >= least {
                    let name = |k: usize| self.parameters[k].name.clone();
                    pairs.push((name(j), name(i), r));
                }
            }
        }
        pairs.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        pairs
    }
}

/// Residuals of what is not held out.
struct Residuals<'a> {
    model: &'a CameraModel<'a>,
    measured: &'a Measurements,
    fields: Vec<usize>,
    noise: Noise,
    /// Blur of the measured kernels, px, that the model's get, too.
    blur_px: f64,
    /// Columns of the sheet farther from the middle are not looked at, mm.
    reach_mm: f64,
}

impl Forward for Residuals<'_> {
    fn residuals(&self, values: &[f64], places: &[[f64; 2]]) -> Result<Vec<Vec<f64>>, FitError> {
        let set = self.model.at(values)?;
        let of_field = |(&i, &place): (&usize, &[f64; 2])| {
            let field = &self.measured.fields[i];
            let model = set.kernels(field.place_mm, place).map(|mut kernel| {
                blur(&mut kernel, self.measured.side, self.blur_px);
                kernel
            });
            let mut residuals = Vec::with_capacity(2 * field.views[0].len());
            for (model, view) in model.iter().zip(&field.views) {
                let mean_square = view.iter().map(|v| v * v).sum::<f64>() / view.len() as f64;
                let scale = 1.0 / (self.noise.kernel * mean_square.sqrt());
                // The noise of the whole window is in the sum that the measured kernel was divided by.
                let [both, own] = [view, model].map(|by| dot(model, by));
                let part = both / own.max(f64::MIN_POSITIVE);
                residuals.extend(model.iter().zip(view).map(|(m, v)| scale * (part * m - v)));
            }
            residuals
        };
        let pairs: Vec<_> = self.fields.iter().zip(places).collect();
        let mut blocks: Vec<Vec<f64>> = pairs.into_par_iter().map(of_field).collect();
        let is_seen = |c: &&SheetColumn| !c.held_out && c.x_mm.abs() <= self.reach_mm;
        let columns: Vec<_> = self.measured.sheet.iter().filter(is_seen).collect();
        let sheet = columns.into_par_iter().map(|c| {
            let ratio = set.sheet_ratio(c.x_mm);
            (ratio / c.ratio).ln() / self.noise.sheet
        });
        blocks.push(sheet.collect());
        let planes = self.measured.planes.iter().filter(|p| !p.held_out);
        let shifts: Vec<_> = planes
            .flat_map(|plane| plane.blocks.iter().map(move |block| (plane, block)))
            .collect();
        let shifts = shifts.into_par_iter().map(|(plane, block)| {
            let shift_px = set.plane_shift_px(plane, block.place_mm);
            (shift_px - block.shift_px) / (self.noise.plane * block.sigma_px)
        });
        blocks.push(shifts.collect());
        Ok(blocks)
    }

    fn is_costly(&self, parameter: usize) -> bool {
        LAYERS.iter().any(|name| *name as usize == parameter)
    }
}

/// Fits a camera to what is not held out. With `noise` its size is known; else it is that of the residuals.
///
/// # Errors
/// Too little data, a pixel that cannot be, or an observer that stops it.
pub fn fit(
    model: &CameraModel,
    measured: &Measurements,
    parameters: &[Parameter],
    noise: Option<Noise>,
    observer: &dyn Observer,
) -> Result<Fitted, FitError> {
    measured.check()?;
    let is_fitted = |i: &usize| !measured.fields[*i].held_out;
    let mut residuals = Residuals {
        model,
        measured,
        fields: (0..measured.fields.len()).filter(is_fitted).collect(),
        noise: noise.unwrap_or(Noise::GUESS),
        blur_px: 0.0,
        reach_mm: f64::INFINITY,
    };
    let watch = |step: usize, sum: f64| {
        let text = format!("fit: step {step}, sum of squares {sum:.4e}");
        observer.event(Event::Info(&text));
        !observer.stop_asked()
    };
    let [directions, shifts] = model.table_size();
    observer.event(Event::Info(&format!(
        "fit: answers of the pixel to {directions} directions under {shifts} lens shifts, anew for every stack of layers \
         (a wide pixel: minutes)"
    )));
    let (mut values, mut places) = beginning(&residuals, parameters, &watch)?;
    // The weights of sheet, kernels and priors hang on the noise, which only a fit tells.
    let rounds = if noise.is_some() { 1 } else { 2 };
    let mut last = None;
    for round in 0..rounds {
        let start = Start {
            parameters,
            values: &values,
            places: &places,
            steps: STEPS,
        };
        let solution = minimise(&residuals, &start, &watch)?;
        (values, places) = (solution.values.clone(), solution.places.clone());
        if noise.is_none() && round + 1 < rounds {
            let columns = measured.grid[0].max(1);
            let places: Vec<[usize; 2]> = (residuals.fields.iter())
                .map(|i| [i % columns, i / columns])
                .collect();
            residuals.noise =
                (residuals.noise).from_residuals(&solution.residuals, measured.side, &places);
        }
        last = Some(solution);
    }
    let none = || FitError::TooLittle("no round of the fit was made".into());
    let solution = last.ok_or_else(none)?;
    Ok(Fitted {
        parameters: parameters.to_vec(),
        covariance: covariance(&residuals, parameters, &solution)?,
        values: solution.values,
        noise: residuals.noise,
        steps: solution.steps,
    })
}
