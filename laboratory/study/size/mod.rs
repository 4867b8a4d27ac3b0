//! What is left of the phase signal as pixels shrink (section 3.2.1 of the paper, Fig. 12): one chart out of focus,
//! seen by pixels of several sizes, each by the ideal box (classic), by its wave optics (diffractive), and with
//! diffraction at the lens's aperture beside it.
//!
//! ```text
//! pixel × mode ─ camera ─▶ the same chart ─ render ─▶ views ─ shift ─▶ disparity per pixel of defocus, differences
//!                                                                          └─▶ CSV, JSON, picture
//! ```
//! All pixels see the same piece of the chart on the same piece of the sensor.

mod report;
mod shot;

use std::path::Path;
use std::time::Instant;

use quadpixel::em::PixelStack;
use quadpixel::file;
use quadpixel::response::{GeometricResponse, Response, ResponseCache, TablePlan, TableSettings};
use quadpixel_generators::observer::{Event, Observer};
use serde_json::json;

use self::shot::{Bench, Mode, Shot};
use super::{StudyReport, write};
use crate::error::LaboratoryError;

/// Studies what is left of the phase signal of each pixel, with the settings of its table. Writes size.csv and size.jpg
/// into the folder `out`.
///
/// # Errors
/// A pixel or a model that cannot be studied, or a disk that fails.
pub fn size(
    pixels: &[(PixelStack, TableSettings)],
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let began = Instant::now();
    let bench = Bench::new()?;
    let mut shots: Vec<Shot> = Vec::new();
    for (stack, settings) in pixels {
        for (mode, response) in responses(stack, settings, bench.f_number(), observer)? {
            let name = format!("{}, {}", stack.name, mode.name());
            observer.event(Event::Info(&name));
            shots.push(bench.shot(stack, mode, &response)?);
        }
    }
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    let mut files = write(out, &[("size.csv", report::csv(&shots))])?;
    let picture = out.join("size.jpg");
    let bytes = report::picture(&picture, &shots)?;
    file::write_reports(out, &[("size.jpg", bytes)])?;
    files.push(picture.display().to_string());
    let model = pixels.first().map_or("", |p| p.1.model.version());
    let (lens, focus_mm, chart_mm) = (shot::LENS, shot::FOCUS_MM, shot::CHART_MM);
    Ok(StudyReport {
        json: json!({
            "study": "size", "lens": lens, "focus_mm": focus_mm, "chart_mm": chart_mm, "model": model, "seconds": seconds,
            "files": files, "shots": report::json(&shots)
        }),
        table: report::table(&shots),
        summary: format!(
            "{lens}, focus {focus_mm} mm, chart {chart_mm} mm, {model}, {seconds:.1} s"
        ),
    })
}

/// The box that fits the main lens, and the model's table.
fn responses(
    stack: &PixelStack,
    settings: &TableSettings,
    f_number: f64,
    observer: &dyn Observer,
) -> Result<[(Mode, Response); 3], LaboratoryError> {
    let subpixels = stack.subpixels;
    if subpixels.m() < 2 {
        return Err(LaboratoryError::OneColumn {
            pixel: stack.name.clone(),
            subpixels,
        });
    }
    let focal_um = stack.pitch_um * f_number;
    let classic = GeometricResponse::new(subpixels, stack.pitch_um, focal_um)?;
    let progress = |done, total| observer.event(Event::Table { done, total });
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let made = cache.table(&TablePlan::new(stack, settings)?, &progress)?;
    for warning in &made.warnings {
        observer.event(Event::Warning(&warning.to_string()));
    }
    Ok([
        (Mode::Classic, Response::Geometric(classic)),
        (Mode::Diffractive, Response::Table(made.table.clone())),
        (Mode::Waves, Response::Table(made.table)),
    ])
}
