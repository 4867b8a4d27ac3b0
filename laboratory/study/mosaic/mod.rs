//! Crosstalk under a mosaic of colour filters against the period of one colour.
//!
//! With one colour, what crosses over to a neighbour has passed a filter like its own; the paper (section 4) expects
//! that real neighbours, of other colours, give less crosstalk, and calls the period of one colour its worst case. Here
//! both are solved: the supercell of 2×2 microlenses and, for each of its filters, the period of that filter alone, at
//! a wavelength of each colour, over θ at φ = 0.

mod figure;
mod report;
mod survey;

use std::path::Path;
use std::time::Instant;

use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel_generators::observer::{Event, Observer};
use serde_json::json;

use self::survey::Survey;
use super::curve::Angles;
use super::{StudyReport, warn_of, write};
use crate::error::LaboratoryError;

/// Studies the crosstalk under a mosaic. Writes mosaic.csv, mosaic-summary.csv and mosaic.svg into the folder `out`.
///
/// # Errors
/// A pixel without a mosaic, a model that cannot be asked, or a disk that fails.
pub fn mosaic(
    stack: &PixelStack,
    model: &PixelModel,
    angles: &Angles,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let began = Instant::now();
    let progress = |done, total| observer.event(Event::Table { done, total });
    let survey = Survey::new(stack, model, &angles.one_side(), &progress)?;
    warn_of(survey.warned, observer);
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    let summary = report::summary(&survey);
    let version = model.version();
    let title = format!("mosaic study, {}, model {version}", stack.name);
    let files = [
        ("mosaic.csv", report::csv(&survey)),
        ("mosaic-summary.csv", report::summary_csv(&summary)),
        ("mosaic.svg", figure::svg(&title, &survey)),
    ];
    let files = write(out, &files)?;
    Ok(StudyReport {
        json: json!({
            "study": "mosaic", "pixel": stack.name, "model": version, "seconds": seconds, "solutions": survey.solutions,
            "slowest_mosaic_s": survey.slowest_s, "worst_imbalance": survey.imbalance, "files": files, "microlenses": summary
        }),
        table: report::table(&summary),
        summary: format!(
            "{version}, {} solutions in {seconds:.1} s (the slowest mosaic {:.1} s), power missing at most {:.1e}",
            survey.solutions, survey.slowest_s, survey.imbalance
        ),
    })
}
