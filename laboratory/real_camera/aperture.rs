//! The shift between the views as a part of the circle of confusion, against the F-number.
//!
//! A sharp split gives the same part at every F-number (0.42 of half disks, if nothing else); a response that changes smoothly with the
//! angle gives less the narrower the cone is.

use glam::DVec2;
use quadpixel::command::CommandError;
use quadpixel::render::truth::{Defocus, ReceptiveField, TextureSpectrum};
use quadpixel::svg::Svg;

use crate::camera::{self, Model};
use crate::measure::GREEN;

/// F-numbers of the curves.
pub const MARKS: [f64; 10] = [1.8, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 14.0, 16.0, 20.0];
const RAYS: usize = 1024;

/// One point: F-number, and shift over circle of confusion.
pub type Point = (f64, f64);

/// Shift over circle of confusion on the axis, as a matcher finds it, for a point `distance_mm` from the sensor.
pub fn simulated(lens: &str, model: &Model, distance_mm: f64) -> Result<Vec<Point>, CommandError> {
    let at = |&mark: &f64| {
        let lens = camera::lens(lens, mark, camera::FOCUS_MM)?;
        let camera = camera::camera(&lens, model, (768, 512))?;
        let depth_mm = distance_mm - camera.sensor_z_mm();
        let dark = || CommandError::failed("no light reaches the middle of the sensor");
        let field = ReceptiveField::new(&camera, GREEN, DVec2::ZERO, RAYS).ok_or_else(dark)?;
        let coc = Defocus::new(&camera)
            .ok_or_else(dark)?
            .circle_of_confusion_mm(depth_mm);
        let shift_px = field.matched_shift_px(depth_mm, [0, 1], &TextureSpectrum::default());
        Ok((mark, -shift_px * camera.sensor().pitch_mm() / coc))
    };
    MARKS.iter().map(at).collect()
}

/// Both axes are logarithmic.
pub fn plot(curves: &[(&str, &str, &[Point])], measured: &[(String, Point)]) -> String {
    const SIZE: DVec2 = DVec2::new(560.0, 360.0);
    const CORNER: DVec2 = DVec2::new(70.0, 30.0);
    let (x_range, y_range) = ((1.7f64, 22.0f64), (0.005f64, 0.6f64));
    let at = |(f, part): Point| {
        let along = |v: f64, (low, high): (f64, f64)| (v / low).ln() / (high / low).ln();
        let part = part.max(y_range.0);
        CORNER + DVec2::new(along(f, x_range), 1.0 - along(part, y_range)) * SIZE
    };
    let mut svg = Svg::new(SIZE + DVec2::new(100.0, 90.0));
    for f in [1.8, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 20.0] {
        let line = [at((f, y_range.0)), at((f, y_range.1))];
        svg.polyline(&line, "stroke=\"#e4e4e4\"");
        svg.text(
            line[0] + DVec2::new(0.0, 16.0),
            "middle",
            11.0,
            &format!("F/{f}"),
        );
    }
    for part in [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5] {
        let line = [at((x_range.0, part)), at((x_range.1, part))];
        svg.polyline(&line, "stroke=\"#e4e4e4\"");
        svg.text(
            line[0] + DVec2::new(-6.0, 4.0),
            "end",
            11.0,
            &format!("{part}"),
        );
    }
    for (i, (name, colour, points)) in curves.iter().enumerate() {
        let style = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"");
        let line: Vec<DVec2> = points.iter().map(|p| at(*p)).collect();
        svg.polyline(&line, &style);
        let legend = CORNER + DVec2::new(14.0, SIZE.y - 16.0 - 17.0 * i as f64);
        svg.polyline(&[legend, legend + DVec2::new(24.0, 0.0)], &style);
        svg.text(legend + DVec2::new(30.0, 4.0), "start", 12.0, name);
    }
    for (name, point) in measured {
        svg.circle(at(*point), 4.5, "fill=\"#c0392b\"");
        svg.text(at(*point) + DVec2::new(-7.0, 14.0), "end", 10.0, name);
    }
    svg.text(
        CORNER + DVec2::new(0.0, -12.0),
        "start",
        13.0,
        "left-right shift / circle of confusion, middle of the picture (dots: measured)",
    );
    svg.finish()
}
