//! The fit held to cameras that are known: drawn at random, captured with noise by the same model, and fitted blind.

use quadpixel::sampling::uniform;
use quadpixel_generators::observer::Observer;
use rayon::prelude::*;
use serde::Serialize;

use super::camera_model::CameraModel;
use super::error::FitError;
use super::fit;
use super::measurements::{FieldKernels, Measurements, SheetColumn};
use super::noise::Noise;
use super::parameters::Parameter;
use super::prediction::{FieldPrediction, Prediction};

/// What is drawn.
#[derive(Clone, Debug)]
pub struct TruthSettings {
    /// Seed of the draw.
    pub seed: u64,
    /// Fields, columns × rows.
    pub grid: [usize; 2],
    /// Side of a field, mm on the sensor.
    pub field_mm: f64,
    /// Half the width of the sheet, mm.
    pub sheet_half_mm: f64,
    /// Columns of the sheet.
    pub sheet_columns: usize,
    /// Noise of the captures.
    pub noise: Noise,
}

/// What a blind fit found of one drawn camera.
#[derive(Clone, Debug, Serialize)]
pub struct TruthResult {
    /// Seed of the draw.
    pub seed: u64,
    /// Per parameter that is not held: name, drawn, fitted, stated σ.
    pub parameters: Vec<(String, f64, f64, f64)>,
    /// Largest |fitted − drawn| in stated σ.
    pub worst_sigmas: f64,
    /// RMS over held-out fields of the error of shift over disk, over the RMS of shift over disk, against the drawn
    /// camera without noise.
    pub shift_error: f64,
    /// Mean over held-out fields of the RMS difference of the kernels over their RMS, against the same.
    pub kernel_error: f64,
    /// Largest relative error of the sheet's held-out half.
    pub sheet_error: f64,
}

/// A standard normal number by the central part of its distribution: of a sum of twelve uniform ones.
fn normal(seed: u64, words: &[u64]) -> f64 {
    let mut all = words.to_vec();
    all.push(0);
    (0..12)
        .map(|k| {
            if let Some(last) = all.last_mut() {
                *last = k;
            }
            uniform(seed, &all)
        })
        .sum::<f64>()
        - 6.0
}

/// Values between −1 and +1 prior deviations about the priors, within the bounds.
pub fn drawn(parameters: &[Parameter], seed: u64) -> Vec<f64> {
    let value = |(i, p): (usize, &Parameter)| {
        let z = 2.0 * uniform(seed, &[1, i as u64]) - 1.0;
        (p.prior + z * p.sigma).clamp(p.bounds[0], p.bounds[1])
    };
    parameters.iter().enumerate().map(value).collect()
}

/// Captures of a camera of these values; `seed` is that of their noise, `None` of captures without.
///
/// # Errors
/// Values that no camera has.
pub fn simulated(
    model: &CameraModel,
    values: &[f64],
    settings: &TruthSettings,
    view_pixel_um: f64,
    seed: Option<u64>,
) -> Result<Measurements, FitError> {
    let set = model.at(values)?;
    let [columns, rows] = settings.grid;
    let field = |i: usize| {
        let from_middle =
            |k: usize, n: usize| (k as f64 + 0.5 - 0.5 * n as f64) * settings.field_mm;
        let place_mm = [
            from_middle(i % columns, columns),
            from_middle(i / columns, rows),
        ];
        // Where a kernel lies in its window is not known to a pixel.
        let place_px = [0, 1].map(|k| 2.0 * uniform(settings.seed, &[2, i as u64, k]) - 1.0);
        let mut views = set.kernels(place_mm, place_px);
        for (k, view) in views.iter_mut().enumerate() {
            let mean_square = view.iter().map(|v| v * v).sum::<f64>() / view.len() as f64;
            let sigma = settings.noise.kernel * mean_square.sqrt();
            if let Some(seed) = seed {
                for (j, v) in view.iter_mut().enumerate() {
                    *v += sigma * normal(seed, &[3, i as u64, k as u64, j as u64]);
                }
                let sum: f64 = view.iter().sum();
                view.iter_mut().for_each(|v| *v /= sum);
            }
        }
        FieldKernels {
            place_mm,
            held_out: false,
            left_part: set.left_part(place_mm[0]),
            views,
        }
    };
    let count = settings.sheet_columns;
    let column = |k: usize| {
        let x_mm = settings.sheet_half_mm * (2.0 * (k as f64 + 0.5) / count as f64 - 1.0);
        let noise = seed.map_or(0.0, |s| normal(s, &[4, k as u64]));
        SheetColumn {
            x_mm,
            ratio: set.sheet_ratio(x_mm) * (settings.noise.sheet * noise).exp(),
            held_out: false,
        }
    };
    let mut measured = Measurements {
        view_pixel_um,
        side: model.side(),
        grid: settings.grid,
        fields: (0..columns * rows).into_par_iter().map(field).collect(),
        sheet: (0..count).map(column).collect(),
        planes: Vec::new(),
    };
    measured.hold_out_chessboard();
    Ok(measured)
}

/// Draws a camera, captures it, fits it blind, and holds the fit to what was drawn.
///
/// # Errors
/// Those of the fit.
pub fn trial(
    model: &CameraModel,
    parameters: &[Parameter],
    settings: &TruthSettings,
    view_pixel_um: f64,
    observer: &dyn Observer,
) -> Result<TruthResult, FitError> {
    let truth = drawn(parameters, settings.seed);
    let noisy = simulated(model, &truth, settings, view_pixel_um, Some(settings.seed))?;
    let fitted = fit(model, &noisy, parameters, Some(settings.noise), observer)?;
    let clean = simulated(model, &truth, settings, view_pixel_um, None)?;
    let predicted = Prediction::new(model, &fitted.values, &clean)?;
    let sigmas = fitted.sigmas();
    let free = (0..parameters.len()).filter(|&i| parameters[i].sigma > 0.0);
    let rows: Vec<_> = free
        .map(|i| {
            (
                parameters[i].name.clone(),
                truth[i],
                fitted.values[i],
                sigmas[i],
            )
        })
        .collect();
    let fields: Vec<_> = predicted.fields.iter().filter(|f| f.held_out).collect();
    let count = fields.len().max(1) as f64;
    let square_sum = |value: &dyn Fn(&FieldPrediction) -> f64| -> f64 {
        fields.iter().map(|f| value(f).powi(2)).sum()
    };
    // Over all fields' shift: a drawn camera may have fields where the views do not part, of which no part can be told.
    let off = square_sum(&|f| f.predicted.shift_over_disk - f.measured.shift_over_disk);
    let all = square_sum(&|f| f.measured.shift_over_disk);
    let sheet = predicted.sheet.iter().filter(|c| c.held_out);
    Ok(TruthResult {
        seed: settings.seed,
        worst_sigmas: rows
            .iter()
            .map(|r| (r.2 - r.1).abs() / r.3)
            .fold(0.0, f64::max),
        parameters: rows,
        shift_error: (off / all).sqrt(),
        kernel_error: fields.iter().map(|f| f.kernel_rms).sum::<f64>() / count,
        sheet_error: sheet
            .map(|c| (c.predicted / c.measured - 1.0).abs())
            .fold(0.0, f64::max),
    })
}
