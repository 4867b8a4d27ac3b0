//! A histogram as SVG.

use glam::DVec2;

use crate::plot::{Axis, Bar, Chart, sheet};
use crate::preview::number;

const INSIDE_PX: DVec2 = DVec2::new(356.0, 172.0);
const BARS: usize = 24;

/// Draws values in order of size, at least one; logarithmic only if all are above 0.
pub(super) fn svg(title: &str, sorted: &[f64], log: bool) -> String {
    let log = log && sorted.first().is_some_and(|v| *v > 0.0);
    let scale = |v: f64| if log { v.ln() } else { v };
    let back = |t: f64| if log { t.exp() } else { t };
    let (low, high) = span(sorted, scale);
    let mut counts = [0usize; BARS];
    for value in sorted {
        let place = (scale(*value) - low) / (high - low) * BARS as f64;
        counts[(place.max(0.0) as usize).min(BARS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    let edge = |bar: usize| back(low + (high - low) * bar as f64 / BARS as f64);
    let quarters = (0..=4).map(|quarter| edge(BARS * quarter / 4));
    let x_ticks = quarters.map(|value| (value, number(value))).collect();
    let y_ticks = vec![(0.0, "0".to_owned()), (most as f64, most.to_string())];
    let x = Axis::with_ticks("", (back(low), back(high)), log, x_ticks);
    let y = Axis::with_ticks("", (0.0, most as f64), false, y_ticks);
    let bars = counts.iter().enumerate().filter(|(_, count)| **count > 0);
    let bars = bars.map(|(i, count)| Bar {
        x: (edge(i), edge(i + 1)),
        height: *count as f64,
    });
    let chart = Chart {
        inside_px: INSIDE_PX,
        bars: bars.collect(),
        ..Chart::new(title, x, y, Vec::new())
    };
    sheet("", &[vec![chart]])
}

/// From where to where, on the scale; never empty.
fn span(sorted: &[f64], scale: impl Fn(f64) -> f64) -> (f64, f64) {
    let ends = (sorted.first().copied(), sorted.last().copied());
    let (Some(least), Some(most)) = ends else {
        return (0.0, 1.0);
    };
    let (low, high) = (scale(least), scale(most));
    if high > low {
        return (low, high);
    }
    let half = 0.05 * low.abs().max(0.1);
    (low - half, low + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fullest_bar_tells_its_count_and_one_value_alone_is_drawn() {
        let values: Vec<f64> = (0..48).map(f64::from).collect();
        assert!(svg("t", &values, false).contains(">2</text>"));
        for (value, log) in [(3.0, true), (0.0, false), (-2.0, true)] {
            let picture = svg("t", &[value], log);
            assert!(picture.contains(">1</text>") && !picture.contains("NaN"));
        }
    }
}
