//! A histogram as SVG.

use glam::DVec2;
use quadpixel::svg::Svg;

use crate::preview::number;

const SIZE: DVec2 = DVec2::new(420.0, 240.0);
/// Left, top, right, bottom.
const MARGIN: [f64; 4] = [48.0, 34.0, 16.0, 34.0];
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
    let [left, top, right, bottom] = MARGIN;
    let inner = SIZE - DVec2::new(left + right, top + bottom);
    let floor = top + inner.y;
    let x = |bar: f64| left + inner.x * bar / BARS as f64;
    let mut svg = Svg::new(SIZE);
    svg.text(DVec2::new(left, 20.0), "start", 13.0, title);
    for (bar, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let height = inner.y * *count as f64 / most as f64;
        let (from, to) = (x(bar as f64) + 0.5, x(bar as f64 + 1.0) - 0.5);
        let corners = [
            (from, floor),
            (from, floor - height),
            (to, floor - height),
            (to, floor),
        ];
        svg.polygon(&corners.map(|(x, y)| DVec2::new(x, y)), "fill=\"#4c78a8\"");
    }
    let axis = [DVec2::new(left, floor), DVec2::new(SIZE.x - right, floor)];
    svg.polyline(&axis, "stroke=\"#333\" fill=\"none\"");
    for quarter in 0..=4 {
        let bar = (BARS * quarter / 4) as f64;
        let value = back(low + (high - low) * bar / BARS as f64);
        svg.text(
            DVec2::new(x(bar), floor + 18.0),
            "middle",
            11.0,
            &number(value),
        );
    }
    svg.text(
        DVec2::new(left - 6.0, top + 8.0),
        "end",
        11.0,
        &most.to_string(),
    );
    svg.text(DVec2::new(left - 6.0, floor), "end", 11.0, "0");
    svg.finish()
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
