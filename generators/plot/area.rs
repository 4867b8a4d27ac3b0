//! What is drawn between the axes of a chart.

use glam::DVec2;

use super::clip::visible;
use super::{Bar, Chart, MARGIN_PX, Series, Svg};

const GRID: &str = "stroke=\"#e4e4e4\"";
const BAR: &str = "fill=\"#4c78a8\"";

/// A chart's inside on the picture. Places run from 0 to 1 along both axes.
pub(super) struct Area<'a> {
    pub chart: &'a Chart,
    pub corner: DVec2,
}

impl Area<'_> {
    fn place(&self, point: DVec2) -> DVec2 {
        DVec2::new(self.chart.x.place(point.x), self.chart.y.place(point.y))
    }

    fn px(&self, place: DVec2) -> DVec2 {
        self.corner + DVec2::new(place.x, 1.0 - place.y) * self.chart.inside_px
    }

    pub fn line(&self, svg: &mut Svg, places: &[DVec2], style: &str) {
        let points: Vec<DVec2> = places.iter().map(|p| self.px(*p)).collect();
        svg.polyline(&points, style);
    }

    pub fn grid(&self, svg: &mut Svg) {
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

    pub fn bar(&self, svg: &mut Svg, bar: &Bar) {
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
    pub fn series(&self, svg: &mut Svg, series: &Series) {
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
    pub fn names(&self, svg: &mut Svg) {
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
    pub fn legend(&self, svg: &mut Svg) {
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
