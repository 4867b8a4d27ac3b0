//! A white wall over the whole sensor, view by view: what interpolation between lens shifts prints on the sub-aperture
//! images (section 3.1 of the paper), against responses simulated at the shifts of places that no node holds.
//!
//! Every place of the sensor is lit by the same rays through the lens for all ways of interpolation, so only these
//! differ. At the held-out places the rays are those of the table's simulated directions that come through the lens, so
//! that only the shift is between nodes.

mod places;
mod report;
mod ways;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use quadpixel::em::PixelStack;
use quadpixel::em::light::{PixelSolver, SolverError};
use quadpixel::file;
use quadpixel::response::{AngularResponse, ResponseCache, TablePlan, TableSettings};
use rayon::prelude::*;
use serde_json::json;

use self::places::{Place, Sensor56};
use self::ways::{Deviation, Nodes, Way};
use super::{StudyReport, write};
use crate::error::LaboratoryError;
use quadpixel_generators::observer::{Event, Observer};

const WAVELENGTH_NM: f64 = 550.0;
/// Held-out places on the sensor, mm from its centre.
const HELD_OUT_MM: [(f64, f64); 8] = [
    (0.35, 0.12),
    (0.80, 0.31),
    (1.15, 0.93),
    (1.55, 0.44),
    (2.05, 1.70),
    (2.40, 0.85),
    (2.75, 2.05),
    (2.72, 2.70),
];

/// Studies interpolation between lens shifts on a white wall. Writes flat-field.csv and flat-field.png into the folder
/// `out`.
///
/// # Errors
/// Settings, a pixel or a model that cannot be studied, or a disk that fails.
pub fn flat_field(
    stack: &PixelStack,
    settings: &TableSettings,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let progress = |done, total| observer.event(Event::Table { done, total });
    let began = Instant::now();
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let table = cache
        .table(&TablePlan::new(stack, settings)?, &progress)?
        .table;
    let sensor = Sensor56::new(stack, &table)?;
    let step = settings.cosine_max / settings.steps as f64;
    let held_out: Vec<Place> = HELD_OUT_MM
        .iter()
        .filter_map(|&(x, y)| sensor.place_on_nodes(x, y, step))
        .collect();
    let pixel = settings.model.solver_of_shifts(stack, WAVELENGTH_NM)?;
    let truths = truths(
        pixel.as_ref(),
        &held_out,
        stack.subpixels.count(),
        &progress,
    )?;
    observer.event(Event::End);

    let mut deviations = Vec::new();
    let divisors = [1, 2, 4].into_iter();
    let per_pitch = settings.shifts.map_or(0, |shifts| shifts.per_pitch);
    for divisor in divisors.filter(|d| per_pitch / d >= 4) {
        let nodes = nodes(&table, divisor)?;
        for way in Way::ALL {
            deviations.push(Deviation::new(&nodes, way, &held_out, &truths));
        }
    }
    let mut files = write(out, &[("flat-field.csv", report::csv(&deviations))])?;
    // Half the nodes are drawn, against the finest table.
    let picture = out.join("flat-field.png");
    let bytes = report::picture(&picture, &sensor, &nodes(&table, 2)?, &nodes(&table, 1)?)?;
    file::write_reports(out, &[("flat-field.png", bytes)])?;
    files.push(picture.display().to_string());
    let seconds = began.elapsed().as_secs_f64();
    let beyond = sensor.chief_rays_beyond();
    let held_out = held_out.len();
    Ok(StudyReport {
        json: json!({
            "study": "flat-field", "pixel": stack.name, "lens": places::LENS, "held_out": held_out,
            "chief_rays_beyond": beyond, "seconds": seconds, "files": files, "deviations": report::json(&deviations)
        }),
        table: report::table(&deviations),
        summary: format!(
            "{}, {held_out} held-out places of the 5.6 x 5.6 mm behind {}; chief rays beyond the shifts' last: {:.0} % of the sensor; {seconds:.1} s",
            stack.name,
            places::LENS,
            100.0 * beyond
        ),
    })
}

fn nodes(table: &AngularResponse, divisor: usize) -> Result<Nodes, LaboratoryError> {
    table
        .with_fewer_shifts(divisor)
        .and_then(|t| Nodes::new(&t, WAVELENGTH_NM))
        .ok_or(LaboratoryError::NoSuchShifts)
}

/// The weights `[ray][sub-pixel]` of each place, simulated under its own lens shift. Rays are directions of one grid:
/// the shifts of all places that light of a direction reaches are asked for together.
fn truths(
    pixel: &dyn PixelSolver,
    places: &[Place],
    count: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Vec<f32>>, SolverError> {
    let mut reached: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (k, place) in places.iter().enumerate() {
        for (ray, (u, v)) in place.u.iter().zip(&place.v).enumerate() {
            let direction = [u.to_bits(), v.to_bits()];
            reached.entry(direction).or_default().push((k, ray));
        }
    }
    let directions: Vec<_> = reached.into_iter().collect();
    let done = AtomicUsize::new(0);
    let one = |(direction, rays): &([u32; 2], Vec<(usize, usize)>)| {
        let [u, v] = direction.map(|bits| f64::from(f32::from_bits(bits)));
        let shifts: Vec<[f64; 2]> = rays.iter().map(|(k, _)| places[*k].shift_um).collect();
        let answers = pixel.under_shifts(u, v, &shifts)?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, directions.len());
        Ok(answers)
    };
    let answers: Vec<_> = directions
        .par_iter()
        .map(one)
        .collect::<Result<_, SolverError>>()?;
    let empty = |place: &Place| vec![0f32; place.u.len() * count];
    let mut all: Vec<Vec<f32>> = places.iter().map(empty).collect();
    for ((_, rays), answers) in directions.iter().zip(answers) {
        for (&(k, ray), answer) in rays.iter().zip(answers) {
            let out = &mut all[k][ray * count..][..count];
            for (o, p) in out.iter_mut().zip(answer.mean.absorbed) {
                *o = p as f32;
            }
        }
    }
    Ok(all)
}
