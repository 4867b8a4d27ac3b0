//! Panels with axes and lines, as SVG.

use glam::DVec2;
use quadpixel::svg::Svg;

/// Inside of a panel, px.
pub(super) const SIZE: DVec2 = DVec2::new(300.0, 190.0);
/// Around it, for names and numbers: left, top, right, bottom, px.
const MARGIN: [f64; 4] = [52.0, 26.0, 14.0, 40.0];

/// One line of a panel.
pub(super) struct Line {
    pub name: String,
    pub colour: &'static str,
    pub dashed: bool,
    /// Marks instead of a line.
    pub marks: bool,
    pub points: Vec<DVec2>,
}

/// A coordinate system with lines.
pub(super) struct Panel {
    pub title: String,
    pub x_name: &'static str,
    pub y_name: &'static str,
    pub x: (f64, f64),
    pub y: (f64, f64),
    /// Distance of ticks.
    pub ticks: (f64, f64),
    /// A level to compare with.
    pub level: Option<f64>,
    pub lines: Vec<Line>,
}

/// Place that a panel takes, px.
pub(super) fn whole() -> DVec2 {
    SIZE + DVec2::new(MARGIN[0] + MARGIN[2], MARGIN[1] + MARGIN[3])
}

impl Panel {
    /// Draws the panel with its outer upper left corner at a point.
    pub fn draw(&self, svg: &mut Svg, corner: DVec2) {
        let inner = corner + DVec2::new(MARGIN[0], MARGIN[1]);
        let at = |p: DVec2| {
            let x = (p.x - self.x.0) / (self.x.1 - self.x.0);
            let y = (p.y - self.y.0) / (self.y.1 - self.y.0);
            inner + DVec2::new(x, 1.0 - y) * SIZE
        };
        let along = |(low, high): (f64, f64), tick: f64| {
            let (first, last) = (
                (low / tick - 1e-6).ceil() as i64,
                (high / tick + 1e-6).floor() as i64,
            );
            (first..=last).map(move |i| i as f64 * tick)
        };
        for x in along(self.x, self.ticks.0) {
            let grid = [at(DVec2::new(x, self.y.0)), at(DVec2::new(x, self.y.1))];
            svg.polyline(&grid, "stroke=\"#e4e4e4\"");
            svg.text(grid[0] + DVec2::new(0.0, 14.0), "middle", 11.0, &number(x));
        }
        for y in along(self.y, self.ticks.1) {
            let grid = [at(DVec2::new(self.x.0, y)), at(DVec2::new(self.x.1, y))];
            svg.polyline(&grid, "stroke=\"#e4e4e4\"");
            svg.text(grid[0] + DVec2::new(-6.0, 4.0), "end", 11.0, &number(y));
        }
        if let Some(y) = self.level {
            let line = [at(DVec2::new(self.x.0, y)), at(DVec2::new(self.x.1, y))];
            svg.polyline(&line, "stroke=\"#555\" stroke-dasharray=\"2 3\"");
        }
        for line in &self.lines {
            self.line(svg, line, &at);
        }
        let frame = [
            (self.x.0, self.y.0),
            (self.x.1, self.y.0),
            (self.x.1, self.y.1),
            (self.x.0, self.y.1),
        ];
        let frame = frame.map(|(x, y)| at(DVec2::new(x, y)));
        svg.polygon(&frame, "fill=\"none\" stroke=\"#333\"");
        let middle = inner + DVec2::new(0.5 * SIZE.x, 0.0);
        svg.text(middle - DVec2::new(0.0, 9.0), "middle", 13.0, &self.title);
        svg.text(
            middle + DVec2::new(0.0, SIZE.y + 30.0),
            "middle",
            12.0,
            self.x_name,
        );
        svg.text(
            corner + DVec2::new(4.0, MARGIN[1] - 9.0),
            "start",
            12.0,
            self.y_name,
        );
        self.legend(svg, inner);
    }

    /// The parts of a line that lie in the panel.
    fn line(&self, svg: &mut Svg, line: &Line, at: &dyn Fn(DVec2) -> DVec2) {
        let inside = |p: &DVec2| {
            (self.x.0..=self.x.1).contains(&p.x) && (self.y.0..=self.y.1).contains(&p.y)
        };
        if line.marks {
            let style = format!("fill=\"{}\"", line.colour);
            for p in line.points.iter().filter(|p| inside(p)) {
                svg.circle(at(*p), 4.0, &style);
            }
            return;
        }
        let dashes = if line.dashed {
            " stroke-dasharray=\"6 4\""
        } else {
            ""
        };
        let style = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{dashes}",
            line.colour
        );
        let mut part: Vec<DVec2> = Vec::new();
        for pair in line.points.windows(2) {
            match (inside(&pair[0]), inside(&pair[1])) {
                (true, true) => {
                    if part.is_empty() {
                        part.push(at(pair[0]));
                    }
                    part.push(at(pair[1]));
                }
                (true, false) | (false, true) => {
                    if let Some(edge) = self.meets_edge(pair[0], pair[1]) {
                        let ends = if inside(&pair[0]) {
                            [pair[0], edge]
                        } else {
                            [edge, pair[1]]
                        };
                        if part.is_empty() {
                            part.push(at(ends[0]));
                        }
                        part.push(at(ends[1]));
                    }
                    if inside(&pair[0]) && part.len() > 1 {
                        svg.polyline(&part, &style);
                        part.clear();
                    }
                }
                (false, false) => {}
            }
        }
        if part.len() > 1 {
            svg.polyline(&part, &style);
        }
    }

    /// Where a line crosses the panel's upper or lower edge, one end inside.
    fn meets_edge(&self, a: DVec2, b: DVec2) -> Option<DVec2> {
        let crosses = |y: f64| {
            let t = (y - a.y) / (b.y - a.y);
            ((0.0..=1.0).contains(&t)).then(|| a + t * (b - a))
        };
        [self.y.0, self.y.1].into_iter().find_map(crosses)
    }

    fn legend(&self, svg: &mut Svg, inner: DVec2) {
        let named = self.lines.iter().filter(|l| !l.name.is_empty());
        for (i, line) in named.enumerate() {
            let y = inner.y + 14.0 + 15.0 * i as f64;
            let x = inner.x + SIZE.x - 8.0;
            if line.marks {
                svg.circle(
                    DVec2::new(x - 10.0, y - 4.0),
                    4.0,
                    &format!("fill=\"{}\"", line.colour),
                );
            } else {
                let dashes = if line.dashed {
                    " stroke-dasharray=\"6 4\""
                } else {
                    ""
                };
                let style = format!("stroke=\"{}\" stroke-width=\"1.6\"{dashes}", line.colour);
                svg.polyline(
                    &[DVec2::new(x - 22.0, y - 4.0), DVec2::new(x, y - 4.0)],
                    &style,
                );
            }
            svg.text(DVec2::new(x - 28.0, y), "end", 11.0, &line.name);
        }
    }
}

/// A tick's number without needless zeros.
fn number(x: f64) -> String {
    format!("{}", (x * 1e6).round() / 1e6)
}
