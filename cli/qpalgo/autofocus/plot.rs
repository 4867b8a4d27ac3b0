//! The curves of one stack as a picture: sharpness above, phase difference and true defocus below, on one axis of
//! focus.

use glam::DVec2;
use quadpixel_generators::plot::{Axis, Chart, Guide, Series, sheet};

use super::measured::Measured;
use super::report::Curve;

const INSIDE_PX: DVec2 = DVec2::new(460.0, 200.0);
const MARK_RADIUS_PX: f64 = 2.4;
/// Height of a chart over that of its curves: room for the legend.
const HEADROOM: f64 = 1.35;
const BLUE: &str = "#1b6ca8";
const RED: &str = "#c8553d";
const GREEN: &str = "#588157";
const GREY: &str = "#999";

/// The curves of one stack.
pub(super) fn curves(curve: &Curve) -> String {
    let sharpness = |name: &str, colour, value: fn(&Measured) -> f64| {
        let values = curve.samples.iter().map(value);
        let largest = values.fold(0.0, f64::max).max(1e-300);
        line(curve, name, colour, |m| Some(value(m) / largest)).marked(MARK_RADIUS_PX)
    };
    let sharpness = vec![
        sharpness("gradient", BLUE, |m| m.step.sharpness.gradient),
        sharpness("De", RED, |m| m.step.sharpness.de),
        sharpness("Wee", GREEN, |m| m.step.sharpness.wee),
    ];
    let phase = |m: &Measured| m.step.phase.map(|p| p.shift_px);
    let phase = vec![
        line(curve, "x_L - x_R", BLUE, phase).marked(MARK_RADIUS_PX),
        line(curve, "traced truth", GREY, |m| m.truth.shift_px).dashed(),
        line(curve, "coc (truth)", RED, |m| m.truth.coc_px).dashed(),
    ];
    let charts = [
        chart(curve, "sharpness over its largest", sharpness),
        chart(curve, "phase difference and defocus, px", phase),
    ];
    // What was not measured has no chart.
    sheet("", &charts.map(|c| c.into_iter().collect::<Vec<_>>()))
}

fn line(
    curve: &Curve,
    name: &str,
    colour: &'static str,
    value: impl Fn(&Measured) -> Option<f64>,
) -> Series {
    let points = curve.samples.iter();
    let points = points.filter_map(|m| Some(DVec2::new(m.step.focus_per_m, value(m)?)));
    Series::line(name, colour, points.collect())
}

fn chart(curve: &Curve, title: &str, series: Vec<Series>) -> Option<Chart> {
    let points = || series.iter().flat_map(Series::points);
    let low = points().copied().reduce(DVec2::min)?;
    let high = points().copied().reduce(DVec2::max)?;
    // The zero is what the lower chart is about.
    let (bottom, top) = (low.y.min(0.0), high.y.max(0.0));
    let x = Axis::fitted(
        "focus, 1/m from the entrance pupil (dotted: the scene)",
        (low.x, high.x),
    );
    let y = Axis::fitted("", (bottom, bottom + HEADROOM * (top - bottom)));
    let scene = curve.true_focus_per_m.map(Guide::X);
    Some(Chart {
        inside_px: INSIDE_PX,
        guides: scene.into_iter().chain([Guide::Y(0.0)]).collect(),
        ..Chart::new(title, x, y, series)
    })
}
