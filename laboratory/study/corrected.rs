//! Exact runs spent against error left: the corrected level fitted to the first few of many exact runs, and held against all others.
//!
//! The exact runs are those of the FDTD table that comes with the program, where there is one of the pixel; else they are made.

use std::fmt::Write;

use glam::DVec2;
use quadpixel::em::PixelStack;
use quadpixel::response::{
    AngularResponse, CorrectedSettings, Correction, ExactRun, Incidence, PixelModel, ResponseError,
    ShiftedPixel, spread,
};
use rayon::prelude::*;

use super::{StudyArgs, one_pixel, write};
use quadpixel::command::CommandError;
use quadpixel::file;
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
    told: f64,
}

pub(super) fn run(args: &StudyArgs, observer: &dyn Observer) -> Result<(), CommandError> {
    let stack = one_pixel(args, "1.6um")?;
    let settings = args.model.corrected();
    settings.check().map_err(CommandError::input)?;
    let began = std::time::Instant::now();
    let told = |done, total| observer.event(Event::Table { done, total });
    let wave = PixelModel::Wave(settings.wave);
    let shipped = if args.all_shifts {
        None
    } else {
        shipped(&stack, &settings).map_err(CommandError::input)?
    };
    let (source, exact) = match shipped {
        Some(runs) => ("the shipped FDTD table", runs),
        None => (
            settings.exact.version(),
            simulated(&stack, &settings, args.all_shifts, &told).map_err(CommandError::input)?,
        ),
    };
    let wave = ShiftedPixel::new(&stack, &wave, WAVELENGTH_NM).map_err(CommandError::input)?;
    let both = |(incidence, exact): &(Incidence, Vec<f64>)| {
        Ok(ExactRun {
            incidence: *incidence,
            exact: exact.clone(),
            wave: lit(&wave, incidence)?,
        })
    };
    let runs: Result<Vec<ExactRun>, ResponseError> = exact.par_iter().map(both).collect();
    let runs = runs.map_err(CommandError::input)?;
    observer.event(Event::End);
    let spent = SPENT.into_iter().filter(|n| n + HELD_OUT <= runs.len());
    let all: Vec<Left> = spent
        .map(|n| left(&stack, &runs, n))
        .collect::<Result<_, _>>()
        .map_err(CommandError::input)?;
    let seconds = began.elapsed().as_secs_f64();

    file::create_folder(&args.out).map_err(CommandError::failed)?;
    let files = ["corrected.csv", "corrected.svg"].map(|f| args.out.join(f));
    write(&files[0], &csv(&all))?;
    write(&files[1], &svg(&stack, source, &all))?;
    if args.json {
        let rows = all.iter().map(|l| {
            serde_json::json!({
                "exact_runs": l.runs, "wave_rms": l.wave_rms, "corrected_rms": l.rms, "corrected_max": l.max, "told_rms": l.told
            })
        });
        println!(
            "{}",
            serde_json::json!({
                "study": "corrected", "pixel": stack.name, "exact": source, "exact_runs": runs.len(), "seconds": seconds,
                "files": files, "left": rows.collect::<Vec<_>>()
            })
        );
        return Ok(());
    }
    println!(
        "{:>10} {:>12} {:>17} {:>17} {:>16}   (% of the largest P, at directions held out)",
        "exact runs", "wave rms", "corrected rms", "corrected max", "told by the fit"
    );
    for l in &all {
        let percent = [l.wave_rms, l.rms, l.max, l.told].map(|x| 100.0 * x);
        println!(
            "{:>10} {:>12.2} {:>17.2} {:>17.2} {:>16.2}",
            l.runs, percent[0], percent[1], percent[2], percent[3]
        );
    }
    println!(
        "{}, {} runs of {source}, {seconds:.1} s: {}",
        stack.name,
        runs.len(),
        args.out.display()
    );
    Ok(())
}

/// A direction and P of each sub-pixel there.
type Held = (Incidence, Vec<f64>);

/// The simulated directions of the shipped table, spread out first.
fn shipped(
    stack: &PixelStack,
    settings: &CorrectedSettings,
) -> Result<Option<Vec<Held>>, ResponseError> {
    if !matches!(*settings.exact, PixelModel::Fdtd(_)) {
        return Ok(None);
    }
    let Some(table) = AngularResponse::shipped_fdtd(stack)? else {
        return Ok(None);
    };
    // Table nodes between the simulated ones are interpolated.
    let refine = table.meta().settings["refine"].as_u64().unwrap_or(1) as usize;
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
fn lit(pixel: &ShiftedPixel, incidence: &Incidence) -> Result<Vec<f64>, ResponseError> {
    let [u, v] = incidence.direction;
    let mut light = pixel.light(u, v, &[incidence.shift_um])?;
    Ok(light.swap_remove(0).mean.absorbed)
}

fn simulated(
    stack: &PixelStack,
    settings: &CorrectedSettings,
    all_shifts: bool,
    told: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<(Incidence, Vec<f64>)>, ResponseError> {
    let exact = ShiftedPixel::new(stack, &settings.exact, WAVELENGTH_NM)?;
    let plan = settings.plan(stack, all_shifts)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let one = |incidence: &Incidence| {
        let p = lit(&exact, incidence)?;
        let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        told(so_far, plan.len());
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
        told: correction.error().left_rms / peak,
    })
}

fn csv(all: &[Left]) -> String {
    let mut text = String::from("exact_runs,wave_rms,corrected_rms,corrected_max,told_rms\n");
    for l in all {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{},{:.5},{:.5},{:.5},{:.5}",
            l.runs, l.wave_rms, l.rms, l.max, l.told
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
        line("told by the fit", "#d1332b", |l| l.told).dashed(),
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
