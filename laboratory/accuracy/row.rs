//! What a knob's study gives: error against time, setting by setting.

use serde::Serialize;

/// One setting of a knob.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What was set.
    pub setting: String,
    /// Processor seconds, in the table's unit.
    pub seconds: f64,
    /// Against the converged reference, in the table's unit.
    pub error: f64,
}

impl Row {
    /// A row.
    pub fn new(setting: impl Into<String>, seconds: f64, error: f64) -> Self {
        Self {
            setting: setting.into(),
            seconds,
            error,
        }
    }
}

/// Rows of one kind: a line of the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// What the rows share.
    pub name: String,
    /// From coarse to fine.
    pub rows: Vec<Row>,
}

/// A knob: all its rows on stated work, against a stated reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// The knob, as it is called on the command line.
    pub knob: &'static str,
    /// What was computed.
    pub work: String,
    /// What it was held against.
    pub reference: String,
    /// Unit of the time.
    pub seconds_unit: &'static str,
    /// What the error is, with its unit.
    pub error_unit: &'static str,
    /// The lines.
    pub curves: Vec<Curve>,
    /// Exponent p of `error ~ time^p` that theory has, drawn from the first row of each line.
    pub law: Option<f64>,
    /// What the rows show, in words.
    pub notes: Vec<String>,
}

/// Exponent p of `y ~ x^p`: the slope of the straight line through the logarithms (least squares). `None` without two
/// different x and positive values.
pub fn power(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let n = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (xx > 0.0).then(|| xy / xx)
}

/// Root of the mean square of a − b.
pub fn rms<A: Into<f64> + Copy, B: Into<f64> + Copy>(a: &[A], b: &[B]) -> f64 {
    let squares = a
        .iter()
        .zip(b)
        .map(|(&a, &b)| (a.into() - b.into()).powi(2));
    (squares.sum::<f64>() / a.len().min(b.len()).max(1) as f64).sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn power_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = (1..9)
            .map(|n| (f64::from(n), 3.0 * f64::from(n).powf(-0.75)))
            .collect();
        assert!((power(&points).unwrap() + 0.75).abs() < 1e-12);
        assert_eq!(power(&[(2.0, 1.0)]), None);
        assert_eq!(power(&[]), None);
    }

    #[test]
    fn rms_is_that_of_the_differences() {
        assert_eq!(rms(&[1f32, 2.0, 3.0, 4.0], &[0f64, 3.0, 2.0, 5.0]), 1.0);
    }
}
