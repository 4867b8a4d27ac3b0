//! Least squares with bounds and Gaussian priors (Levenberg, Marquardt), and what is then known of the parameters.
//!
//! Minimised is `Σ r² + Σ ((p − prior)/σ_prior)²`, r the residuals in units of their noise. Every block of residuals
//! may have a place of its own (two parameters that no other block knows: where a kernel lies); they are eliminated
//! block by block: `A −= J_pᵀJ_o (J_oᵀJ_o)⁻¹ J_oᵀJ_p`. The covariance is A⁻¹ with the priors in it.

mod normal;

use faer::Side;
use faer::linalg::solvers::{DenseSolveCore, Solve};

use super::error::FitError;
use super::parameters::Parameter;

pub(super) use self::normal::dot;
use self::normal::{Columns, Normal};

/// Steps that every search comes to an end in, usually.
pub const STEPS: usize = 60;
/// Two steps that lower the sum by less than this are the last: a parameter one deviation off adds 1 to it. Along a
/// valley the steps are short, and a part of the sum, which is as large as the data are many, ends them too soon.
const ENOUGH: f64 = 0.05;
const SMALL_STEPS: usize = 2;
/// Steps that derivatives by costly parameters are kept for, unless a step fails; the last step has its own.
const KEPT_STEPS: usize = 4;

/// What gives residuals.
pub trait Forward: Sync {
    /// Residuals of all blocks; the first `places.len()` blocks lie at these places.
    ///
    /// # Errors
    /// Values that no camera has.
    fn residuals(&self, values: &[f64], places: &[[f64; 2]]) -> Result<Vec<Vec<f64>>, FitError>;

    /// Whether residuals at another value of this parameter take long.
    fn is_costly(&self, _parameter: usize) -> bool {
        false
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Of every parameter.
    pub values: Vec<f64>,
    /// Of every block with one.
    pub places: Vec<[f64; 2]>,
    /// At these values.
    pub residuals: Vec<Vec<f64>>,
    /// What was minimised, there.
    pub sum: f64,
    /// Steps taken.
    pub steps: usize,
}

/// Parameters, and where a search begins.
#[derive(Clone, Copy)]
pub struct Start<'a> {
    /// With priors and bounds.
    pub parameters: &'a [Parameter],
    /// One per parameter.
    pub values: &'a [f64],
    /// One per block with a place.
    pub places: &'a [[f64; 2]],
    /// Steps at most.
    pub steps: usize,
}

/// The least sum of squares from a start; `watch` hears of each step and the sum, and says whether to go on.
///
/// # Errors
/// Values that no camera has, no way down at all, or a watcher that stops it.
pub fn minimise(
    forward: &dyn Forward,
    start: &Start,
    watch: &dyn Fn(usize, f64) -> bool,
) -> Result<Solution, FitError> {
    let parameters = start.parameters;
    let free: Vec<usize> = (0..parameters.len())
        .filter(|&i| parameters[i].sigma > 0.0)
        .collect();
    let mut values = start.values.to_vec();
    let mut places = start.places.to_vec();
    let mut residuals = forward.residuals(&values, &places)?;
    let mut sum = cost(&residuals, parameters, &values);
    let mut damping = 1e-3;
    let (mut steps, mut small) = (0, 0);
    let mut columns = Columns::new(forward, parameters, &free);
    let mut normal = columns.normal_at((&values, &places, &residuals), true)?;
    while steps < start.steps {
        steps += 1;
        if !watch(steps, sum) {
            return Err(FitError::Stopped);
        }
        let mut better = None;
        let mut tries = 0;
        while tries < 8 && better.is_none() {
            tries += 1;
            let (next, next_places) = step(&normal, parameters, &free, (&values, &places, damping));
            let tried = forward.residuals(&next, &next_places)?;
            let tried_sum = cost(&tried, parameters, &next);
            if tried_sum < sum {
                better = Some((next, next_places, tried, tried_sum));
                damping *= 0.2;
            } else if columns.age > 0 {
                break;
            } else {
                damping *= 6.0;
            }
        }
        let Some((next, next_places, tried, tried_sum)) = better else {
            if columns.age == 0 {
                break;
            }
            normal = columns.normal_at((&values, &places, &residuals), true)?;
            continue;
        };
        let is_small = sum - tried_sum < ENOUGH;
        (values, places, residuals, sum) = (next, next_places, tried, tried_sum);
        if is_small && columns.age == 0 {
            small += 1;
            if small == SMALL_STEPS {
                break;
            }
        } else if !is_small {
            small = 0;
        }
        if steps < start.steps {
            let anew = is_small || tries > 1 || columns.age + 1 == KEPT_STEPS;
            normal = columns.normal_at((&values, &places, &residuals), anew)?;
        }
    }
    Ok(Solution {
        values,
        places,
        residuals,
        sum,
        steps,
    })
}

/// What is then known of the parameters: their covariance, n × n; 0 of those that are held.
///
/// # Errors
/// Values that no camera has.
pub fn covariance(
    forward: &dyn Forward,
    parameters: &[Parameter],
    solution: &Solution,
) -> Result<Vec<f64>, FitError> {
    let free: Vec<usize> = (0..parameters.len())
        .filter(|&i| parameters[i].sigma > 0.0)
        .collect();
    let at = (
        &solution.values[..],
        &solution.places[..],
        &solution.residuals[..],
    );
    let normal = Columns::new(forward, parameters, &free).normal_at(at, true)?;
    let count = parameters.len();
    let mut all = vec![0.0; count * count];
    if let Ok(factor) = normal.matrix.llt(Side::Lower) {
        let inverse = factor.inverse();
        for (a, &i) in free.iter().enumerate() {
            for (c, &j) in free.iter().enumerate() {
                all[i * count + j] = inverse[(a, c)];
            }
        }
    }
    Ok(all)
}

fn cost(residuals: &[Vec<f64>], parameters: &[Parameter], values: &[f64]) -> f64 {
    let data: f64 = residuals.iter().flatten().map(|r| r * r).sum();
    let prior = parameters.iter().zip(values).filter(|(p, _)| p.sigma > 0.0);
    data + prior
        .map(|(p, v)| ((v - p.prior) / p.sigma).powi(2))
        .sum::<f64>()
}

/// The damped step from a point, cut off at the bounds.
fn step(
    normal: &Normal,
    parameters: &[Parameter],
    free: &[usize],
    (values, places, damping): (&[f64], &[[f64; 2]], f64),
) -> (Vec<f64>, Vec<[f64; 2]>) {
    let n = free.len();
    let mut matrix = normal.matrix.clone();
    let mut right = normal.right.clone();
    for a in 0..n {
        matrix[(a, a)] *= 1.0 + damping;
    }
    // A parameter at its bound that is drawn beyond it stays there, and the others go on without it.
    for (a, &i) in free.iter().enumerate() {
        let [low, high] = parameters[i].bounds;
        let pull = normal.right[(a, 0)];
        if (values[i] <= low && pull < 0.0) || (values[i] >= high && pull > 0.0) {
            for c in 0..n {
                (matrix[(a, c)], matrix[(c, a)]) = (0.0, 0.0);
            }
            (matrix[(a, a)], right[(a, 0)]) = (1.0, 0.0);
        }
    }
    let Ok(factor) = matrix.llt(Side::Lower) else {
        return (values.to_vec(), places.to_vec());
    };
    let change = factor.solve(&right);
    let mut next = values.to_vec();
    for (a, &i) in free.iter().enumerate() {
        let [low, high] = parameters[i].bounds;
        next[i] = (values[i] + change[(a, 0)]).clamp(low, high);
    }
    let moved: Vec<f64> = free.iter().map(|&i| next[i] - values[i]).collect();
    let mut next_places = places.to_vec();
    for (place, (inverse, cross, own)) in next_places.iter_mut().zip(&normal.places) {
        let mut pull = *own;
        for (c, m) in cross.iter().zip(&moved) {
            pull[0] += c[0] * m;
            pull[1] += c[1] * m;
        }
        for axis in 0..2 {
            place[axis] -= inverse[axis][0] * pull[0] + inverse[axis][1] * pull[1];
        }
    }
    (next, next_places)
}
