//! Captures of a real dual-pixel camera, simulated, and depth measured from them: `scripts/real-camera DATA_DIR`.
//!
//! ```text
//! captures ─ data ─▶ views ─ measure ─▶ shifts                     camera: lens, stop, focus, pixel (exact, spread)
//! F/20 view ─ simulate ─▶ F/4 views by all models ─ compare ─▶ PSNR, SSIM, shifts ┐
//! aperture: shift over circle of confusion from F/1.8 to F/20                     ├─ results ─ report ─▶ page
//! curve ─▶ disparity against distance ─ depths ─▶ errors over planes and scenes   ┘
//! ```

mod aperture;
mod args;
mod camera;
mod compare;
mod data;
mod depths;
mod exact;
mod measure;
mod noise;
mod page;
mod report;
mod results;
mod scenes;
mod simulate;
mod spread;

use std::error::Error;
use std::process::ExitCode;

use clap::Parser;
use quadpixel::em::PixelStack;
use quadpixel::render::Camera;
use quadpixel::render::truth::Defocus;

use args::{Args, step};
use camera::Model;
use data::{Captures, Flat, SHARP_MARK, Views};
use results::{ApertureResult, CaptureResult, LensResult, ModelResult, Results};

/// Directions of the exact runs: across the F/1.8 cone, and where the F/4 cone at the side of the field lies.
const EXACT_U: [f64; 7] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4];

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("real_camera: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    let stack = PixelStack::builtin(&args.pixel)?;
    if let Some(file) = &args.exact_runs {
        return exact::Runs::make(&stack, &EXACT_U, file);
    }
    let captures = Captures::find(&args.data)?;
    step("response of the pixel by the wave model");
    let models = camera::models(&stack)?;
    let mut results = Results {
        lens: lens_figures(&args.lens)?,
        left_out: captures.left_out.clone(),
        ..Results::default()
    };
    for flat in captures.flats.iter().filter(|f| f.mark < SHARP_MARK) {
        let twin = (captures.flats.iter())
            .find(|s| s.distance_mm == flat.distance_mm && s.mark >= SHARP_MARK);
        let name = format!("{} mm at F/{}", flat.distance_mm, flat.mark);
        let Some(sharp) = twin else {
            let why = format!("{name}: not simulated, no capture at F/{SHARP_MARK} or more of it");
            results.left_out.push(why);
            continue;
        };
        step(&format!("simulating {name}"));
        match simulated(&args.lens, &models, flat, sharp) {
            Ok(simulated) => results.captures.push(simulated),
            Err(e) => results.left_out.push(e.to_string()),
        }
    }
    step("noise of the views");
    let folders = (captures.flats.iter())
        .map(|f| (format!("{} mm, F/{}", f.distance_mm, f.mark), &f.folder))
        .chain(captures.scenes.iter().map(|s| (s.name.clone(), &s.folder)));
    for (name, folder) in folders {
        // What cannot be read is said where it is to be used.
        if let Ok(views) = Views::read(folder) {
            results.noise.push((name, noise::left_over_right(&views)));
        }
    }
    step("shift against aperture");
    apertures(&args.lens, &models, &captures, &mut results)?;
    scenes::all_depths(args, &models[0], &captures, &mut results)?;
    for line in &results.left_out {
        step(&format!("left out: {line}"));
    }
    results.write(&args.out)
}

fn lens_figures(name: &str) -> Result<Vec<LensResult>, Box<dyn Error>> {
    [1.8, 4.0, 20.0]
        .iter()
        .map(|&mark| {
            let lens = camera::lens(name, mark, camera::FOCUS_MM)?;
            let p = lens.paraxial(quadpixel::units::D_LINE_NM)?;
            Ok(LensResult {
                mark,
                stop_semi_mm: lens.stop_semi_mm(),
                efl_mm: p.efl_mm,
                f_number: p.f_number,
                sensor_from_vertex_mm: lens.sensor_z_mm(),
                focus_from_vertex_mm: lens.focus_distance_mm(),
            })
        })
        .collect()
}

/// One capture by all models.
fn simulated(
    lens: &str,
    models: &[Model],
    flat: &Flat,
    sharp: &Flat,
) -> Result<CaptureResult, Box<dyn Error>> {
    let (real, picture) = (
        Views::read(&flat.folder)?,
        Views::read(&sharp.folder)?.mean(),
    );
    let size = (picture.width(), picture.height());
    if size != (real.left.width(), real.left.height()) {
        let folders = (flat.folder.display(), sharp.folder.display());
        return Err(format!("{} and {}: views of different size", folders.0, folders.1).into());
    }
    let parts = measure::thirds(size.0, size.1);
    let shifts = |views: &Views| measure::shifts(&views.left, &views.right, &parts);
    let mut result = CaptureResult {
        distance_mm: flat.distance_mm,
        mark: flat.mark,
        coc_px: 0.0,
        measured: shifts(&real)?,
        models: Vec::new(),
    };
    let mut judged = |name: &str, views: &Views| -> Result<(), Box<dyn Error>> {
        let likeness = compare::compare(views, &real);
        let shifts = shifts(views)?;
        result.models.push(ModelResult {
            name: name.to_owned(),
            likeness,
            shifts,
        });
        Ok(())
    };
    let mut coc_px = 0.0;
    for model in models {
        let at = |mark: f64| {
            let lens = camera::lens(lens, mark, camera::FOCUS_MM)?;
            camera::camera(&lens, model, size)
        };
        let (wide, narrow) = (at(flat.mark)?, at(sharp.mark)?);
        coc_px = coc(&wide, flat.distance_mm)? / wide.sensor().pitch_mm();
        let views = simulate::rendered(&wide, &narrow, &picture, flat.distance_mm)?;
        judged(model.name, &views)?;
    }
    judged("half disks", &simulate::half_disks(&picture, coc_px))?;
    result.coc_px = coc_px;
    Ok(result)
}

/// Circle of confusion, mm, negative in front of the focus.
fn coc(camera: &Camera, distance_mm: f64) -> Result<f64, Box<dyn Error>> {
    Defocus::new(camera)
        .map(|d| d.circle_of_confusion_mm(distance_mm - camera.sensor_z_mm()))
        .ok_or("a camera without a lens".into())
}

fn apertures(
    lens: &str,
    models: &[Model],
    captures: &Captures,
    results: &mut Results,
) -> Result<(), Box<dyn Error>> {
    // In front of the focus by as much as the nearest capture.
    const DISTANCE_MM: f64 = 600.0;
    let mut found = ApertureResult::default();
    for model in models {
        let points = aperture::simulated(lens, model, DISTANCE_MM)?;
        found.curves.push((model.name.to_string(), points));
    }
    let mut measured = |flat: &Flat| -> Result<(), Box<dyn Error>> {
        let views = Views::read(&flat.folder)?;
        let size = (views.left.width(), views.left.height());
        let parts = measure::thirds(size.0, size.1);
        let shift = &measure::shifts(&views.left, &views.right, &parts)?[1];
        let lens = camera::lens(lens, flat.mark, camera::FOCUS_MM)?;
        let camera = camera::camera(&lens, &models[0], size)?;
        let coc_px = coc(&camera, flat.distance_mm)? / camera.sensor().pitch_mm();
        let name = format!("{} mm", flat.distance_mm);
        let point = (flat.mark, -shift.whole_px / coc_px);
        found.measured.push((name, coc_px, shift.whole_px, point));
        Ok(())
    };
    for flat in &captures.flats {
        // At the focus there is no circle of confusion to compare with.
        if flat.distance_mm == camera::FOCUS_MM {
            continue;
        }
        if let Err(e) = measured(flat) {
            results.left_out.push(e.to_string());
        }
    }
    results.aperture = found;
    Ok(())
}
