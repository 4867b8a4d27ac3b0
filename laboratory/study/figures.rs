//! The studies as the paper's figures: P over θ above the rejection ratio (Figs. 2, 3, 13), ratios of the nine lenses,
//! and R_a, R_b over the pitch (Fig. 11).

use glam::DVec2;
use quadpixel::response::REJECTION_THRESHOLD;

use super::cases::{Case, CurveStudy};
use super::curve::{Curve, Point};
use quadpixel_generators::plot::{Axis, Chart, Guide, Series, in_rows, sheet};

const BLUE: &str = "#1f6fd0";
const GREEN: &str = "#2a9d3a";
const RED: &str = "#d1332b";
const GREY: &str = "#666";
/// Name of the axis of incidence.
const THETA: &str = "θ, deg (φ = 0)";
const MARK_RADIUS_PX: f64 = 4.0;
/// Half the width of the ratio's chart, deg, as in the paper.
const RATIO_WITHIN_DEG: f64 = 30.0;
/// Ratios above are left out.
const LARGEST_RATIO: f64 = 1.0;

pub(super) fn svg(study: &CurveStudy, cases: &[Case], curves: &[Curve], model: &str) -> String {
    let charts = match study {
        CurveStudy::Pitch => vec![vec![pitches(cases, curves)]],
        CurveStudy::Microlens => {
            let all: Vec<Chart> = cases
                .iter()
                .zip(curves)
                .map(|(case, curve)| ratios(titled(case, curve), &[(case, curve, RED)]))
                .collect();
            in_rows(all, 3)
        }
        CurveStudy::Wavelength => columns(cases, curves, &[BLUE, GREEN, RED]),
        CurveStudy::Rejection { .. } | CurveStudy::Filter | CurveStudy::Tungsten => {
            columns(cases, curves, &[])
        }
    };
    let title = format!("{} study, model {model}", study.name());
    sheet(&title, &charts)
}

/// A column per chart of the study: P on top, the ratio below. `colours` tell cases that share a chart apart.
fn columns(cases: &[Case], curves: &[Curve], colours: &[&'static str]) -> Vec<Vec<Chart>> {
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    let highest = curves.iter().flat_map(|c| &c.points);
    let highest = highest.map(|p| p.left + p.right).fold(0.1, f64::max);
    let count = cases.iter().map(|c| c.chart + 1).max().unwrap_or(0);
    for chart in 0..count {
        let pairs = cases.iter().zip(curves);
        let sharing: Vec<(&Case, &Curve)> = pairs.filter(|(c, _)| c.chart == chart).collect();
        let Some(&(first, curve)) = sharing.first() else {
            continue;
        };
        let title = match sharing[..] {
            [(case, curve)] => titled(case, curve),
            _ if first.centre_deg == 0.0 => "centred lens".to_string(),
            _ => format!("lens shifted for a chief ray at {}°", first.centre_deg),
        };
        let (first, last) = (curve.points.first(), curve.points.last());
        let ends = (
            first.map_or(0.0, |p| p.theta_deg),
            last.map_or(1.0, |p| p.theta_deg),
        );
        // Room for the legend.
        let top = (highest * 1.45 * 10.0).ceil() / 10.0;
        upper.push(Chart::new(
            title.clone(),
            Axis::linear(THETA, ends, 10.0),
            Axis::linear("P", (0.0, top), 0.2),
            halves(&sharing, colours),
        ));
        let colours = colours.iter().copied().chain(std::iter::repeat(RED));
        let coloured: Vec<(&Case, &Curve, &'static str)> = sharing
            .into_iter()
            .zip(colours)
            .map(|((case, curve), colour)| (case, curve, colour))
            .collect();
        lower.push(ratios(title, &coloured));
    }
    vec![upper, lower]
}

/// P of both halves: of one case with their sum, of several by colour.
fn halves(cases: &[(&Case, &Curve)], colours: &[&'static str]) -> Vec<Series> {
    if let [(_, curve)] = cases {
        return vec![
            line("P_A (right)", RED, curve, |p| p.right),
            line("P_B (left)", BLUE, curve, |p| p.left),
            line("sum", GREY, curve, |p| p.left + p.right).dashed(),
        ];
    }
    let coloured = cases.iter().zip(colours);
    coloured
        .flat_map(|((case, curve), &colour)| {
            let name = format!("P_A, {} nm (P_B dashed)", case.wavelength_nm);
            [
                line(&name, colour, curve, |p| p.right),
                line("", colour, curve, |p| p.left).dashed(),
            ]
        })
        .collect()
}

/// The ratio about the chief ray, with the threshold.
fn ratios(title: String, cases: &[(&Case, &Curve, &'static str)]) -> Chart {
    let centre = cases.first().map_or(0.0, |c| c.0.centre_deg);
    let lines = cases
        .iter()
        .map(|(case, curve, colour)| line("", colour, curve, |p| p.ratio(case.centre_deg)));
    let ends = (centre - RATIO_WITHIN_DEG, centre + RATIO_WITHIN_DEG);
    Chart {
        guides: vec![Guide::Y(REJECTION_THRESHOLD)],
        ..Chart::new(
            title,
            Axis::linear(THETA, ends, 10.0),
            Axis::linear("ratio", (0.0, LARGEST_RATIO), 0.2),
            lines.collect(),
        )
    }
}

fn titled(case: &Case, curve: &Curve) -> String {
    let r = &curve.ranges[0];
    match r.r_a_deg {
        Some(a) => {
            let more = if r.open { "> " } else { "" };
            format!("{}: R_a {a:.1}°, R_b {more}{:.1}°", case.name, r.r_b_deg)
        }
        None => format!("{}: never below 0.2", case.name),
    }
}

fn line(name: &str, colour: &'static str, curve: &Curve, value: impl Fn(&Point) -> f64) -> Series {
    let points = curve.points.iter();
    let points = points.map(|p| DVec2::new(p.theta_deg, value(p)));
    Series::line(name, colour, points.filter(|p| p.is_finite()).collect())
}

/// R_a and R_b over the pitch; the 3.5 µm pixel as it was optimized is marked.
fn pitches(cases: &[Case], curves: &[Curve]) -> Chart {
    let ranges = |chart: usize, value: &dyn Fn(&Curve) -> Option<f64>| -> Vec<DVec2> {
        let pairs = cases.iter().zip(curves).filter(|(c, _)| c.chart == chart);
        pairs
            .filter_map(|(c, curve)| Some(DVec2::new(c.stack.pitch_um, value(curve)?)))
            .collect()
    };
    let r_a = |c: &Curve| c.ranges[0].r_a_deg;
    let r_b = |c: &Curve| r_a(c).map(|_| c.ranges[0].r_b_deg);
    let series = vec![
        Series::line("R_a", BLUE, ranges(0, &r_a)).marked(MARK_RADIUS_PX),
        Series::line("R_b", GREEN, ranges(0, &r_b)).marked(MARK_RADIUS_PX),
        Series::marks("3.5 µm, filter 1 µm", RED, ranges(1, &r_a)),
        Series::marks("", RED, ranges(1, &r_b)),
    ];
    Chart::new(
        "angular ranges over the pitch",
        Axis::linear("pitch, µm", (1.0, 6.2), 1.0),
        Axis::linear("deg", (0.0, 40.0), 5.0),
        series,
    )
}
