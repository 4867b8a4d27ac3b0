//! Charts as SVG: axes with ticks, lines, marks, bars and guides, one chart or several on a sheet.
//!
//! Written by hand, not with a crate: the pictures need no more than lines, circles, areas and text.

mod area;
mod axis;
mod clip;
mod svg;

pub use axis::{Axis, round_length};
pub use svg::Svg;

use glam::DVec2;

use area::Area;

/// Inside of a chart, px, where its maker does not say.
const INSIDE_PX: DVec2 = DVec2::new(300.0, 190.0);
/// Around it, for names and numbers: left, top, right, bottom, px.
const MARGIN_PX: [f64; 4] = [52.0, 26.0, 14.0, 40.0];
/// Height of a sheet's title, px.
const HEAD_PX: f64 = 28.0;
const GUIDE: &str = "stroke=\"#555\" stroke-dasharray=\"2 3\"";

/// How points are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stroke {
    None,
    Solid,
    Dashed,
}

/// Points of one kind: a line, marks, or both.
#[derive(Clone, Debug)]
pub struct Series {
    name: String,
    colour: &'static str,
    stroke: Stroke,
    mark_radius_px: f64,
    labels: Vec<String>,
    points: Vec<DVec2>,
}

impl Series {
    /// A line through points, in the units of the axes; `name` stands in the legend unless it is empty.
    pub fn line(name: impl Into<String>, colour: &'static str, points: Vec<DVec2>) -> Series {
        Series {
            name: name.into(),
            colour,
            stroke: Stroke::Solid,
            mark_radius_px: 0.0,
            labels: Vec::new(),
            points,
        }
    }

    /// Marks without a line.
    pub fn marks(name: impl Into<String>, colour: &'static str, points: Vec<DVec2>) -> Series {
        let line = Series::line(name, colour, points);
        Series {
            stroke: Stroke::None,
            ..line.marked(4.0)
        }
    }

    /// The line dashed.
    pub fn dashed(self) -> Series {
        let stroke = Stroke::Dashed;
        Series { stroke, ..self }
    }

    /// The line with a mark at each point.
    pub fn marked(self, mark_radius_px: f64) -> Series {
        Series {
            mark_radius_px,
            ..self
        }
    }

    /// A text beside each mark, in the order of the points.
    pub fn labelled(self, labels: Vec<String>) -> Series {
        Series { labels, ..self }
    }

    /// The points, in the units of the axes.
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// The largest value on the y axis; −∞ without points.
    pub fn highest(&self) -> f64 {
        let values = self.points.iter().map(|p| p.y);
        values.fold(f64::NEG_INFINITY, f64::max)
    }

    fn stroke_style(&self) -> Option<String> {
        let dashes = match self.stroke {
            Stroke::None => return None,
            Stroke::Solid => "",
            Stroke::Dashed => " stroke-dasharray=\"6 4\"",
        };
        let colour = self.colour;
        Some(format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dashes}"
        ))
    }

    fn fill_style(&self) -> String {
        format!("fill=\"{}\"", self.colour)
    }
}

/// A dotted line across the chart, to compare with.
#[derive(Clone, Copy, Debug)]
pub enum Guide {
    /// At one value of the x axis.
    X(f64),
    /// At one value of the y axis.
    Y(f64),
}

/// A bar that stands on the x axis.
#[derive(Clone, Copy, Debug)]
pub struct Bar {
    /// Ends on the x axis.
    pub x: (f64, f64),
    /// Its upper end on the y axis.
    pub height: f64,
}

/// Two axes and what is drawn between them.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Above the chart.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// Between the axes, px.
    pub inside_px: DVec2,
    /// Lines to compare with.
    pub guides: Vec<Guide>,
    /// Drawn first.
    pub bars: Vec<Bar>,
    /// Drawn one over the other.
    pub series: Vec<Series>,
}

impl Chart {
    /// A chart of series, of the usual size.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Chart {
        Chart {
            title: title.into(),
            x,
            y,
            inside_px: INSIDE_PX,
            guides: Vec::new(),
            bars: Vec::new(),
            series,
        }
    }

    /// The chart with its margins, px.
    fn size_px(&self) -> DVec2 {
        let [left, top, right, bottom] = MARGIN_PX;
        self.inside_px + DVec2::new(left + right, top + bottom)
    }

    /// Draws the chart with its outer upper left corner at a point.
    pub fn draw(&self, svg: &mut Svg, corner: DVec2) {
        let area = Area {
            chart: self,
            corner: corner + DVec2::new(MARGIN_PX[0], MARGIN_PX[1]),
        };
        area.grid(svg);
        for bar in &self.bars {
            area.bar(svg, bar);
        }
        for guide in &self.guides {
            let ends = match *guide {
                Guide::X(x) => [(self.x.place(x), 0.0), (self.x.place(x), 1.0)],
                Guide::Y(y) => [(0.0, self.y.place(y)), (1.0, self.y.place(y))],
            };
            area.line(svg, &ends.map(DVec2::from), GUIDE);
        }
        for series in &self.series {
            area.series(svg, series);
        }
        area.names(svg);
        area.legend(svg);
    }
}

/// Charts in rows under a title, as a file's text.
pub fn sheet(title: &str, rows: &[Vec<Chart>]) -> String {
    let height = |row: &[Chart]| row.iter().map(|c| c.size_px().y).fold(0.0, f64::max);
    let width = |row: &Vec<Chart>| row.iter().map(|c| c.size_px().x).sum();
    let head_px = if title.is_empty() { 0.0 } else { HEAD_PX };
    let size_px = DVec2::new(
        rows.iter().map(width).fold(0.0, f64::max),
        head_px + rows.iter().map(|row| height(row)).sum::<f64>(),
    );
    let mut svg = Svg::new(size_px);
    svg.text(DVec2::new(10.0, 19.0), "start", 13.0, title);
    let mut corner = DVec2::new(0.0, head_px);
    for row in rows {
        for chart in row {
            chart.draw(&mut svg, corner);
            corner.x += chart.size_px().x;
        }
        corner = DVec2::new(0.0, corner.y + height(row));
    }
    svg.finish()
}

/// Charts in rows of `columns`.
pub fn in_rows(charts: Vec<Chart>, columns: usize) -> Vec<Vec<Chart>> {
    let rows = charts.chunks(columns.max(1));
    rows.map(<[Chart]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_logarithm_is_left_out_and_text_is_escaped() {
        let points = [(0.1, 8.0), (0.4, 4.0), (9.0, 0.0)].map(DVec2::from);
        let axes = [
            Axis::decades("s", [0.1, 9.0]),
            Axis::decades("%", [4.0, 8.0]),
        ];
        let [x, y] = axes;
        let line = Series::line("a < b", "#111", points.to_vec()).marked(2.0);
        let text = sheet("", &[vec![Chart::new("t", x, y, vec![line])]]);
        assert_eq!(text.matches("<circle").count(), 2);
        assert!(text.contains("a &lt; b") && !text.contains("NaN") && !text.contains("inf"));
    }
}
