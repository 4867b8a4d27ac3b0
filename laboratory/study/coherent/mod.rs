//! A point in focus on a pixel: the coherent sum over the main lens's cone beside the model, which adds plane waves
//! without their phases.
//!
//! ```text
//! pixel ─ fields of a cone of plane waves ─ cone ─▶ G_i(k, k') ─ spot ─▶ P_i over the spot's place, coherent and
//!                                                                          incoherent ─ report, figure ─▶ CSV, SVG
//! ```
//! The cone is that of a circular pupil, by waves on a square grid of direction cosines, whose spots repeat along x and
//! along y. One eighth of them is solved for quad pixels (one quarter for others): the pixel's mirrors give the rest.

mod cone;
mod figure;
mod report;
mod spot;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use quadpixel::em::{PixelModel, PixelStack};
use quadpixel_generators::observer::{Event, Observer};
use serde_json::json;

use self::cone::{Cone, Plan};
use self::report::Row;
use super::{StudyReport, write};
use crate::error::LaboratoryError;

/// Main lenses whose cones are summed of the same waves.
struct Lenses {
    f_numbers: &'static [f64],
    /// From spot to spot, at least.
    period_um: f64,
}

/// Periods of 17, 10 and 5 times λF or more: beyond half of them there is at most 2, 4 and 7 % of a spot's light, which
/// is taken for the next spot's.
const LENSES: [Lenses; 2] = [
    Lenses {
        f_numbers: &[1.7, 2.8],
        period_um: 16.0,
    },
    Lenses {
        f_numbers: &[8.0],
        period_um: 24.0,
    },
];
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
    let mut plans = Vec::new();
    for stack in stacks {
        for lenses in &LENSES {
            plans.push((stack, lenses, Plan::new(stack, lenses, settings)?));
        }
    }
    let total = plans.iter().map(|(.., plan)| plan.solved.len()).sum();
    let done = AtomicUsize::new(0);
    let solved = || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        observer.event(Event::Table { done, total });
    };
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for (stack, lenses, plan) in plans {
        let cone = Cone::new(plan, stack, settings, &solved)?;
        for f_number in lenses.f_numbers {
            of_lens(stack, &cone, *f_number, &mut rows, &mut curves);
        }
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

/// A row per blur, and the curves in focus.
fn of_lens(
    stack: &PixelStack,
    cone: &Cone,
    f_number: f64,
    rows: &mut Vec<Row>,
    curves: &mut Vec<Curves>,
) {
    // Where a half sees what it sees out of focus too: the plane that the model's rays are taken in.
    let plane_um = spot::plane_um(cone, f_number);
    for blur_px in BLURS_PX {
        let depth_um = plane_um + blur_px * stack.pitch_um * f_number;
        let spot = spot::Spot::new(cone, f_number, depth_um);
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
