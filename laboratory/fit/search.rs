//! Where a search begins. The sum of squares has valleys of two kinds:
//!
//! - Of the lens: an edge of a disk farther from the measured one than it is wide does not feel it. So kernels that are
//!   blurred come first, on both sides alike, with the layers at their prior; then as they are.
//! - Of the layers: light that is thrown to and fro in them is in phase again at thicknesses λ/2n apart, in the
//!   microlens's radius as in the spacer. So all other parameters are fitted at a grid of both, from that lens, and all
//!   of them from the best of these.

use super::Residuals;
use super::error::FitError;
use super::least_squares::{Start, minimise};
use super::measurements::{centroid_px, sum_of};
use super::parameters::{LAYERS, Name, Parameter};

/// Blurs of kernels, one after the other, RMS radii of the measured ones, and steps at most from each.
const BLURS: [f64; 4] = [1.0, 0.5, 0.25, 0.0];
const LENS_STEPS: usize = 12;
/// Starts per thickness after which light in the spacer is in phase again, how far they go from the prior, in its
/// deviations.
const STARTS_PER_FRINGE: f64 = 2.0;
const STARTS_SIGMA: f64 = 1.3;
/// Steps of all but the layers from each start; starts that radius and spacer are fitted from, too, to a part of the
/// fields, and steps; those that all is fitted from to all fields, and steps.
const FIRST_STEPS: usize = 3;
const SECOND: (usize, usize) = (10, 5);
const THIRD: (usize, usize) = (3, 8);

/// Layers that starts do not differ in.
const OTHER_LAYERS: [Name; 4] = [
    Name::SiliconUm,
    Name::LensIndex,
    Name::IsolationSplitUm,
    Name::IsolationBorderUm,
];

/// Values, and the places of the kernels.
pub type Point = (Vec<f64>, Vec<[f64; 2]>);

/// Where the search of all parameters begins.
///
/// # Errors
/// Those of the model, or a watcher that stops it.
pub fn beginning(
    residuals: &Residuals<'_>,
    parameters: &[Parameter],
    watch: &dyn Fn(usize, f64) -> bool,
) -> Result<Point, FitError> {
    let few = residuals.few();
    let held = holding(parameters, &LAYERS);
    let thicknesses = holding(parameters, &OTHER_LAYERS);
    let (lens, places) = lens(&few, &held, watch)?;
    let mut found = Vec::new();
    for radius in residuals.starts(&parameters[Name::RadiusUm as usize]) {
        for spacer in residuals.starts(&parameters[Name::SpacerUm as usize]) {
            let mut values = lens.clone();
            values[Name::RadiusUm as usize] = radius;
            values[Name::SpacerUm as usize] = spacer;
            let start = Start {
                parameters: &held,
                values: &values,
                places: &places,
                steps: FIRST_STEPS,
            };
            let there = minimise(&few, &start, watch)?;
            found.push((there.sum, there.values));
        }
    }
    let rounds = [
        (&few, &thicknesses[..], SECOND),
        (residuals, parameters, THIRD),
    ];
    for (residuals, parameters, (count, steps)) in rounds {
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(count);
        for (sum, values) in &mut found {
            let places = residuals.places(values)?;
            let start = Start {
                parameters,
                values,
                places: &places,
                steps,
            };
            let there = minimise(residuals, &start, watch)?;
            (*sum, *values) = (there.sum, there.values);
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let none = || FitError::TooLittle("no start of the fit was tried".into());
    let (_, values) = found.into_iter().next().ok_or_else(none)?;
    let places = residuals.places(&values)?;
    Ok((values, places))
}

/// The same with these held.
fn holding(parameters: &[Parameter], names: &[Name]) -> Vec<Parameter> {
    let mut held = parameters.to_vec();
    for name in names {
        held[*name as usize].sigma = 0.0;
    }
    held
}

/// All that is not a layer, from blurred kernels and then from those that were measured.
fn lens(
    sharp: &Residuals<'_>,
    held: &[Parameter],
    watch: &dyn Fn(usize, f64) -> bool,
) -> Result<Point, FitError> {
    let mut values: Vec<f64> = held.iter().map(|p| p.prior).collect();
    let radius_px = sharp.rms_radius_px();
    let mut places = sharp.places(&values)?;
    for blur in BLURS {
        let blur_px = blur * radius_px;
        let measured = sharp.measured.blurred(blur_px);
        let residuals = &Residuals {
            measured: &measured,
            fields: sharp.fields.clone(),
            blur_px,
            ..*sharp
        };
        let start = Start {
            parameters: held,
            values: &values,
            places: &places,
            steps: LENS_STEPS,
        };
        let there = minimise(residuals, &start, watch)?;
        (values, places) = (there.values, there.places);
    }
    Ok((values, places))
}

impl Residuals<'_> {
    /// The same of a third of the fields.
    fn few(&self) -> Self {
        Self {
            fields: self.fields.iter().copied().step_by(3).collect(),
            ..*self
        }
    }

    /// Where the kernels of the fields lie, as far as centroids tell.
    fn places(&self, values: &[f64]) -> Result<Vec<[f64; 2]>, FitError> {
        let all = self.model.at(values)?.places_px(self.measured);
        Ok(self.fields.iter().map(|&i| all[i]).collect())
    }

    /// Values of a thickness about its prior, within its bounds: the prior alone where it is held.
    fn starts(&self, parameter: &Parameter) -> Vec<f64> {
        let apart = self.model.fringe_um() / STARTS_PER_FRINGE;
        let most = (STARTS_SIGMA * parameter.sigma / apart).floor() as i64;
        let value = |k: i64| parameter.prior + k as f64 * apart;
        let [low, high] = parameter.bounds;
        (-most..=most)
            .map(value)
            .filter(|v| (low..=high).contains(v))
            .collect()
    }

    /// Of the kernels about their centroids, the median of the fields.
    fn rms_radius_px(&self) -> f64 {
        let side = self.measured.side;
        let of_field = |&i: &usize| {
            let field = &self.measured.fields[i];
            let sum = sum_of(&field.views, field.left_part);
            let [x, y] = centroid_px(&sum, side);
            let middle = (side as f64 - 1.0) * 0.5;
            let square = |(i, k): (usize, &f64)| {
                let (dx, dy) = (
                    (i % side) as f64 - middle - x,
                    (i / side) as f64 - middle - y,
                );
                k * (dx * dx + dy * dy)
            };
            // Noise far from the disk may make it negative.
            sum.iter()
                .enumerate()
                .map(square)
                .sum::<f64>()
                .max(0.0)
                .sqrt()
        };
        let mut radii: Vec<f64> = self.fields.iter().map(of_field).collect();
        radii.sort_by(f64::total_cmp);
        radii.get(radii.len() / 2).copied().unwrap_or(0.0)
    }
}
