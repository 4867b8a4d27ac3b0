//! The studies as the paper's figures: P over θ above the rejection ratio (Figs. 2, 3, 13), ratios of the nine lenses, and R_a, R_b over the
//! pitch (Fig. 11).

use glam::DVec2;
use quadpixel::response::REJECTION_THRESHOLD;
use quadpixel::svg::Svg;

use super::Kind;
use super::cases::Case;
use super::curve::{Curve, Point};
use quadpixel_generators::plot::{Line, Panel, whole};

const BLUE: &str = "#1f6fd0";
const GREEN: &str = "#2a9d3a";
const RED: &str = "#d1332b";
const GREY: &str = "#666";
/// Half the width of the ratio's panel, deg, as in the paper.
const RATIO_WITHIN_DEG: f64 = 30.0;
/// Ratios above are left out.
const LARGEST_RATIO: f64 = 1.0;

pub(super) fn svg(kind: Kind, cases: &[Case], curves: &[Curve], model: &str) -> String {
    let panels = match kind {
        Kind::Pitch => vec![vec![pitches(cases, curves)]],
        Kind::Microlens => {
            let all: Vec<Panel> = cases
                .iter()
                .zip(curves)
                .map(|(case, curve)| ratios(titled(case, curve), &[(case, curve, RED, "")]))
                .collect();
            rows_of_three(all)
        }
        Kind::Wavelength => columns(cases, curves, &[BLUE, GREEN, RED]),
        Kind::Rejection
        | Kind::Filter
        | Kind::Tungsten
        | Kind::Cra
        | Kind::FlatField
        | Kind::Mosaic
        | Kind::Corrected
        | Kind::Size => columns(cases, curves, &[]),
    };
    let title = format!("{} study, model {model}", kind.name());
    sheet(&title, &panels)
}

/// Rows of panels under a title.
pub(super) fn sheet(title: &str, panels: &[Vec<Panel>]) -> String {
    let widest = panels.iter().map(Vec::len).max().unwrap_or(1);
    let head = 28.0;
    let size = whole() * DVec2::new(widest as f64, panels.len() as f64) + DVec2::new(0.0, head);
    let mut svg = Svg::new(size);
    svg.text(DVec2::new(10.0, 19.0), "start", 13.0, title);
    for (j, row) in panels.iter().enumerate() {
        for (i, panel) in row.iter().enumerate() {
            let corner = whole() * DVec2::new(i as f64, j as f64) + DVec2::new(0.0, head);
            panel.draw(&mut svg, corner);
        }
    }
    svg.finish()
}

fn rows_of_three(panels: Vec<Panel>) -> Vec<Vec<Panel>> {
    let mut rows: Vec<Vec<Panel>> = Vec::new();
    for panel in panels {
        match rows.last_mut().filter(|r| r.len() < 3) {
            Some(row) => row.push(panel),
            None => rows.push(vec![panel]),
        }
    }
    rows
}

/// A column a panel of the study: P on top, the ratio below. `colours` tell cases that share a panel apart.
fn columns(cases: &[Case], curves: &[Curve], colours: &[&'static str]) -> Vec<Vec<Panel>> {
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    let highest = curves.iter().flat_map(|c| &c.points);
    let highest = highest.map(|p| p.left + p.right).fold(0.1, f64::max);
    let count = cases.iter().map(|c| c.panel + 1).max().unwrap_or(0);
    for panel in 0..count {
        let own: Vec<(&Case, &Curve)> = cases
            .iter()
            .zip(curves)
            .filter(|(c, _)| c.panel == panel)
            .collect();
        let Some(&(first, curve)) = own.first() else {
            continue;
        };
        let title = match own[..] {
            [(case, curve)] => titled(case, curve),
            _ if first.centre_deg == 0.0 => "centred lens".to_string(),
            _ => format!("lens shifted for a chief ray at {}°", first.centre_deg),
        };
        let lines = match own[..] {
            [(_, curve)] => vec![
                line("P_A (right)", RED, false, curve, |p| p.right),
                line("P_B (left)", BLUE, false, curve, |p| p.left),
                line("sum", GREY, true, curve, |p| p.left + p.right),
            ],
            _ => own
                .iter()
                .zip(colours)
                .flat_map(|((case, curve), &colour)| {
                    let name = format!("P_A, {} nm (P_B dashed)", case.wavelength_nm);
                    [
                        line(&name, colour, false, curve, |p| p.right),
                        line("", colour, true, curve, |p| p.left),
                    ]
                })
                .collect(),
        };
        let ends = |c: &Curve| {
            let (first, last) = (c.points.first(), c.points.last());
            (
                first.map_or(0.0, |p| p.theta_deg),
                last.map_or(1.0, |p| p.theta_deg),
            )
        };
        upper.push(Panel {
            title: title.clone(),
            x_name: "θ, deg (φ = 0)",
            y_name: "P",
            x: ends(curve),
            // Room for the legend.
            y: (0.0, (highest * 1.45 * 10.0).ceil() / 10.0),
            ticks: (10.0, 0.2),
            decades: false,
            level: None,
            lines,
        });
        let own: Vec<(&Case, &Curve, &'static str, &str)> = own
            .iter()
            .enumerate()
            .map(|(i, &(case, curve))| (case, curve, colours.get(i).copied().unwrap_or(RED), ""))
            .collect();
        lower.push(ratios(title, &own));
    }
    vec![upper, lower]
}

/// The ratio about the chief ray, with the threshold.
fn ratios(title: String, cases: &[(&Case, &Curve, &'static str, &str)]) -> Panel {
    let centre = cases.first().map_or(0.0, |c| c.0.centre_deg);
    let lines = cases.iter().map(|(case, curve, colour, name)| {
        line(name, colour, false, curve, |p| p.ratio(case.centre_deg))
    });
    Panel {
        title,
        x_name: "θ, deg (φ = 0)",
        y_name: "ratio",
        x: (centre - RATIO_WITHIN_DEG, centre + RATIO_WITHIN_DEG),
        y: (0.0, LARGEST_RATIO),
        ticks: (10.0, 0.2),
        decades: false,
        level: Some(REJECTION_THRESHOLD),
        lines: lines.collect(),
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

fn line(
    name: &str,
    colour: &'static str,
    dashed: bool,
    curve: &Curve,
    value: impl Fn(&Point) -> f64,
) -> Line {
    let points = curve.points.iter();
    let points = points.map(|p| DVec2::new(p.theta_deg, value(p)));
    Line {
        name: name.to_owned(),
        colour,
        dashed,
        marks: false,
        points: points.filter(|p| p.is_finite()).collect(),
    }
}

/// R_a and R_b over the pitch; the 3.5 µm pixel as it was optimized is marked.
fn pitches(cases: &[Case], curves: &[Curve]) -> Panel {
    let of = |panel: usize, value: &dyn Fn(&Curve) -> Option<f64>| -> Vec<DVec2> {
        let own = cases.iter().zip(curves).filter(|(c, _)| c.panel == panel);
        own.filter_map(|(c, curve)| Some(DVec2::new(c.stack.pitch_um, value(curve)?)))
            .collect()
    };
    let r_a = |c: &Curve| c.ranges[0].r_a_deg;
    let r_b = |c: &Curve| r_a(c).map(|_| c.ranges[0].r_b_deg);
    let make = |name: &str, colour, marks, points| Line {
        name: name.to_owned(),
        colour,
        dashed: false,
        marks,
        points,
    };
    let mut lines = vec![
        make("R_a", BLUE, false, of(0, &r_a)),
        make("R_b", GREEN, false, of(0, &r_b)),
        make("", BLUE, true, of(0, &r_a)),
        make("", GREEN, true, of(0, &r_b)),
        make("3.5 µm, filter 1 µm", RED, true, of(1, &r_a)),
    ];
    lines.push(make("", RED, true, of(1, &r_b)));
    Panel {
        title: "angular ranges over the pitch".into(),
        x_name: "pitch, µm",
        y_name: "deg",
        x: (1.0, 6.2),
        y: (0.0, 40.0),
        ticks: (1.0, 5.0),
        decades: false,
        level: None,
        lines,
    }
}
