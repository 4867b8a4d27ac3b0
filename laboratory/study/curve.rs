//! P over θ at φ = 0, and the ranges of its rejection ratio.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::em::PixelModel;
use quadpixel::em::light::{SolverError, direction_cosines};
use quadpixel::journal::{Journal, JournalError};
use quadpixel::progress::Progress;
use quadpixel::response::RejectionRanges;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cases::Case;
use crate::error::LaboratoryError;

/// Most angles on one side of a curve.
const MOST_ANGLES: f64 = 2000.0;
/// Largest angle of incidence, deg: no model is to be trusted nearer to grazing.
const LARGEST_DEG: f64 = 80.0;
/// The total absorbed is a mean over this cone about the chief ray, deg.
pub(super) const TOTAL_WITHIN_DEG: f64 = 30.0;

/// Angles from the centre of a curve outwards.
#[derive(Clone, Debug)]
pub struct Angles {
    step_deg: f64,
    count: usize,
}

/// Angles that cannot be studied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("step_deg is {step_deg} and largest_deg {largest_deg}; allowed: {allowed}")]
pub struct AnglesError {
    /// The step that was asked for, deg.
    pub step_deg: f64,
    /// The largest angle that was asked for, deg.
    pub largest_deg: f64,
    /// What may be asked for.
    pub allowed: String,
}

impl Angles {
    /// Angles in equal steps up to the largest, deg.
    ///
    /// # Errors
    /// A step or largest angle that is not above 0, angles near grazing, or too many of them.
    pub fn new(step_deg: f64, largest_deg: f64) -> Result<Self, AnglesError> {
        let refused = |allowed: String| AnglesError {
            step_deg,
            largest_deg,
            allowed,
        };
        // Written so that NaN fails.
        if !(step_deg > 0.0 && largest_deg > 0.0 && largest_deg <= LARGEST_DEG) {
            return Err(refused(format!(
                "a step above 0, a maximum above 0 and at most {LARGEST_DEG}"
            )));
        }
        let count = (largest_deg / step_deg + 1e-9).floor();
        if !(1.0..=MOST_ANGLES).contains(&count) {
            return Err(refused(format!(
                "1 to {MOST_ANGLES} steps up to the maximum"
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

    /// Those of a case, ascending. A centred lens gives one side, its mirror image is the other.
    fn of_case(&self, case: &Case) -> Vec<f64> {
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

/// Points that are done, by case and by the bits of θ.
pub(super) type PointJournal = Journal<(usize, u64), Point>;

/// Opens the journal of these cases; one of other cases, or of another model, is begun anew.
///
/// # Errors
/// A file that cannot be read or written.
pub(super) fn journal(
    path: &Path,
    cases: &[Case],
    model: &PixelModel,
    progress: &dyn Progress,
) -> Result<PointJournal, JournalError> {
    let pixels: Vec<_> = cases
        .iter()
        .map(|c| (&c.name, &c.stack, c.wavelength_nm))
        .collect();
    // Settings are plain data: they always have a text.
    let key = serde_json::json!([model.version(), model, pixels]).to_string();
    Journal::open(path, &key, progress)
}

/// The curves of all cases, on all threads; angles in the journal are not computed again.
pub(super) fn all(
    cases: &[Case],
    model: &PixelModel,
    angles: &Angles,
    journal: &PointJournal,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Curve>, LaboratoryError> {
    let failed = |case: &Case, cause: SolverError| LaboratoryError::Pixel {
        pixel: case.name.clone(),
        cause: Box::new(cause.into()),
    };
    let lit = cases
        .par_iter()
        .map(|c| {
            model
                .solver(&c.stack, c.wavelength_nm)
                .map_err(|e| failed(c, e))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let wanted: Vec<(usize, f64)> = cases
        .iter()
        .enumerate()
        .flat_map(|(i, c)| angles.of_case(c).into_iter().map(move |t| (i, t)))
        .collect();
    let done = AtomicUsize::new(0);
    let one = |&(i, theta_deg): &(usize, f64)| {
        if let Some(point) = journal.outcome(&(i, theta_deg.to_bits())) {
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, wanted.len());
            return Ok(*point);
        }
        let [u, v] = direction_cosines(theta_deg, 0.0);
        let answer = lit[i]
            .on_microlens(u, v)
            .map_err(|e| failed(&cases[i], e))?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, wanted.len());
        let s = cases[i].stack.subpixels;
        let half = |side: f64| -> f64 {
            let p = answer.mean.absorbed.iter().enumerate();
            let on_side = p.filter(|(k, _)| s.centre(*k).0 * side > 0.0);
            on_side.map(|(_, p)| p).sum::<f64>() / s.n() as f64
        };
        let point = Point {
            theta_deg,
            left: half(-1.0),
            right: half(1.0),
            total: answer.mean.absorbed.iter().sum(),
            reflected: answer.mean.reflected,
            warned: !answer.warnings.is_empty(),
        };
        journal.keep((i, theta_deg.to_bits()), &point);
        Ok(point)
    };
    let points: Result<Vec<Point>, LaboratoryError> = wanted.par_iter().map(one).collect();
    let mut points = points?.into_iter();
    Ok(cases
        .iter()
        .map(|case| {
            curve(
                case,
                points.by_ref().take(angles.of_case(case).len()).collect(),
            )
        })
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
        ranges: [&beyond, &before].map(|(theta, ratio)| RejectionRanges::from_curve(theta, ratio)),
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::em::PixelStack;

    fn case(name: &str) -> Vec<Case> {
        vec![Case {
            name: name.to_owned(),
            stack: PixelStack::builtin("1.6um").unwrap(),
            wavelength_nm: 550.0,
            centre_deg: 0.0,
            paper: None,
            chart: 0,
        }]
    }

    #[test]
    fn angles_of_a_killed_study_come_back_to_the_bit_and_those_of_another_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pitch.partial");
        let model = PixelModel::Geometric {
            focal_length_um: 2.0,
        };
        let point = Point {
            theta_deg: 0.1 + 0.2,
            left: 1.0 / 3.0,
            right: 0.1,
            total: 0.5,
            reflected: 0.2,
            warned: true,
        };
        let id = (0, point.theta_deg.to_bits());
        let open = |name: &str| journal(&path, &case(name), &model, &()).unwrap();
        open("a").keep(id, &point);
        assert_eq!(open("a").outcome(&id), Some(&point));
        assert_eq!(open("b").outcome(&id), None);
    }
}
