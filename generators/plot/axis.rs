//! A chart's axis: its name, ends, scale and ticks.

/// Ticks of a fitted axis, about.
const FITTED_TICKS: f64 = 4.0;

/// One axis of a chart, linear or logarithmic.
#[derive(Clone, Debug)]
pub struct Axis {
    name: String,
    /// On the scale: of a logarithmic axis, logarithms to the base 10.
    ends: (f64, f64),
    log: bool,
    /// Values and what is written beside them.
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis with ticks at the multiples of a step.
    pub fn linear(name: &str, ends: (f64, f64), step: f64) -> Axis {
        let first = (ends.0 / step - 1e-6).ceil() as i64;
        let last = (ends.1 / step + 1e-6).floor() as i64;
        let ticks = (first..=last).map(|i| i as f64 * step);
        let ticks = ticks.map(|v| (v, decimal(v))).collect();
        Axis {
            name: name.to_owned(),
            ends,
            log: false,
            ticks,
        }
    }

    /// A linear axis with about four ticks at round numbers; ends that are equal are moved apart.
    pub fn fitted(name: &str, (low, high): (f64, f64)) -> Axis {
        let high = high.max(low + 1e-9);
        Axis::linear(name, (low, high), round_length((high - low) / FITTED_TICKS))
    }

    /// A logarithmic axis over the whole powers of ten around all values; those that have no logarithm do not count.
    pub fn decades(name: &str, values: impl IntoIterator<Item = f64>) -> Axis {
        let logs = values.into_iter().map(f64::log10).filter(|v| v.is_finite());
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v.floor()), high.max(v.ceil()))
        });
        let (low, high) = if low.is_finite() {
            (low, high.max(low + 1.0))
        } else {
            (0.0, 1.0)
        };
        let ticks = (low as i32..=high as i32).map(|power| {
            let value = 10f64.powi(power);
            let small = (-3..=3).contains(&power);
            let label = if small {
                decimal(value)
            } else {
                format!("1e{power}")
            };
            (value, label)
        });
        Axis {
            name: name.to_owned(),
            ends: (low, high),
            log: true,
            ticks: ticks.collect(),
        }
    }

    /// An axis with stated ends and ticks.
    pub fn with_ticks(name: &str, ends: (f64, f64), log: bool, ticks: Vec<(f64, String)>) -> Axis {
        let (low, high) = ends;
        let ends = if log {
            (low.log10(), high.log10())
        } else {
            ends
        };
        Axis {
            name: name.to_owned(),
            ends,
            log,
            ticks,
        }
    }

    /// What the axis shows, with its unit.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// The value at the upper end.
    pub fn high(&self) -> f64 {
        if self.log {
            10f64.powf(self.ends.1)
        } else {
            self.ends.1
        }
    }

    /// Where a value stands: 0 at the lower end, 1 at the upper; not finite for a value without a logarithm.
    pub(super) fn place(&self, value: f64) -> f64 {
        let value = if self.log { value.log10() } else { value };
        (value - self.ends.0) / (self.ends.1 - self.ends.0)
    }

    /// Places of the ticks and their labels.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        self.ticks
            .iter()
            .map(|(value, label)| (self.place(*value), label.clone()))
    }
}

/// A tick's number without needless zeros.
fn decimal(value: f64) -> String {
    // Adding 0 makes a negative zero a plain one.
    format!("{}", (value * 1e6).round() / 1e6 + 0.0)
}

/// The largest 1, 2 or 5 times a power of ten that is at most `length`.
pub fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let digit = length / power;
    let round = if digit >= 5.0 {
        5.0
    } else if digit >= 2.0 {
        2.0
    } else {
        1.0
    };
    round * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_whole_around_the_values() {
        let ends = |values: &[f64]| Axis::decades("", values.iter().map(|v| 10f64.powf(*v))).ends;
        assert_eq!(ends(&[-1.5, 0.3]), (-2.0, 1.0));
        assert_eq!(ends(&[0.2, 1.0]), (0.0, 1.0));
        assert_eq!(ends(&[2.0, 2.0]), (2.0, 3.0));
        assert_eq!(ends(&[]), (0.0, 1.0));
        assert_eq!(Axis::decades("", [0.0, -1.0]).ends, (0.0, 1.0));
    }

    #[test]
    fn ticks_stand_at_round_numbers_within_the_ends() {
        let labels = |axis: Axis| axis.ticks().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(
            labels(Axis::linear("", (-0.4, 0.4), 0.2)),
            ["-0.4", "-0.2", "0", "0.2", "0.4"]
        );
        assert_eq!(
            labels(Axis::fitted("", (0.0, 9.0))),
            ["0", "2", "4", "6", "8"]
        );
        assert_eq!(
            labels(Axis::decades("", [2e-5, 0.5])),
            ["1e-5", "1e-4", "0.001", "0.01", "0.1", "1"]
        );
    }
}
