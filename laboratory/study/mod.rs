//! The paper's studies of the pixel (its Figs. 2, 3, 5, 11, 12, 13, the lines of section 3.1, and the worst case of
//! section 4, and light with its phases) with any pixel model, as tables, CSV files and plots.
//!
//! ```text
//! kind ─ cases ─▶ pixels and wavelengths ─ curve ─▶ P over θ, ranges ─ report ─▶ CSV, table, JSON
//!                                                                    └ figures ─ plot ─▶ SVG
//! ```

mod cases;
mod chief_ray;
mod coherent;
mod corrected;
mod curve;
mod figures;
mod flat_field;
mod mosaic;
mod report;
mod size;

use std::path::Path;
use std::time::Instant;

use quadpixel::em::PixelModel;
use quadpixel::file;
use quadpixel_generators::observer::{Event, Observer};
use serde_json::{Value, json};

pub use self::cases::CurveStudy;
pub use self::chief_ray::chief_ray;
pub use self::coherent::coherent;
pub use self::corrected::corrected;
pub use self::curve::{Angles, AnglesError};
pub use self::flat_field::flat_field;
pub use self::mosaic::mosaic;
pub use self::size::size;
use crate::error::LaboratoryError;

/// What a study found, beside its files.
#[derive(Clone, Debug)]
pub struct StudyReport {
    /// For programs: one object, with the files that were written.
    pub json: Value,
    /// For people, lines.
    pub table: String,
    /// One line: what was studied, and the seconds that it took.
    pub summary: String,
}

/// Studies P over θ. Writes NAME.csv, NAME-ranges.csv and NAME.svg into the folder `out`, and NAME.partial while it
/// runs, with which a killed study goes on.
///
/// # Errors
/// A pixel or a model that cannot be studied, or a disk that fails.
pub fn curves(
    study: &CurveStudy,
    model: &PixelModel,
    angles: &Angles,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let cases = cases::cases(study)?;
    let began = Instant::now();
    file::create_folder(out)?;
    let name = study.name();
    let journal = curve::journal(
        &out.join(format!("{name}.partial")),
        &cases,
        model,
        &observer,
    )?;
    let progress = |done, total| observer.event(Event::Table { done, total });
    let curves = curve::all(&cases, model, angles, &journal, &progress)?;
    let points = curves.iter().flat_map(|c| &c.points);
    warn_of(points.filter(|p| p.warned).count(), observer);
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    let version = model.version();
    let files = [
        (".csv", report::curves_csv(&cases, &curves)),
        ("-ranges.csv", report::ranges_csv(&cases, &curves)),
        (".svg", figures::svg(study, &cases, &curves, version)),
    ];
    let files = files.map(|(end, text)| (format!("{name}{end}"), text));
    let files = write(out, &files)?;
    journal.remove();
    let mut table = report::table(&cases, &curves);
    if *study == CurveStudy::Microlens {
        table += &report::ranking(&cases, &curves);
    }
    let count = curves.iter().map(|c| c.angles).sum::<usize>();
    Ok(StudyReport {
        json: json!({
            "study": name, "model": version, "seconds": seconds, "files": files, "cases": report::json(&cases, &curves)
        }),
        table,
        summary: format!("{version}, {count} angles in {seconds:.1} s"),
    })
}

/// Reports runs that the model itself doubts.
fn warn_of(count: usize, observer: &dyn Observer) {
    if count > 0 {
        observer.event(Event::Warning(&format!(
            "{count} points did not converge or miss energy; `qpgen response --theta-deg` tells which"
        )));
    }
}

/// Writes files into the folder `out`; their paths.
fn write<Name: AsRef<Path>>(
    out: &Path,
    files: &[(Name, String)],
) -> Result<Vec<String>, LaboratoryError> {
    let bytes =
        |(name, text): &(Name, String)| (name.as_ref().to_owned(), text.clone().into_bytes());
    let bytes: Vec<_> = files.iter().map(bytes).collect();
    file::write_reports(out, &bytes)?;
    let path = |(name, _): &(Name, String)| out.join(name).display().to_string();
    Ok(files.iter().map(path).collect())
}
