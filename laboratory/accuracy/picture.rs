//! Tables as pictures: error over time, both logarithmic, a line a curve.

use glam::DVec2;
use quadpixel::svg::Svg;

use super::row::{Curve, Row, Table};
use quadpixel_generators::plot::{Line, Panel, whole};

const COLOURS: [&str; 6] = [
    "#1f6fd0", "#d1332b", "#2a9d3a", "#8a4fc0", "#c77d0a", "#666",
];
const GREY: &str = "#999";
/// Panels side by side.
const COLUMNS: usize = 3;
/// Room for the title, px.
const HEAD: f64 = 28.0;

/// All tables, three a row. Rows without time or error (the exact ones) have no place on logarithmic axes and are left out.
pub fn svg(title: &str, tables: &[Table]) -> String {
    let columns = tables.len().clamp(1, COLUMNS);
    let rows = tables.len().div_ceil(columns);
    let mut svg =
        Svg::new(whole() * DVec2::new(columns as f64, rows as f64) + DVec2::new(0.0, HEAD));
    svg.text(DVec2::new(10.0, 19.0), "start", 13.0, title);
    for (i, table) in tables.iter().enumerate() {
        let at = DVec2::new((i % columns) as f64, (i / columns) as f64);
        panel(table).draw(&mut svg, whole() * at + DVec2::new(0.0, HEAD));
    }
    svg.finish()
}

fn panel(table: &Table) -> Panel {
    let places: Vec<Vec<DVec2>> = table.curves.iter().map(places).collect();
    let all: Vec<DVec2> = places.iter().flatten().copied().collect();
    let (x, y) = (decades(&all, |p| p.x), decades(&all, |p| p.y));
    let mut lines = Vec::new();
    for (i, (curve, points)) in table.curves.iter().zip(places).enumerate() {
        let line = |name: String, marks: bool, points: Vec<DVec2>| Line {
            name,
            colour: COLOURS[i % COLOURS.len()],
            dashed: false,
            marks,
            points,
        };
        if let (Some(power), Some(&first)) = (table.law, points.first()) {
            let end = DVec2::new(x.1, first.y + power * (x.1 - first.x));
            lines.push(Line {
                dashed: true,
                colour: GREY,
                ..line(String::new(), false, vec![first, end])
            });
        }
        if points.len() > 1 {
            lines.push(line(curve.name.clone(), false, points.clone()));
            lines.push(line(String::new(), true, points));
        } else {
            lines.push(line(curve.name.clone(), true, points));
        }
    }
    Panel {
        title: table.knob.to_owned(),
        x_name: table.seconds_unit,
        y_name: table.error_unit,
        x,
        y,
        ticks: (1.0, 1.0),
        decades: true,
        level: None,
        lines,
    }
}

/// The rows that have logarithms.
fn places(curve: &Curve) -> Vec<DVec2> {
    let place = |r: &Row| DVec2::new(r.seconds.log10(), r.error.log10());
    curve
        .rows
        .iter()
        .map(place)
        .filter(|p| p.is_finite())
        .collect()
}

/// Whole powers of ten around all places.
fn decades(all: &[DVec2], of: impl Fn(&DVec2) -> f64) -> (f64, f64) {
    let low = all.iter().map(&of).fold(f64::INFINITY, f64::min).floor();
    let high = all.iter().map(&of).fold(f64::NEG_INFINITY, f64::max).ceil();
    if low.is_finite() && high.is_finite() {
        (low, high.max(low + 1.0))
    } else {
        (0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_whole_decades_around_the_rows() {
        let at = |x: f64, y: f64| DVec2::new(x, y);
        let all = [at(-1.5, 0.2), at(0.3, 1.0)];
        assert_eq!(decades(&all, |p| p.x), (-2.0, 1.0));
        assert_eq!(decades(&all, |p| p.y), (0.0, 1.0));
        assert_eq!(decades(&[at(2.0, 2.0)], |p| p.x), (2.0, 3.0));
        assert_eq!(decades(&[], |p| p.x), (0.0, 1.0));
    }
}
