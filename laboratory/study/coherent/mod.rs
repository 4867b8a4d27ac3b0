//! A point in focus on a pixel: the coherent sum over the main lens's cone beside the model, which adds plane waves
//! without their phases.
//!
//! ```text
//! pixel ─ fields of a fan of plane waves ─ fan ─▶ G_i(k, k') ─ spot ─▶ P_i over the spot's place, coherent and
//!                                                                        incoherent ─ report, figure ─▶ CSV, SVG
//! ```
//! The fan lies in the plane y = 0: the section of a lens's cone, whose light a lens in focus gathers in a line along
//! y. The pixel is the whole pixel, in three dimensions, in its array. The full cone would take the square of the fan's
//! directions.

mod fan;
mod figure;
mod report;
mod spot;

use std::path::Path;
use std::time::Instant;

use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::{PixelModel, PixelStack};
use quadpixel_generators::observer::{Event, Observer};
use serde_json::json;

use self::fan::Fan;
use self::report::Row;
use super::{StudyReport, write};
use crate::error::LaboratoryError;

/// F-numbers of the main lens.
const F_NUMBERS: [f64; 3] = [1.7, 2.8, 8.0];
/// Diameters of the blur, px.
const BLURS_PX: [f64; 4] = [0.0, 1.0, 2.0, 4.0];
const GREEN_NM: f64 = 550.0;

/// What is shown of a pixel behind a lens: a curve of each half, coherent and not.
struct Curves {
    pixel: String,
    pitch_um: f64,
    f_number: f64,
    spot: spot::Spot,
}

/// Studies the shares of the halves of each pixel against the place of a spot in focus. Writes coherent.csv,
/// coherent-places.csv and coherent.svg into the folder `out`.
///
/// # Errors
/// A pixel without two halves, a model that gives no fields, fields beyond memory, or a disk that fails.
pub fn coherent(
    stacks: &[PixelStack],
    model: &PixelModel,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let PixelModel::Rcwa(settings) = model else {
        return Err(LaboratoryError::NoFields {
            model: model.level(),
        });
    };
    let began = Instant::now();
    // All before the first, not after the others.
    for stack in stacks {
        Fan::check(stack, GREEN_NM, F_NUMBERS[0], settings)?;
    }
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for (k, stack) in stacks.iter().enumerate() {
        let progress = |done, of| {
            observer.event(Event::Table {
                done: k * of + done,
                total: stacks.len() * of,
            });
        };
        let (more, drawn) = of_pixel(stack, settings, &progress)?;
        rows.extend(more);
        curves.extend(drawn);
    }
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();
    let version = model.version();
    let title = format!("Spot in focus over a pixel's halves, {GREEN_NM} nm, model {version}");
    let files = [
        ("coherent.csv", report::csv(&rows)),
        ("coherent-places.csv", report::places_csv(&curves)),
        ("coherent.svg", figure::svg(&title, &curves)),
    ];
    let files = write(out, &files)?;
    Ok(StudyReport {
        json: json!({
            "study": "coherent", "model": version, "seconds": seconds, "files": files, "cases": rows
        }),
        table: report::table(&rows),
        summary: format!("{version}, {} pixels in {seconds:.1} s", stacks.len()),
    })
}

fn of_pixel(
    stack: &PixelStack,
    settings: &RcwaSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<Row>, Vec<Curves>), LaboratoryError> {
    let fan = Fan::new(stack, GREEN_NM, F_NUMBERS[0], settings, progress)?;
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for f_number in F_NUMBERS {
        // Where a half sees what it sees out of focus too: the plane that the model's rays are taken in.
        let plane_um = spot::plane_um(&fan, f_number);
        for blur_px in BLURS_PX {
            let depth_um = plane_um + blur_px * stack.pitch_um * f_number;
            let spot = spot::Spot::new(&fan, f_number, depth_um);
            rows.push(Row::new(stack, f_number, (blur_px, plane_um), &spot));
            if blur_px == 0.0 {
                curves.push(Curves {
                    pixel: stack.name.clone(),
                    pitch_um: stack.pitch_um,
                    f_number,
                    spot,
                });
            }
        }
    }
    Ok((rows, curves))
}
