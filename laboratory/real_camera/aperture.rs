//! The shift between the views as a part of the circle of confusion, against the F-number.
//!
//! A sharp split gives the same part at every F-number (0.42 of half disks, if nothing else); a response that changes
//! smoothly with the angle gives less the narrower the cone is.

use glam::DVec2;
use quadpixel::render::truth::{Defocus, ReceptiveField, TextureSpectrum};
use quadpixel_generators::plot::{Axis, Chart, Series, sheet};
use std::error::Error;

use crate::camera::{self, Model};
use crate::measure::GREEN;

/// F-numbers of the curves.
pub const MARKS: [f64; 10] = [1.8, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 14.0, 16.0, 20.0];
const RAYS: usize = 1024;

/// One point: F-number, and shift over circle of confusion.
pub type Point = (f64, f64);

/// Shift over circle of confusion on the axis, as a matcher finds it, for a point `distance_mm` from the sensor.
pub fn simulated(
    lens: &str,
    model: &Model,
    distance_mm: f64,
) -> Result<Vec<Point>, Box<dyn Error>> {
    let at = |&mark: &f64| {
        let lens = camera::lens(lens, mark, camera::FOCUS_MM)?;
        let camera = camera::camera(&lens, model, (768, 512))?;
        let depth_mm = distance_mm - camera.sensor_z_mm();
        let dark = || "no light reaches the middle of the sensor";
        let field = ReceptiveField::new(&camera, GREEN, DVec2::ZERO, RAYS).ok_or_else(dark)?;
        let coc = Defocus::new(&camera)
            .ok_or_else(dark)?
            .circle_of_confusion_mm(depth_mm);
        let shift_px = field.matched_shift_px(depth_mm, [0, 1], &TextureSpectrum::default());
        Ok((mark, -shift_px * camera.sensor().pitch_mm() / coc))
    };
    MARKS.iter().map(at).collect()
}

/// Both axes are logarithmic; curves by name and colour, and points measured by name.
pub fn plot(curves: &[(&str, &'static str, &[Point])], measured: &[(String, Point)]) -> String {
    let ticks = |values: &[f64], prefix: &str| {
        let labelled = values.iter().map(|v| (*v, format!("{prefix}{v}")));
        labelled.collect::<Vec<_>>()
    };
    let f_numbers = ticks(&[1.8, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 20.0], "F/");
    let parts = ticks(&[0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5], "");
    // The upper end leaves room for the legend.
    let (x_ends, y_ends) = ((1.7, 22.0), (0.005, 2.0));
    let point = |p: &Point| DVec2::new(p.0, p.1.max(y_ends.0));
    let mut series: Vec<Series> = curves
        .iter()
        .map(|(name, colour, points)| {
            Series::line(*name, colour, points.iter().map(point).collect())
        })
        .collect();
    let (names, points): (Vec<String>, Vec<DVec2>) = measured
        .iter()
        .map(|(name, p)| (name.clone(), point(p)))
        .unzip();
    series.push(Series::marks("measured", "#c0392b", points).labelled(names));
    let chart = Chart {
        inside_px: DVec2::new(560.0, 360.0),
        ..Chart::new(
            "left-right shift / circle of confusion, middle of the picture",
            Axis::with_ticks("", x_ends, true, f_numbers),
            Axis::with_ticks("", y_ends, true, parts),
            series,
        )
    };
    sheet("", &[vec![chart]])
}
