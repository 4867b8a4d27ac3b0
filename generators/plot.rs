//! Panels with axes and lines, as SVG: the pictures of studies and of accuracy.

use glam::DVec2;
use quadpixel::svg::Svg;

/// Inside of a panel, px.
const SIZE: DVec2 = DVec2::new(300.0, 190.0);
/// Around it, for names and numbers: left, top, right, bottom, px.
const MARGIN: [f64; 4] = [52.0, 26.0, 14.0, 40.0];

/// One line of a panel.
pub struct Line {
    /// In the legend; empty: not there.
    pub name: String,
    /// SVG colour.
    pub colour: &'static str,
    /// Dashed, not drawn through.
    pub dashed: bool,
    /// Marks instead of a line.
    pub marks: bool,
    /// In the panel's coordinates.
    pub points: Vec<DVec2>,
}

/// A coordinate system with lines.
pub struct Panel {
    /// Above the panel.
    pub title: String,
    /// Below the x axis.
    pub x_name: &'static str,
    /// Above the y axis.
    pub y_name: &'static str,
    /// Ends of the x axis.
    pub x: (f64, f64),
    /// Ends of the y axis.
    pub y: (f64, f64),
    /// Distance of ticks.
    pub ticks: (f64, f64),
    /// Coordinates are logarithms to the base 10, and ticks say what they are of.
    pub decades: bool,
    /// A level to compare with.
    pub level: Option<f64>,
    /// What is drawn.
    pub lines: Vec<Line>,
}

/// Place that a panel takes, px.
pub fn whole() -> DVec2 {
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
            svg.text(
                grid[0] + DVec2::new(0.0, 14.0),
                "middle",
                11.0,
                &self.number(x),
            );
        }
        for y in along(self.y, self.ticks.1) {
            let grid = [at(DVec2::new(self.x.0, y)), at(DVec2::new(self.x.1, y))];
            svg.polyline(&grid, "stroke=\"#e4e4e4\"");
            svg.text(
                grid[0] + DVec2::new(-6.0, 4.0),
                "end",
                11.0,
                &self.number(y),
            );
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

    /// A tick's number without needless zeros.
    fn number(&self, x: f64) -> String {
        match self.decades {
            true if (-3.0..=3.0).contains(&x) => format!("{}", 10f64.powi(x as i32)),
            true => format!("1e{x}"),
            false => format!("{}", (x * 1e6).round() / 1e6),
        }
    }

    /// The parts of a line that lie in the panel.
    fn line(&self, svg: &mut Svg, line: &Line, at: &dyn Fn(DVec2) -> DVec2) {
        if line.marks {
            let style = format!("fill=\"{}\"", line.colour);
            let inside = |p: &DVec2| {
                (self.x.0..=self.x.1).contains(&p.x) && (self.y.0..=self.y.1).contains(&p.y)
            };
            for p in line.points.iter().filter(|p| inside(p)) {
                svg.circle(at(*p), 4.0, &style);
            }
            return;
        }
        let style = line.style();
        let mut part: Vec<DVec2> = Vec::new();
        for pair in line.points.windows(2) {
            let Some([from, to]) = self.clipped(pair[0], pair[1]) else {
                continue;
            };
            if part.last() != Some(&from) {
                drawn(svg, &mut part, &style, at);
                part.push(from);
            }
            part.push(to);
        }
        drawn(svg, &mut part, &style, at);
    }

    /// The part of a segment inside the panel (Liang and Barsky).
    fn clipped(&self, a: DVec2, b: DVec2) -> Option<[DVec2; 2]> {
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for (start, end, (low, high)) in [(a.x, b.x, self.x), (a.y, b.y, self.y)] {
            let way = end - start;
            if way == 0.0 {
                if !(low..=high).contains(&start) {
                    return None;
                }
                continue;
            }
            let (enters, leaves) = ((low - start) / way, (high - start) / way);
            from = from.max(enters.min(leaves));
            to = to.min(enters.max(leaves));
        }
        let whole = |t: f64| match t {
            0.0 => a,
            1.0 => b,
            _ => a + t * (b - a),
        };
        (from < to).then(|| [whole(from), whole(to)])
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
                let style = line.style();
                svg.polyline(
                    &[DVec2::new(x - 22.0, y - 4.0), DVec2::new(x, y - 4.0)],
                    &style,
                );
            }
            svg.text(DVec2::new(x - 28.0, y), "end", 11.0, &line.name);
        }
    }
}

impl Line {
    fn style(&self) -> String {
        let dashes = if self.dashed {
            " stroke-dasharray=\"6 4\""
        } else {
            ""
        };
        let colour = self.colour;
        format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dashes}")
    }
}

/// Draws what was gathered, and forgets it.
fn drawn(svg: &mut Svg, part: &mut Vec<DVec2>, style: &str, at: &dyn Fn(DVec2) -> DVec2) {
    if part.len() > 1 {
        let points: Vec<DVec2> = part.iter().map(|p| at(*p)).collect();
        svg.polyline(&points, style);
    }
    part.clear();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_cut_at_the_panels_edges() {
        let panel = Panel {
            title: String::new(),
            x_name: "",
            y_name: "",
            x: (0.0, 4.0),
            y: (0.0, 1.0),
            ticks: (1.0, 1.0),
            decades: false,
            level: None,
            lines: Vec::new(),
        };
        let cut = |a: (f64, f64), b: (f64, f64)| panel.clipped(a.into(), b.into());
        let made = |a: (f64, f64), b: (f64, f64)| Some([a.into(), b.into()]);
        assert_eq!(
            cut((1.0, 0.25), (2.0, 0.75)),
            made((1.0, 0.25), (2.0, 0.75))
        );
        // Out by the side, through the top, and right across a corner.
        assert_eq!(cut((3.0, 0.5), (5.0, 1.0)), made((3.0, 0.5), (4.0, 0.75)));
        assert_eq!(cut((1.0, 0.5), (2.0, 1.5)), made((1.0, 0.5), (1.5, 1.0)));
        assert_eq!(cut((-1.0, 0.0), (1.0, 2.0)), None);
        assert_eq!(cut((5.0, 0.5), (6.0, 0.5)), None);
        assert_eq!(cut((1.0, 2.0), (3.0, 2.0)), None);
    }
}
