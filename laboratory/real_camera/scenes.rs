//! Depth of all captures: planes by their distance, scenes by their maps.

use std::error::Error;
use std::path::Path;

use quadpixel::image::Image;
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::dense::DenseSettings;
use quadpixel_algorithms::depth::{FieldCurve, PlaneShifts, Shifts, calibrate_by};
use quadpixel_laboratory::curve::{CountedFrom, CurvePlan, field_curve};

use crate::args::{Args, step};
use crate::camera::{self, Model};
use crate::data::{self, Captures, SHARP_MARK, Views};
use crate::results::{DepthResult, Results};
use crate::{depths, report};

/// The F-number of scenes, which their folders do not say: the published network for these captures is trained at F/4.
const SCENE_MARK: f64 = 4.0;

/// A capture whose depth is known.
struct Known<'a> {
    name: String,
    kind: &'a str,
    mark: f64,
    folder: &'a Path,
    /// Of a plane.
    distance_mm: Option<f64>,
}

/// Estimates, scores and keeps, by the simulated curve and by that brought to the planes; what cannot be read is left
/// out and said.
pub fn all_depths(
    args: &Args,
    model: &Model,
    captures: &Captures,
    results: &mut Results,
) -> Result<(), Box<dyn Error>> {
    let flats = captures.flats.iter().filter(|f| f.mark < SHARP_MARK);
    let flats = flats.map(|f| Known {
        name: format!("plane at {} mm", f.distance_mm),
        kind: "plane",
        mark: f.mark,
        folder: &f.folder,
        distance_mm: Some(f.distance_mm),
    });
    let scenes = captures.scenes.iter().map(|s| Known {
        name: s.name.clone(),
        kind: s.kind(),
        mark: SCENE_MARK,
        folder: &s.folder,
        distance_mm: None,
    });
    let all: Vec<Known<'_>> = flats.chain(scenes).collect();
    let mut curves: Vec<(f64, FieldCurve)> = Vec::new();
    for known in &all {
        step(&format!("depth of {}", known.name));
        let fitted = known
            .distance_mm
            .is_some_and(|d| (d, known.mark) == camera::FITTED_ON);
        let found = curve_for(args, model, &mut curves, known)
            .and_then(|curve| depth_of(known, curve, fitted));
        match found {
            Ok(found) => results.depths.push(found),
            Err(e) => results.left_out.push(format!("{}: {e}", known.name)),
        }
    }
    for (mark, curve) in &curves {
        let of_mark = || all.iter().filter(|known| known.mark == *mark);
        let planes: Vec<&Known<'_>> = of_mark().filter(|k| k.distance_mm.is_some()).collect();
        if planes.len() < 2 {
            continue;
        }
        step(&format!(
            "focus and gain at F/{mark} by {} planes",
            planes.len()
        ));
        let calibrated = match by_planes(curve, &planes) {
            Ok(calibrated) => calibrated,
            Err(e) => {
                results.left_out.push(format!("planes at F/{mark}: {e}"));
                continue;
            }
        };
        report::write_curve(
            &args.out,
            &format!("curve-f{mark}-planes.json"),
            &calibrated,
        )?;
        for known in of_mark() {
            let fitted = known.distance_mm.is_some();
            match depth_of(known, &calibrated, fitted) {
                Ok(found) => results.calibrated.push(found),
                Err(e) => results.left_out.push(format!("{}: {e}", known.name)),
            }
        }
    }
    Ok(())
}

/// The curve brought to planes as `qpalgo calibrate-depth` does.
fn by_planes(curve: &FieldCurve, planes: &[&Known<'_>]) -> Result<FieldCurve, Box<dyn Error>> {
    let found = calibrate_by(curve, |ratios| {
        let known = DenseSettings {
            ratio: ratios.cloned(),
            ..DenseSettings::default()
        };
        let matched = planes.iter().map(|plane| {
            let [left, right] = ["l.png", "r.png"].map(|name| plane.folder.join(name));
            let capture = Capture::from_pair(&left, &right, true)?;
            let shifts = Shifts::dense(&capture, &known)?;
            Ok(PlaneShifts {
                distance_m: 1e-3 * plane.distance_mm.unwrap_or(f64::NAN),
                size_px: shifts.size_px,
                shifts: shifts.left_right.unwrap_or_default(),
            })
        });
        matched.collect::<Result<Vec<_>, Box<dyn Error>>>()
    })?;
    Ok(found.curve)
}

/// The simulated curve of a capture; `curves` are those that were made.
fn curve_for<'a>(
    args: &Args,
    model: &Model,
    curves: &'a mut Vec<(f64, FieldCurve)>,
    known: &Known<'_>,
) -> Result<&'a FieldCurve, Box<dyn Error>> {
    let views = Views::read(known.folder)?;
    let (mark, size) = (known.mark, (views.left.width(), views.left.height()));
    let fits = |(m, c): &(f64, FieldCurve)| *m == mark && (c.width_px, c.height_px) == size;
    let at = match curves.iter().position(fits) {
        Some(at) => at,
        None => {
            curves.push((mark, curve_at(args, model, mark, size)?));
            curves.len() - 1
        }
    };
    Ok(&curves[at].1)
}

/// Estimated and known depth of one capture.
fn depth_of(
    known: &Known<'_>,
    curve: &FieldCurve,
    fitted: bool,
) -> Result<DepthResult, Box<dyn Error>> {
    let views = Views::read(known.folder)?;
    let size = (views.left.width(), views.left.height());
    let known_m = match known.distance_mm {
        Some(mm) => {
            let all = vec![(mm * 1e-3) as f32; size.0 * size.1];
            Image::from_vec(size.0, size.1, 1, all)
                .unwrap_or_else(|| Image::zeros(size.0, size.1, 1))
        }
        None => data::depth_m(&known.folder.join("d.png"), size.0, size.1)?,
    };
    let found = depths::found(&views, curve)?;
    Ok(DepthResult {
        claimed: depths::score(&found, &known_m, depths::CLAIM_M),
        all: depths::score(&found, &known_m, f64::INFINITY),
        fitted,
        kind: known.kind.to_owned(),
        name: known.name.clone(),
        mark: known.mark,
        found,
        known_m,
    })
}

/// Nodes of a curve over the picture, and its distances: 1/Z from 0.1 to 2.4 per m.
const NODES: (usize, usize) = (9, 7);
const DISTANCES: usize = 24;
const STEP_PER_M: f64 = 0.1;

/// The calibration file at a marked F-number, written beside the page too.
fn curve_at(
    args: &Args,
    model: &Model,
    mark: f64,
    size: (usize, usize),
) -> Result<FieldCurve, Box<dyn Error>> {
    step(&format!("disparity against distance at F/{mark}"));
    let lens = camera::lens(&args.lens, mark, camera::FOCUS_MM)?;
    let camera = camera::camera(&lens, model, size)?;
    let source = format!(
        "simulated: lens {} at F/{mark}, focus {} mm from the sensor, pixel {} by the {} model, charge spread {} um",
        Path::new(&args.lens)
            .file_name()
            .unwrap_or_default()
            .to_string_lossy(),
        camera::FOCUS_MM,
        args.pixel,
        model.name,
        camera::CHARGE_SPREAD_UM
    );
    let plan = CurvePlan {
        source,
        counted_from: CountedFrom::Sensor,
        inverse_distances_per_m: (1..=DISTANCES).map(|k| STEP_PER_M * k as f64).collect(),
        nodes: NODES,
        window_px: None,
    };
    let curve = field_curve(&camera, plan)?;
    report::write_curve(&args.out, &format!("curve-f{mark}.json"), &curve)?;
    Ok(curve)
}
