//! Tables as pictures: error over time, both logarithmic, a line per curve.

use glam::DVec2;
use quadpixel_generators::plot::{Axis, Chart, Series, in_rows, sheet};

use super::row::{Row, Table};

const COLOURS: [&str; 6] = [
    "#1f6fd0", "#d1332b", "#2a9d3a", "#8a4fc0", "#c77d0a", "#666",
];
const GREY: &str = "#999";
const MARK_RADIUS_PX: f64 = 4.0;
/// Charts side by side.
const COLUMNS: usize = 3;

/// All tables, three per row. Rows without time or error (the exact ones) have no place on logarithmic axes and are
/// left out.
pub fn svg(title: &str, tables: &[Table]) -> String {
    sheet(title, &in_rows(tables.iter().map(chart).collect(), COLUMNS))
}

fn chart(table: &Table) -> Chart {
    let drawn = |r: &&Row| r.seconds > 0.0 && r.error > 0.0 && r.seconds.is_finite();
    let points: Vec<Vec<DVec2>> = table
        .curves
        .iter()
        .map(|curve| {
            let rows = curve.rows.iter().filter(drawn);
            rows.map(|r| DVec2::new(r.seconds, r.error)).collect()
        })
        .collect();
    let all = points.iter().flatten();
    let x = Axis::decades(table.seconds_unit, all.clone().map(|p| p.x));
    let y = Axis::decades(table.error_unit, all.map(|p| p.y));
    let mut series = Vec::new();
    for (i, (curve, points)) in table.curves.iter().zip(points).enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        if let (Some(power), Some(&first)) = (table.law, points.first()) {
            let end = DVec2::new(x.high(), first.y * (x.high() / first.x).powf(power));
            series.push(Series::line("", GREY, vec![first, end]).dashed());
        }
        series.push(if points.len() > 1 {
            Series::line(&curve.name, colour, points).marked(MARK_RADIUS_PX)
        } else {
            Series::marks(&curve.name, colour, points)
        });
    }
    Chart::new(table.knob, x, y, series)
}
