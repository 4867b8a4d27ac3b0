//! Where a search begins. The sum of squares has valleys of three kinds:
//!
//! - Of the lens: an edge of a disk farther from the measured one than it is wide does not feel it. So kernels that are
//!   blurred come first, on both sides alike, with the layers at their prior; then as they are.
//! - Of the microlenses: a pitch farther they do the same again. So the middle of the picture comes first, and the law
//!   of their shift is followed outwards.
//! - Of the layers: light that is thrown to and fro in them is in phase again at thicknesses λ/2n apart, in the
//!   microlens's radius as in the spacer. So all other parameters are fitted at a grid of both, from that lens, and all
//!   of them from the best of these.

use super::Residuals;
use super::error::FitError;
use super::least_squares::{Start, minimise};
use super::measurements::{centroid_px, sum_of};
use super::parameters::{LAYERS, Name, Parameter};

/// Blurs of kernels, one after the other, RMS radii of the measured ones; to what part of the picture's half width
/// fields and sheet are looked at under each; steps at most.
const STAGES: [(f64, f64); 5] = [(1.0, 0.35), (1.0, 0.6), (0.5, 0.8), (0.25, 1.0), (0.0, 1.0)];
const LENS_STEPS: usize = 12;
/// Fields that tell where all of them will lead.
const FEW: usize = 8;
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
    let few = Residuals {
        fields: few(residuals.fields.clone()),
        ..*residuals
    };
    let held = holding(parameters, &LAYERS);
    let thicknesses = holding(parameters, &OTHER_LAYERS);
    let lens = lens(residuals, &held, watch)?;
    let places = few.places(&lens)?;
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
    all: &Residuals<'_>,
    held: &[Parameter],
    watch: &dyn Fn(usize, f64) -> bool,
) -> Result<Vec<f64>, FitError> {
    let mut values: Vec<f64> = held.iter().map(|p| p.prior).collect();
    let radius_px = all.rms_radius_px();
    let half_width_mm = all.half_width_mm();
    let stages = match all.fields.is_empty() {
        true => &STAGES[STAGES.len() - 1..],
        false => &STAGES[..],
    };
    for &(blur, part) in stages {
        let blur_px = blur * radius_px;
        let measured = all.measured.blurred(blur_px);
        let reach_mm = part * half_width_mm;
        let residuals = Residuals {
            measured: &measured,
            fields: few(all.within(reach_mm)),
            blur_px,
            reach_mm,
            ..*all
        };
        let places = residuals.places(&values)?;
        let start = Start {
            parameters: held,
            values: &values,
            places: &places,
            steps: LENS_STEPS,
        };
        values = minimise(&residuals, &start, watch)?.values;
    }
    Ok(values)
}

/// Some of these fields, evenly.
fn few(fields: Vec<usize>) -> Vec<usize> {
    let step = (fields.len() / FEW).max(1);
    fields.into_iter().step_by(step).collect()
}

impl Residuals<'_> {
    /// Half the width of what is looked at, mm.
    fn half_width_mm(&self) -> f64 {
        let fields = self
            .fields
            .iter()
            .map(|&i| self.measured.fields[i].place_mm[0]);
        let sheet = self.measured.sheet.iter().filter(|c| !c.held_out);
        fields
            .chain(sheet.map(|c| c.x_mm))
            .fold(0.0, |most, x| most.max(x.abs()))
    }

    /// Fields this near to the middle; at least [`FEW`] in any case, if there are so many.
    fn within(&self, reach_mm: f64) -> Vec<usize> {
        let far_mm = |i: &usize| {
            let [x, y] = self.measured.fields[*i].place_mm;
            x.abs().max(y.abs())
        };
        let mut by_distance = self.fields.clone();
        by_distance.sort_by(|a, b| far_mm(a).total_cmp(&far_mm(b)));
        let count = by_distance
            .iter()
            .take_while(|i| far_mm(i) <= reach_mm)
            .count();
        by_distance.truncate(count.max(FEW));
        by_distance.sort_unstable();
        by_distance
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
