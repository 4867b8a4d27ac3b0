//! P over θ at φ = 0, and the ranges of its rejection ratio.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::response::{LitPixel, PixelModel, RejectionRanges, direction_cosines};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cases::Case;
use super::kept::Kept;
use quadpixel::command::CommandError;

/// Most angles on one side of a curve.
const MOST_ANGLES: f64 = 2000.0;
/// Largest angle of incidence, deg: no model is to be trusted nearer to grazing.
const LARGEST_DEG: f64 = 80.0;
/// The total absorbed is a mean over this cone about the chief ray, deg.
pub(super) const TOTAL_WITHIN_DEG: f64 = 30.0;

/// Angles from the centre of a curve outwards.
pub(super) struct Angles {
    step_deg: f64,
    count: usize,
}

impl Angles {
    pub fn new(step_deg: f64, max_deg: f64) -> Result<Self, CommandError> {
        // Written so that NaN fails.
        if !(step_deg > 0.0 && max_deg > 0.0 && max_deg <= LARGEST_DEG) {
            return Err(CommandError::input(format!(
                "--theta-step-deg is {step_deg} and --theta-max-deg {max_deg}; allowed: a step above 0, a maximum above 0 and at most {LARGEST_DEG}"
            )));
        }
        let count = (max_deg / step_deg + 1e-9).floor();
        if !(1.0..=MOST_ANGLES).contains(&count) {
            return Err(CommandError::input(format!(
                "--theta-step-deg is {step_deg}; allowed: 1 to {MOST_ANGLES} steps up to --theta-max-deg {max_deg}"
            )));
        }
        Ok(Self {
            step_deg,
            count: count as usize,
        })
    }

    /// From 0 to one side, ascending.
    pub fn one_side(&self) -> Vec<f64> {
        (0..=self.count).map(|i| i as f64 * self.step_deg).collect()
    }

    /// Of a case, ascending. A centred lens gives one side, its mirror image is the other.
    fn of(&self, case: &Case) -> Vec<f64> {
        let count = self.count as i64;
        let first = if case.centre_deg == 0.0 { 0 } else { -count };
        (first..=count)
            .map(|i| case.centre_deg + i as f64 * self.step_deg)
            .filter(|t| t.abs() <= LARGEST_DEG)
            .collect()
    }
}

/// One angle. P of left and right is that of one row of sub-pixels (B and A of a quad pixel).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Point {
    pub theta_deg: f64,
    pub left: f64,
    pub right: f64,
    /// All sub-pixels.
    pub total: f64,
    pub reflected: f64,
    /// Whether the model found something wrong with its run.
    pub warned: bool,
}

/// A case over θ, ascending, both sides.
pub(super) struct Curve {
    pub points: Vec<Point>,
    /// Beyond the chief ray, and on this side of it.
    pub ranges: [RejectionRanges; 2],
    /// Mean of the total within [`TOTAL_WITHIN_DEG`].
    pub total: f64,
    /// Angles that were computed.
    pub angles: usize,
}

/// The curves of all cases, on all threads; angles that were kept are not computed again.
pub(super) fn all(
    cases: &[Case],
    model: &PixelModel,
    angles: &Angles,
    kept: &Kept,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Curve>, CommandError> {
    let input = |case: &Case, e: quadpixel::response::ResponseError| {
        CommandError::input(e.to_string()).within(&case.name)
    };
    let lit = cases
        .par_iter()
        .map(|c| LitPixel::new(&c.stack, model, c.wavelength_nm).map_err(|e| input(c, e)))
        .collect::<Result<Vec<_>, _>>()?;
    let wanted: Vec<(usize, f64)> = cases
        .iter()
        .enumerate()
        .flat_map(|(i, c)| angles.of(c).into_iter().map(move |t| (i, t)))
        .collect();
    let done = AtomicUsize::new(0);
    let one = |&(i, theta_deg): &(usize, f64)| {
        if let Some(point) = kept.point(i, theta_deg) {
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, wanted.len());
            return Ok(point);
        }
        let [u, v] = direction_cosines(theta_deg, 0.0);
        let answer = lit[i].light(u, v).map_err(|e| input(&cases[i], e))?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, wanted.len());
        let s = cases[i].stack.subpixels;
        let half = |side: f64| -> f64 {
            let p = answer.mean.absorbed.iter().enumerate();
            let own = p.filter(|(k, _)| s.centre(*k).0 * side > 0.0);
            own.map(|(_, p)| p).sum::<f64>() / s.n() as f64
        };
        let point = Point {
            theta_deg,
            left: half(-1.0),
            right: half(1.0),
            total: answer.mean.absorbed.iter().sum(),
            reflected: answer.mean.reflected,
            warned: !answer.warnings.is_empty(),
        };
        kept.keep(i, point);
        Ok(point)
    };
    let points: Result<Vec<Point>, CommandError> = wanted.par_iter().map(one).collect();
    let mut points = points?.into_iter();
    Ok(cases
        .iter()
        .map(|case| curve(case, points.by_ref().take(angles.of(case).len()).collect()))
        .collect())
}

fn curve(case: &Case, computed: Vec<Point>) -> Curve {
    let angles = computed.len();
    let points = if case.centre_deg == 0.0 {
        let mirror = |p: &Point| Point {
            theta_deg: -p.theta_deg,
            left: p.right,
            right: p.left,
            ..*p
        };
        let left = computed[1..].iter().rev().map(mirror);
        left.chain(computed.iter().copied()).collect()
    } else {
        computed
    };
    let offset = |p: &Point| p.theta_deg - case.centre_deg;
    let beyond = points.iter().filter(|p| offset(p) >= -1e-9);
    let beyond: (Vec<f64>, Vec<f64>) = beyond.map(|p| (offset(p), p.left / p.right)).unzip();
    let before = points.iter().rev().filter(|p| offset(p) <= 1e-9);
    let before: (Vec<f64>, Vec<f64>) = before.map(|p| (-offset(p), p.right / p.left)).unzip();
    let near = points
        .iter()
        .filter(|p| offset(p).abs() <= TOTAL_WITHIN_DEG);
    let (count, sum) = near.fold((0, 0.0), |(n, sum), p| (n + 1, sum + p.total));
    Curve {
        ranges: [&beyond, &before].map(|(theta, ratio)| RejectionRanges::of(theta, ratio)),
        total: sum / f64::from(count),
        points,
        angles,
    }
}

impl Point {
    /// The rejection ratio (eq. 1), about a chief ray at `centre_deg`.
    pub fn ratio(&self, centre_deg: f64) -> f64 {
        if self.theta_deg >= centre_deg {
            self.left / self.right
        } else {
            self.right / self.left
        }
    }
}
