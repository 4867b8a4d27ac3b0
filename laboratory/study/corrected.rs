//! Exact runs spent against error left: the corrected level fitted to the first few of many exact runs, and held
//! against all others.
//!
//! The exact runs are those of the FDTD table that comes with the program, where there is one of the pixel; else they
//! are made.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use glam::DVec2;
use quadpixel::em::PixelStack;
use quadpixel::em::corrected::{Correction, ExactRun, spread};
use quadpixel::em::light::{Incidence, PixelSolver};
use quadpixel::em::{CorrectedSettings, PixelModel};
use quadpixel::response::{AngularResponse, ResponseError};
use rayon::prelude::*;
use serde_json::json;

use super::{StudyReport, write};
use crate::error::LaboratoryError;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::plot::{Axis, Chart, Series, sheet};

const WAVELENGTH_NM: f64 = 550.0;
/// Numbers of exact runs that are fitted.
const SPENT: [usize; 12] = [3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48];
/// Runs that at least are held out.
const HELD_OUT: usize = 6;

/// What a fit of some runs leaves, in parts of the largest P.
struct Left {
    runs: usize,
    /// Wave model against the runs held out.
    wave_rms: f64,
    /// Corrected against the runs held out: RMS, largest.
    rms: f64,
    max: f64,
    /// What the fit says of itself: RMS of each run left out.
    claimed: f64,
}

/// Studies exact runs spent against error left, of the centred lens or under all its shifts. Writes corrected.csv and
/// corrected.svg into the folder `out`.
///
/// # Errors
/// Settings, a pixel or a model that cannot be studied, or a disk that fails.
pub fn corrected(
    stack: &PixelStack,
    settings: &CorrectedSettings,
    all_shifts: bool,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    settings.check()?;
    let began = Instant::now();
    let (source, runs) = exact_runs(stack, settings, all_shifts, observer)?;
    observer.event(Event::End);
    let spent = SPENT.into_iter().filter(|n| n + HELD_OUT <= runs.len());
    let all: Vec<Left> = spent
        .map(|n| left(stack, &runs, n))
        .collect::<Result<_, _>>()?;
    let seconds = began.elapsed().as_secs_f64();

    let files = [
        ("corrected.csv", csv(&all)),
        ("corrected.svg", svg(stack, source, &all)),
    ];
    let files = write(out, &files)?;
    let rows = all.iter().map(|l| {
        json!({
            "exact_runs": l.runs, "wave_rms": l.wave_rms, "corrected_rms": l.rms, "corrected_max": l.max, "told_rms": l.claimed
        })
    });
    let runs = runs.len();
    Ok(StudyReport {
        json: json!({
            "study": "corrected", "pixel": stack.name, "exact": source, "exact_runs": runs, "seconds": seconds, "files": files,
            "left": rows.collect::<Vec<_>>()
        }),
        table: table(&all),
        summary: format!("{}, {runs} runs of {source}, {seconds:.1} s", stack.name),
    })
}

/// Where the exact runs are from, and each beside the wave model.
fn exact_runs(
    stack: &PixelStack,
    settings: &CorrectedSettings,
    all_shifts: bool,
    observer: &dyn Observer,
) -> Result<(&'static str, Vec<ExactRun>), ResponseError> {
    let shipped = match all_shifts {
        true => None,
        false => shipped(stack, settings)?,
    };
    let (source, exact) = match shipped {
        Some(runs) => ("the shipped FDTD table", runs),
        None => {
            let progress = |done, total| observer.event(Event::Table { done, total });
            let runs = simulated(stack, settings, all_shifts, &progress)?;
            (settings.exact.version(), runs)
        }
    };
    let wave = PixelModel::Wave(settings.wave);
    let wave = wave.solver_of_shifts(stack, WAVELENGTH_NM)?;
    let both = |(incidence, exact): &SimulatedDirection| {
        Ok(ExactRun {
            incidence: *incidence,
            exact: exact.clone(),
            wave: lit(wave.as_ref(), incidence)?,
        })
    };
    let runs: Result<Vec<ExactRun>, ResponseError> = exact.par_iter().map(both).collect();
    Ok((source, runs?))
}

/// For a person.
fn table(all: &[Left]) -> String {
    let mut text = format!(
        "{:>10} {:>12} {:>17} {:>17} {:>16}   (% of the largest P, at directions held out)\n",
        "exact runs", "wave rms", "corrected rms", "corrected max", "told by the fit"
    );
    for l in all {
        let percent = [l.wave_rms, l.rms, l.max, l.claimed].map(|x| 100.0 * x);
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "{:>10} {:>12.2} {:>17.2} {:>17.2} {:>16.2}",
            l.runs, percent[0], percent[1], percent[2], percent[3]
        );
    }
    text
}
/// A direction and P of each sub-pixel there.
type SimulatedDirection = (Incidence, Vec<f64>);

/// The simulated directions of the shipped table, spread out first.
fn shipped(
    stack: &PixelStack,
    settings: &CorrectedSettings,
) -> Result<Option<Vec<SimulatedDirection>>, ResponseError> {
    if !matches!(*settings.exact, PixelModel::Fdtd(_)) {
        return Ok(None);
    }
    let Some(table) = AngularResponse::shipped(quadpixel::em::Level::Fdtd, stack)? else {
        return Ok(None);
    };
    // Table nodes between the simulated ones are interpolated.
    let refine = table.meta().settings.simulated().map_or(1, |s| s.refine);
    let axis = &table.axes().u;
    let half = axis.len() / 2;
    let octant = (0..=half / refine).flat_map(|i| (0..=i).map(move |j| (i, j)));
    let nodes = octant.map(|(i, j)| (half + i * refine, half + j * refine));
    let all = nodes.map(|(iu, iv)| {
        let p = table.node(0, 0, iv, iu).iter().map(|&p| f64::from(p));
        let incidence = Incidence {
            direction: [axis[iu], axis[iv]],
            shift_um: [0.0, 0.0],
        };
        (incidence, p.collect::<Vec<f64>>())
    });
    let near = |i: &Incidence| i.direction[0].hypot(i.direction[1]) <= settings.reach;
    let all: Vec<_> = all.filter(|(i, _)| near(i)).collect();
    let waves: Vec<Incidence> = all.iter().map(|a| a.0).collect();
    let order = spread(&waves, stack, waves.len())?;
    Ok(Some(order.into_iter().map(|i| all[i].clone()).collect()))
}

/// P of each sub-pixel.
fn lit(pixel: &dyn PixelSolver, incidence: &Incidence) -> Result<Vec<f64>, ResponseError> {
    let [u, v] = incidence.direction;
    let mut light = pixel.under_shifts(u, v, &[incidence.shift_um])?;
    Ok(light.swap_remove(0).mean.absorbed)
}

fn simulated(
    stack: &PixelStack,
    settings: &CorrectedSettings,
    all_shifts: bool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SimulatedDirection>, ResponseError> {
    let exact = settings.exact.solver_of_shifts(stack, WAVELENGTH_NM)?;
    let plan = settings.plan(stack, all_shifts)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let one = |incidence: &Incidence| {
        let p = lit(exact.as_ref(), incidence)?;
        let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        progress(so_far, plan.len());
        Ok((*incidence, p))
    };
    plan.par_iter().map(one).collect()
}

fn left(stack: &PixelStack, runs: &[ExactRun], n: usize) -> Result<Left, ResponseError> {
    let correction = Correction::fit(stack, &runs[..n])?;
    let peak = runs
        .iter()
        .flat_map(|r| &r.exact)
        .fold(0.0, |a: f64, b| a.max(*b));
    let (mut wave, mut sum, mut max, mut count) = (0.0, 0.0, 0f64, 0.0);
    for run in &runs[n..] {
        let mut p = run.wave.clone();
        correction.apply(run.incidence, &mut p);
        for ((p, w), e) in p.iter().zip(&run.wave).zip(&run.exact) {
            wave += (w - e) * (w - e);
            sum += (p - e) * (p - e);
            max = max.max((p - e).abs());
            count += 1.0;
        }
    }
    Ok(Left {
        runs: n,
        wave_rms: (wave / count).sqrt() / peak,
        rms: (sum / count).sqrt() / peak,
        max: max / peak,
        claimed: correction.error().left_rms / peak,
    })
}

fn csv(all: &[Left]) -> String {
    let mut text = String::from("exact_runs,wave_rms,corrected_rms,corrected_max,told_rms\n");
    for l in all {
        let _ = writeln!(
            text,
            "{},{:.5},{:.5},{:.5},{:.5}",
            l.runs, l.wave_rms, l.rms, l.max, l.claimed
        );
    }
    text
}

fn svg(stack: &PixelStack, source: &str, all: &[Left]) -> String {
    let line = |name: &str, colour, value: fn(&Left) -> f64| {
        let points = all.iter();
        let points = points.map(|l| DVec2::new(l.runs as f64, 100.0 * value(l)));
        Series::line(name, colour, points.collect())
    };
    let series = vec![
        line("wave", "#666", |l| l.wave_rms).dashed(),
        line("corrected", "#1f6fd0", |l| l.rms),
        line("told by the fit", "#d1332b", |l| l.claimed).dashed(),
    ];
    let highest = series.iter().map(Series::highest).fold(0.5, f64::max);
    let most = all.last().map_or(1.0, |l| l.runs as f64);
    let chart = Chart::new(
        "RMS at directions held out",
        Axis::linear("exact runs spent", (0.0, most), 8.0),
        Axis::linear("% of peak", (0.0, (1.4 * highest).ceil()), 1.0),
        series,
    );
    let title = format!("{}, exact: {source}", stack.name);
    sheet(&title, &[vec![chart]])
}
