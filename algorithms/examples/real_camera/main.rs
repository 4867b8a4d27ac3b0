//! Captures of a real dual-pixel camera, simulated, and depth measured from them: `scripts/real-camera DATA_DIR`.
//!
//! ```text
//! captures ─ data ─▶ views ─ measure ─▶ shifts                          camera: lens, stop, focus, pixel
//! F/20 view ─ simulate ─▶ F/4 views by wave, sharp split, half disks ─ compare ─▶ PSNR, SSIM, shifts ┐
//! aperture: shift over circle of confusion from F/1.8 to F/20                                        ├─ report ─▶ page
//! curve ─▶ disparity against distance ─ depths ─▶ errors over planes and scenes                      ┘
//! ```

mod aperture;
mod camera;
mod compare;
mod curve;
mod data;
mod depths;
mod measure;
mod report;
mod simulate;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use algorithms::field_curve::FieldCurve;
use clap::Parser;
use quadpixel::command::CommandError;
use quadpixel::em::PixelStack;
use quadpixel::image::Image;
use quadpixel::render::Camera;
use quadpixel::render::truth::Defocus;
use quadpixel::response::Response;
use quadpixel::sensor::ShiftRule;

use data::{Captures, Flat, Views};
use report::{ApertureResult, CaptureResult, DepthResult, LensResult, ModelResult, Results};

/// The F-number of scenes, which their folders do not say: the published network for these captures is trained at F/4.
const SCENE_MARK: f64 = 4.0;
/// The F-number from which on a capture counts as sharp, to be the texture of a wider one.
const SHARP_MARK: f64 = 16.0;

/// Simulates the captures in a folder, measures depth in them, and writes a page.
///
/// Example: real_camera ../captures --out docs/real-camera
#[derive(Parser)]
struct Args {
    /// Folder of the captures; see data.rs.
    data: PathBuf,
    /// Folder to write.
    #[arg(long, default_value = "docs/real-camera")]
    out: PathBuf,
    /// Lens: a built-in name, a .json or a .zmx file.
    #[arg(long, default_value = "lib_50mm_US20210263286_ex1")]
    lens: String,
    /// Pixel: a built-in name of `qpgen response`.
    #[arg(long, default_value = "6um-dual")]
    pixel: String,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("real_camera: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn step(text: &str) {
    eprintln!("real_camera: {text}");
}

fn run(args: &Args) -> Result<(), CommandError> {
    let captures = Captures::find(&args.data)?;
    step("response of the pixel by the wave model");
    let stack = PixelStack::builtin(&args.pixel).map_err(|e| CommandError::input(e.to_string()))?;
    let responses = [
        ("wave", camera::wave(&stack)?),
        ("sharp split", camera::sharp_split()?),
    ];
    let mut results = Results {
        lens: lens_figures(&args.lens)?,
        ..Results::default()
    };
    for flat in captures.flats.iter().filter(|f| f.mark < SHARP_MARK) {
        let twin = (captures.flats.iter())
            .find(|s| s.distance_mm == flat.distance_mm && s.mark >= SHARP_MARK);
        if let Some(sharp) = twin {
            step(&format!(
                "simulating {} mm at F/{}",
                flat.distance_mm, flat.mark
            ));
            let simulated = simulated(&args.lens, &responses, flat, sharp)?;
            results.captures.push(simulated);
        }
    }
    step("shift against aperture");
    results.aperture = apertures(&args.lens, &responses, &captures)?;
    results.depths = all_depths(args, &responses[0].1, &captures)?;
    results.write(&args.out)
}

fn lens_figures(name: &str) -> Result<Vec<LensResult>, CommandError> {
    [1.8, 4.0, 20.0]
        .iter()
        .map(|&mark| {
            let lens = camera::lens(name, mark, camera::FOCUS_MM)?;
            let input = |e: quadpixel::lens::LensError| CommandError::input(e.to_string());
            let p = lens.paraxial(quadpixel::units::D_LINE_NM).map_err(input)?;
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
    responses: &[(&str, Response)],
    flat: &Flat,
    sharp: &Flat,
) -> Result<CaptureResult, CommandError> {
    let (real, picture) = (
        Views::read(&flat.folder)?,
        Views::read(&sharp.folder)?.mean(),
    );
    let size = (picture.width(), picture.height());
    let parts = measure::thirds(size.0, size.1);
    let shifts = |views: &Views| measure::shifts(&views.left, &views.right, &parts);
    let mut result = CaptureResult {
        distance_mm: flat.distance_mm,
        mark: flat.mark,
        coc_px: 0.0,
        measured: shifts(&real)?,
        models: Vec::new(),
    };
    let mut judged = |name: &str, views: &Views| -> Result<(), CommandError> {
        let likeness = compare::compare(views, &real);
        let shifts = shifts(views)?;
        result.models.push(ModelResult {
            name: name.to_owned(),
            likeness,
            shifts,
        });
        Ok(())
    };
    let pair = |response: &Response, focus_mm: f64| -> Result<[Camera; 2], CommandError> {
        let at = |mark: f64| {
            let lens = camera::lens(lens, mark, focus_mm)?;
            camera::camera(&lens, response, size, ShiftRule::ChiefRay)
        };
        Ok([at(flat.mark)?, at(sharp.mark)?])
    };
    let mut coc_px = 0.0;
    for (name, response) in responses {
        let [wide, narrow] = pair(response, camera::FOCUS_MM)?;
        coc_px = coc(&wide, flat.distance_mm)? / wide.sensor().pitch_mm();
        let views = simulate::rendered(&wide, &narrow, &picture, flat.distance_mm)?;
        judged(name, &views)?;
    }
    let found = format!(
        "wave, crosstalk off the axis, focus {} mm",
        camera::FOUND_FOCUS_MM
    );
    let [wide, narrow] = pair(&responses[0].1, camera::FOUND_FOCUS_MM)?;
    let views = simulate::rendered(&wide, &narrow, &picture, flat.distance_mm)?;
    judged(&found, &simulate::with_crosstalk(&views, &wide))?;
    judged("half disks", &simulate::half_disks(&picture, coc_px))?;
    result.coc_px = coc_px;
    Ok(result)
}

/// Circle of confusion, mm, negative in front of the focus.
fn coc(camera: &Camera, distance_mm: f64) -> Result<f64, CommandError> {
    Defocus::new(camera)
        .map(|d| d.circle_of_confusion_mm(distance_mm - camera.sensor_z_mm()))
        .ok_or_else(|| CommandError::failed("a camera without a lens"))
}

fn apertures(
    lens: &str,
    responses: &[(&str, Response)],
    captures: &Captures,
) -> Result<ApertureResult, CommandError> {
    // In front of the focus by as much as the nearest capture.
    const DISTANCE_MM: f64 = 600.0;
    let mut result = ApertureResult::default();
    for (name, response) in responses {
        let points = aperture::simulated(lens, response, DISTANCE_MM)?;
        result.curves.push((name.to_string(), points));
    }
    for flat in &captures.flats {
        let views = Views::read(&flat.folder)?;
        let size = (views.left.width(), views.left.height());
        let parts = measure::thirds(size.0, size.1);
        let shift = &measure::shifts(&views.left, &views.right, &parts)?[1];
        let camera = camera::camera(
            &camera::lens(lens, flat.mark, camera::FOCUS_MM)?,
            &responses[1].1,
            size,
            ShiftRule::ChiefRay,
        )?;
        let coc_px = coc(&camera, flat.distance_mm)? / camera.sensor().pitch_mm();
        let name = format!("{} mm", flat.distance_mm);
        let point = (flat.mark, -shift.whole_px / coc_px);
        result.measured.push((name, coc_px, shift.whole_px, point));
    }
    Ok(result)
}

fn all_depths(
    args: &Args,
    response: &Response,
    captures: &Captures,
) -> Result<Vec<DepthResult>, CommandError> {
    let mut results = Vec::new();
    let mut curves: Vec<(f64, FieldCurve)> = Vec::new();
    let flats = captures.flats.iter().filter(|f| f.mark < SHARP_MARK);
    let flats = flats.map(|f| {
        (
            format!("plane at {} mm", f.distance_mm),
            f.mark,
            &f.folder,
            Some(f.distance_mm),
        )
    });
    let scenes = captures
        .scenes
        .iter()
        .map(|s| (s.name.clone(), SCENE_MARK, &s.folder, None));
    for (name, mark, folder, distance_mm) in flats.chain(scenes) {
        step(&format!("depth of {name}"));
        let views = Views::read(folder)?;
        let size = (views.left.width(), views.left.height());
        if !curves
            .iter()
            .any(|(m, c)| *m == mark && (c.width_px, c.height_px) == size)
        {
            curves.push((mark, curve_at(args, response, mark, size)?));
        }
        let Some((_, curve)) = curves
            .iter()
            .find(|(m, c)| *m == mark && (c.width_px, c.height_px) == size)
        else {
            continue;
        };
        let known_m = match distance_mm {
            Some(mm) => {
                let all = vec![(mm * 1e-3) as f32; size.0 * size.1];
                Image::from_vec(size.0, size.1, 1, all)
                    .unwrap_or_else(|| Image::zeros(size.0, size.1, 1))
            }
            None => data::depth_m(&folder.join("d.png"), size.0, size.1)?,
        };
        let found = depths::found(&views, curve)?;
        results.push(DepthResult {
            claimed: depths::score(&found, &known_m, depths::CLAIM_M),
            all: depths::score(&found, &known_m, f64::INFINITY),
            name,
            mark,
            is_plane: distance_mm.is_some(),
            found,
            known_m,
        });
    }
    Ok(results)
}

/// The calibration file at a marked F-number, written beside the page too.
fn curve_at(
    args: &Args,
    response: &Response,
    mark: f64,
    size: (usize, usize),
) -> Result<FieldCurve, CommandError> {
    step(&format!("disparity against distance at F/{mark}"));
    let lens = camera::lens(&args.lens, mark, camera::FOUND_FOCUS_MM)?;
    let camera = camera::camera(&lens, response, size, ShiftRule::ChiefRay)?;
    let source = format!(
        "simulated: lens {} at F/{mark}, focus {} mm from the sensor, pixel {} by the wave model",
        Path::new(&args.lens)
            .file_name()
            .unwrap_or_default()
            .to_string_lossy(),
        camera::FOUND_FOCUS_MM,
        args.pixel
    );
    let curve = curve::of_camera(&camera, source, depths::WINDOW_PX)?;
    report::write_curve(&args.out, mark, &curve)?;
    Ok(curve)
}
