//! The fields and columns that the fit did not see, against goals.

use serde::Serialize;

use super::prediction::{FieldPrediction, PlanePrediction, Prediction};

/// One goal.
#[derive(Clone, Debug, Serialize)]
pub struct Goal {
    /// What is held against what.
    pub what: String,
    /// What was found.
    pub found: f64,
    /// What it may be at most.
    pub at_most: f64,
    /// Whether it is.
    pub met: bool,
}

fn goal(what: &str, found: f64, at_most: f64) -> Goal {
    Goal {
        what: what.to_owned(),
        found,
        at_most,
        met: found <= at_most,
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    sum / count as f64
}

fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) })
}

/// The shifts of a plane's thirds.
fn goal_of_plane(plane: &PlanePrediction) -> Goal {
    let thirds = plane.thirds.iter().flatten();
    let worst = most(thirds.map(|[measured, predicted]| (predicted / measured - 1.0).abs()));
    let (mm, stop, nm) = (plane.distance_mm, plane.stop, plane.wavelength_nm);
    let what = format!("plane at {mm} mm, stop {stop:.2} x F, {nm} nm: shift, worst third");
    goal(&what, worst, 0.08)
}

impl Prediction {
    /// The goals, of what was held out.
    pub fn goals(&self) -> Vec<Goal> {
        let mut goals = match self.fields.is_empty() {
            true => Vec::new(),
            false => self.goals_of_kernels(),
        };
        goals.extend(self.planes.iter().filter(|p| p.held_out).map(goal_of_plane));
        goals
    }

    fn goals_of_kernels(&self) -> Vec<Goal> {
        let out = || self.fields.iter().filter(|f| f.held_out);
        let last = |axis: usize| self.fields.iter().map(|f| f.field[axis]).max().unwrap_or(0);
        let (columns, rows) = (last(0) + 1, last(1) + 1);
        let central = |f: &&FieldPrediction| {
            let near = |k: usize, count: usize| (2 * k + 1).abs_diff(count) <= 1;
            near(f.field[0], columns) && near(f.field[1], rows)
        };
        let of_central =
            |figure: &dyn Fn(&FieldPrediction) -> f64| mean(out().filter(central).map(figure));
        let gap = |figure: &dyn Fn(&super::figures::FieldFigures) -> f64| {
            let both = of_central(&|f| figure(&f.predicted)) - of_central(&|f| figure(&f.measured));
            both.abs()
        };
        let shift =
            |f: &FieldPrediction| f.predicted.shift_over_disk / f.measured.shift_over_disk - 1.0;
        let halves = |f: &FieldPrediction| match (f.predicted.equal_halves, f.measured.equal_halves)
        {
            (Some(p), Some(m)) => p - m,
            _ => f64::NAN,
        };
        let by_column =
            (0..columns).map(|c| mean(out().filter(|f| f.field[0] == c).map(halves)).abs());
        let sheet = self.sheet.iter().filter(|c| c.held_out);
        let sheet_rms = mean(
            sheet
                .clone()
                .map(|c| (c.predicted / c.measured - 1.0).powi(2)),
        )
        .sqrt();
        vec![
            goal(
                "shift / disk diameter, RMS of the relative error",
                mean(out().map(|f| shift(f).powi(2))).sqrt(),
                0.04,
            ),
            goal("overlap, central fields", gap(&|f| f.overlap), 0.02),
            goal(
                "left share at the left edge, central fields",
                gap(&|f| f.edges[0]),
                0.04,
            ),
            goal(
                "left share at the right edge, central fields",
                gap(&|f| f.edges[1]),
                0.04,
            ),
            goal(
                "place of equal halves, radii, worst column's mean",
                most(by_column),
                0.04,
            ),
            goal(
                "place of equal halves, radii, RMS over fields",
                mean(out().map(|f| halves(f).powi(2))).sqrt(),
                0.04,
            ),
            goal(
                "kernels, RMS of their size, worst field",
                most(out().map(|f| f.kernel_rms)),
                0.10,
            ),
            goal(
                "kernels, RMS of their size, mean over fields",
                mean(out().map(|f| f.kernel_rms)),
                0.10,
            ),
            goal(
                "sheet left / right, worst column",
                most(sheet.map(|c| (c.predicted / c.measured - 1.0).abs())),
                0.04,
            ),
            goal("sheet left / right, RMS over columns", sheet_rms, 0.04),
        ]
    }
}
