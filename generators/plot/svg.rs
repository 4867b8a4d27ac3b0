//! Just enough SVG: lines, areas, circles and text, in pixels from the upper left corner.

use std::fmt::Write;

use glam::DVec2;

/// A picture being drawn.
pub struct Svg {
    size: DVec2,
    body: String,
}

impl Svg {
    /// An empty white picture.
    pub fn new(size: DVec2) -> Svg {
        Svg {
            size,
            body: String::new(),
        }
    }

    /// An open line through points; `style` is SVG attributes.
    pub fn polyline(&mut self, points: &[DVec2], style: &str) {
        self.shape("polyline", points, style);
    }

    /// A closed area.
    pub fn polygon(&mut self, points: &[DVec2], style: &str) {
        self.shape("polygon", points, style);
    }

    fn shape(&mut self, name: &str, points: &[DVec2], style: &str) {
        let list: Vec<String> = points
            .iter()
            .map(|p| format!("{:.2},{:.2}", p.x, p.y))
            .collect();
        let list = list.join(" ");
        self.push(format_args!("<{name} points=\"{list}\" {style}/>"));
    }

    /// A circle.
    pub fn circle(&mut self, centre: DVec2, radius: f64, style: &str) {
        let DVec2 { x, y } = centre;
        self.push(format_args!(
            "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" {style}/>"
        ));
    }

    /// A line of text whose baseline starts (`anchor` start), is centred (middle) or ends (end) at a point.
    pub fn text(&mut self, at: DVec2, anchor: &str, size: f64, text: &str) {
        let escaped = text
            .replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('>', "&gt;");
        let DVec2 { x, y } = at;
        self.push(format_args!(
            "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\" font-size=\"{size}\" fill=\"#333\">{escaped}</text>"
        ));
    }

    fn push(&mut self, element: std::fmt::Arguments) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.body, "{element}");
    }

    /// The picture as a file's text.
    pub fn finish(self) -> String {
        let DVec2 { x, y } = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{x:.0}\" height=\"{y:.0}\" viewBox=\"0 0 {x:.0} {y:.0}\" \
             font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }
}
