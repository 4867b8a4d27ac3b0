//! Charts as SVG: axes with ticks, lines, marks, bars and guides, one chart or several on a sheet.
//!
//! Written by hand, not with a crate: the pictures need no more than lines, circles, areas and text.

mod axis;
mod svg;

pub use axis::{Axis, round_length};
pub use svg::Svg;

use glam::DVec2;

/// Inside of a chart, px, where its maker does not say.
const INSIDE_PX: DVec2 = DVec2::new(300.0, 190.0);
/// Around it, for names and numbers: left, top, right, bottom, px.
const MARGIN_PX: [f64; 4] = [52.0, 26.0, 14.0, 40.0];
/// Height of a sheet's title, px.
const HEAD_PX: f64 = 28.0;
const GRID: &str = "stroke=\"#e4e4e4\"";
const GUIDE: &str = "stroke=\"#555\" stroke-dasharray=\"2 3\"";
const BAR: &str = "fill=\"#4c78a8\"";

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

/// A chart's inside on the picture. Places run from 0 to 1 along both axes.
struct Area<'a> {
    chart: &'a Chart,
    corner: DVec2,
}

impl Area<'_> {
    fn place(&self, point: DVec2) -> DVec2 {
        DVec2::new(self.chart.x.place(point.x), self.chart.y.place(point.y))
    }

    fn px(&self, place: DVec2) -> DVec2 {
        self.corner + DVec2::new(place.x, 1.0 - place.y) * self.chart.inside_px
    }

    fn line(&self, svg: &mut Svg, places: &[DVec2], style: &str) {
        let points: Vec<DVec2> = places.iter().map(|p| self.px(*p)).collect();
        svg.polyline(&points, style);
    }

    fn grid(&self, svg: &mut Svg) {
        for (x, label) in self.chart.x.ticks() {
            let foot = DVec2::new(x, 0.0);
            self.line(svg, &[foot, DVec2::new(x, 1.0)], GRID);
            svg.text(
                self.px(foot) + DVec2::new(0.0, 14.0),
                "middle",
                11.0,
                &label,
            );
        }
        for (y, label) in self.chart.y.ticks() {
            let foot = DVec2::new(0.0, y);
            self.line(svg, &[foot, DVec2::new(1.0, y)], GRID);
            svg.text(self.px(foot) + DVec2::new(-6.0, 4.0), "end", 11.0, &label);
        }
    }

    fn bar(&self, svg: &mut Svg, bar: &Bar) {
        let (from, to) = (self.chart.x.place(bar.x.0), self.chart.x.place(bar.x.1));
        let top = self.chart.y.place(bar.height);
        let corners = [(from, 0.0), (from, top), (to, top), (to, 0.0)];
        // A gap of one pixel parts neighbours.
        let inset = [0.5, 0.5, -0.5, -0.5].map(|x| DVec2::new(x, 0.0));
        let corners: Vec<DVec2> = corners
            .into_iter()
            .zip(inset)
            .map(|(place, inset)| self.px(place.into()) + inset)
            .collect();
        svg.polygon(&corners, BAR);
    }

    /// The parts of a series that lie in the chart.
    fn series(&self, svg: &mut Svg, series: &Series) {
        let places: Vec<DVec2> = series.points.iter().map(|p| self.place(*p)).collect();
        if let Some(style) = series.stroke_style() {
            for part in visible(&places) {
                self.line(svg, &part, &style);
            }
        }
        if series.mark_radius_px == 0.0 {
            return;
        }
        let unit = 0.0..=1.0;
        for (i, place) in places.iter().enumerate() {
            if !(unit.contains(&place.x) && unit.contains(&place.y)) {
                continue;
            }
            let centre = self.px(*place);
            svg.circle(centre, series.mark_radius_px, &series.fill_style());
            if let Some(label) = series.labels.get(i) {
                svg.text(centre + DVec2::new(-7.0, 14.0), "end", 10.0, label);
            }
        }
    }

    /// Frame, title and the axes' names.
    fn names(&self, svg: &mut Svg) {
        let frame = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y].map(|p| self.px(p));
        svg.polygon(&frame, "fill=\"none\" stroke=\"#333\"");
        let inside_px = self.chart.inside_px;
        let middle = self.corner + DVec2::new(0.5 * inside_px.x, 0.0);
        let title = middle - DVec2::new(0.0, 9.0);
        svg.text(title, "middle", 13.0, &self.chart.title);
        let below = middle + DVec2::new(0.0, inside_px.y + 30.0);
        svg.text(below, "middle", 12.0, self.chart.x.name());
        let above = self.corner - DVec2::new(MARGIN_PX[0] - 4.0, 9.0);
        svg.text(above, "start", 12.0, self.chart.y.name());
    }

    /// The names of the series, in the upper right corner.
    fn legend(&self, svg: &mut Svg) {
        let named = self.chart.series.iter().filter(|s| !s.name.is_empty());
        for (i, series) in named.enumerate() {
            let end =
                self.corner + DVec2::new(self.chart.inside_px.x - 8.0, 10.0 + 15.0 * i as f64);
            match series.stroke_style() {
                Some(style) => svg.polyline(&[end - DVec2::new(22.0, 0.0), end], &style),
                None => svg.circle(end - DVec2::new(10.0, 0.0), 4.0, &series.fill_style()),
            }
            svg.text(end + DVec2::new(-28.0, 4.0), "end", 11.0, &series.name);
        }
    }
}

/// The parts of a line of places that lie within the unit square. Places that are no numbers part it.
fn visible(places: &[DVec2]) -> Vec<Vec<DVec2>> {
    let mut parts: Vec<Vec<DVec2>> = Vec::new();
    for pair in places.windows(2) {
        let Some([from, to]) = clipped(pair[0], pair[1]) else {
            continue;
        };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&from) => part.push(to),
            _ => parts.push(vec![from, to]),
        }
    }
    parts
}

/// The part of a segment inside the unit square (Liang and Barsky).
fn clipped(a: DVec2, b: DVec2) -> Option<[DVec2; 2]> {
    if !(a.is_finite() && b.is_finite()) {
        return None;
    }
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, end) in [(a.x, b.x), (a.y, b.y)] {
        let way = end - start;
        if way == 0.0 {
            if !(0.0..=1.0).contains(&start) {
                return None;
            }
            continue;
        }
        let (enters, leaves) = (-start / way, (1.0 - start) / way);
        from = from.max(enters.min(leaves));
        to = to.min(enters.max(leaves));
    }
    // The ends themselves, to the bit: neighbouring segments meet there.
    let point = |t: f64| match t {
        0.0 => a,
        1.0 => b,
        _ => a + t * (b - a),
    };
    (from < to).then(|| [point(from), point(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_cut_at_the_charts_edges() {
        let cut = |a: (f64, f64), b: (f64, f64)| clipped(a.into(), b.into());
        let made = |a: (f64, f64), b: (f64, f64)| Some([a.into(), b.into()]);
        assert_eq!(
            cut((0.25, 0.25), (0.5, 0.75)),
            made((0.25, 0.25), (0.5, 0.75))
        );
        // Out by the side, through the top, and right across a corner.
        assert_eq!(
            cut((0.75, 0.5), (1.25, 1.0)),
            made((0.75, 0.5), (1.0, 0.75))
        );
        assert_eq!(
            cut((0.25, 0.5), (0.5, 1.5)),
            made((0.25, 0.5), (0.375, 1.0))
        );
        assert_eq!(cut((-1.0, 0.0), (1.0, 2.0)), None);
        assert_eq!(cut((1.25, 0.5), (1.5, 0.5)), None);
        assert_eq!(cut((0.25, 2.0), (0.75, 1.5)), None);
    }

    #[test]
    fn a_line_that_leaves_the_chart_comes_back_as_another_part() {
        let places = [
            (0.0, 0.5),
            (0.25, 1.5),
            (0.5, 0.5),
            (0.75, 0.5),
            (f64::NAN, 0.5),
        ];
        let parts = visible(&places.map(DVec2::from));
        let counts: Vec<usize> = parts.iter().map(Vec::len).collect();
        assert_eq!(counts, [2, 3]);
    }

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
