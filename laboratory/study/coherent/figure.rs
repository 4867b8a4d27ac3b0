//! The coherent study as a figure: the halves' shares of a spot over its place, a row per pixel, a column per F-number.

use glam::DVec2;
use quadpixel_generators::plot::{Axis, Chart, Guide, Series, in_rows, sheet};

use super::spot::Transfer;
use super::{Curves, LENSES, report::places_px};

const LEFT: &str = "#1f6fd0";
const RIGHT: &str = "#d1332b";

pub(super) fn svg(title: &str, curves: &[Curves]) -> String {
    let charts = curves.iter().map(chart).collect();
    let columns = LENSES.iter().map(|lenses| lenses.f_numbers.len()).sum();
    sheet(title, &in_rows(charts, columns))
}

fn chart(c: &Curves) -> Chart {
    let line = |name: &str, colour, half: &Transfer| {
        let line = half.line(0.0);
        let at = |x: f64| DVec2::new(x, line.share(x));
        Series::line(name, colour, places_px().into_iter().map(at).collect())
    };
    let ([left, right], [left_model, right_model]) = (&c.spot.coherent, &c.spot.incoherent);
    let series = vec![
        line("left half, coherent", LEFT, left),
        line("right half", RIGHT, right),
        line("left half, model", LEFT, left_model).dashed(),
        line("right half", RIGHT, right_model).dashed(),
    ];
    let highest = series.iter().map(Series::highest).fold(0.01, f64::max);
    let mut chart = Chart::new(
        format!("{} um, F/{}", c.pitch_um, c.f_number),
        Axis::linear("place of the spot, px", (-1.0, 1.0), 0.5),
        Axis::fitted("share of its light", (0.0, 1.3 * highest)),
        series,
    );
    chart.guides = vec![Guide::X(-0.5), Guide::X(0.5)];
    chart
}
