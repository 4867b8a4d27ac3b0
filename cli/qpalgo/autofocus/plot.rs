//! The curves of one stack as a picture: sharpness above, phase difference and true defocus below, on one axis of focus.

use glam::DVec2;
use quadpixel::svg::{Svg, round_length};

use super::Measured;
use super::report::Curve;

const SIZE: DVec2 = DVec2::new(460.0, 200.0);
const MARGIN: DVec2 = DVec2::new(64.0, 34.0);
/// Room below a panel, for numbers and the name of the axis.
const BELOW: f64 = 54.0;

const GRADIENT: &str = "#1b6ca8";
const DE: &str = "#c8553d";
const WEE: &str = "#588157";
const PHASE: &str = "#1b6ca8";
const TRUE_PHASE: &str = "#999";
const COC: &str = "#c8553d";

/// One line: its name, colour, dashed or not, and how a sample gives its value.
type Line<'a> = (&'a str, &'a str, bool, &'a dyn Fn(&Measured) -> Option<f64>);

pub(super) fn curves(curve: &Curve) -> String {
    let whole = DVec2::new(SIZE.x + 1.3 * MARGIN.x, 2.0 * (SIZE.y + MARGIN.y + BELOW));
    let mut svg = Svg::new(whole);
    let largest = |value: &dyn Fn(&Measured) -> f64| {
        curve
            .samples
            .iter()
            .map(value)
            .fold(0.0, f64::max)
            .max(1e-300)
    };
    let gradient = largest(&|m| m.step.sharpness.gradient);
    let de = largest(&|m| m.step.sharpness.de);
    let wee = largest(&|m| m.step.sharpness.wee);
    let sharpness: [Line<'_>; 3] = [
        ("gradient", GRADIENT, false, &|m| {
            Some(m.step.sharpness.gradient / gradient)
        }),
        ("De", DE, false, &|m| Some(m.step.sharpness.de / de)),
        ("Wee", WEE, false, &|m| Some(m.step.sharpness.wee / wee)),
    ];
    let phase: [Line<'_>; 3] = [
        ("x_L - x_R", PHASE, false, &|m| {
            m.step.phase.map(|p| p.shift_px)
        }),
        ("traced truth", TRUE_PHASE, true, &|m| m.truth.shift_px),
        ("coc (truth)", COC, true, &|m| m.truth.coc_px),
    ];
    let corner = MARGIN;
    panel(
        &mut svg,
        corner,
        curve,
        "sharpness over its largest",
        &sharpness,
    );
    let below = corner + DVec2::new(0.0, SIZE.y + BELOW + MARGIN.y);
    panel(
        &mut svg,
        below,
        curve,
        "phase difference and defocus, px",
        &phase,
    );
    svg.finish()
}

fn panel(svg: &mut Svg, corner: DVec2, curve: &Curve, title: &str, lines: &[Line<'_>]) {
    let points = |value: &dyn Fn(&Measured) -> Option<f64>| -> Vec<DVec2> {
        let each = curve.samples.iter();
        each.filter_map(|m| Some(DVec2::new(m.step.focus_per_m, value(m)?)))
            .collect()
    };
    let all: Vec<DVec2> = lines
        .iter()
        .flat_map(|(_, _, _, value)| points(value))
        .collect();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for p in &all {
        (low, high) = (low.min(*p), high.max(*p));
    }
    if !(low.is_finite() && high.is_finite()) {
        return; // nothing was measured
    }
    // The zero is what the lower panel is about; no axis is without extent.
    (low.y, high.y) = (low.y.min(0.0), high.y.max(0.0));
    let extent = (high - low).max(DVec2::splat(1e-9));
    let at =
        |p: DVec2| corner + DVec2::new((p.x - low.x) / extent.x, (high.y - p.y) / extent.y) * SIZE;
    let ticks = |low: f64, extent: f64| {
        let step = round_length(extent / 4.0);
        let (first, last) = (
            (low / step).ceil() as i64,
            ((low + extent) / step + 1e-9).floor() as i64,
        );
        (first..=last).map(move |i| i as f64 * step)
    };
    for x in ticks(low.x, extent.x) {
        svg.polyline(
            &[at(DVec2::new(x, low.y)), at(DVec2::new(x, high.y))],
            "stroke=\"#e4e4e4\"",
        );
        svg.text(
            at(DVec2::new(x, low.y)) + DVec2::new(0.0, 14.0),
            "middle",
            11.0,
            &number(x),
        );
    }
    for y in ticks(low.y, extent.y) {
        let grey = if y == 0.0 {
            "stroke=\"#555\""
        } else {
            "stroke=\"#e4e4e4\""
        };
        svg.polyline(&[at(DVec2::new(low.x, y)), at(DVec2::new(high.x, y))], grey);
        svg.text(
            at(DVec2::new(low.x, y)) + DVec2::new(-6.0, 4.0),
            "end",
            11.0,
            &number(y),
        );
    }
    if let Some(focus) = curve.true_focus_per_m {
        let line = [at(DVec2::new(focus, low.y)), at(DVec2::new(focus, high.y))];
        svg.polyline(&line, "stroke=\"#555\" stroke-dasharray=\"2 3\"");
    }
    for (k, (name, colour, dashed, value)) in lines.iter().enumerate() {
        let dash = if *dashed {
            " stroke-dasharray=\"5 4\""
        } else {
            ""
        };
        let line: Vec<DVec2> = points(value).into_iter().map(at).collect();
        svg.polyline(
            &line,
            &format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dash}"),
        );
        if !dashed {
            let dot = format!("fill=\"{colour}\"");
            line.iter().for_each(|p| svg.circle(*p, 2.4, &dot));
        }
        let key = corner + DVec2::new(8.0 + 140.0 * k as f64, SIZE.y + 40.0);
        svg.polyline(
            &[key - DVec2::new(0.0, 4.0), key + DVec2::new(22.0, -4.0)],
            &format!("stroke=\"{colour}\" stroke-width=\"2\"{dash}"),
        );
        svg.text(key + DVec2::new(27.0, 0.0), "start", 11.0, name);
    }
    svg.text(corner - DVec2::new(0.0, 10.0), "start", 13.0, title);
    let below = corner + DVec2::new(SIZE.x, SIZE.y + 28.0);
    svg.text(
        below,
        "end",
        11.0,
        "focus, 1/m from the entrance pupil (dotted: the scene)",
    );
}

fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}
