//! Depth of all captures: planes by their distance, scenes by their maps.

use std::error::Error;
use std::path::Path;

use quadpixel::image::Image;
use quadpixel_algorithms::depth::FieldCurve;
use quadpixel_laboratory::curve::{CountedFrom, CurvePlan, field_curve};

use crate::args::{Args, step};
use crate::camera::{self, Model};
use crate::data::{self, Captures, SHARP_MARK, Views};
use crate::results::{DepthResult, Results};
use crate::{depths, report};

/// The F-number of scenes, which their folders do not say: the published network for these captures is trained at F/4.
const SCENE_MARK: f64 = 4.0;

/// Estimates, scores and keeps; what cannot be read is left out and said.
pub fn all_depths(
    args: &Args,
    model: &Model,
    captures: &Captures,
    results: &mut Results,
) -> Result<(), Box<dyn Error>> {
    let mut curves: Vec<(f64, FieldCurve)> = Vec::new();
    let flats = captures.flats.iter().filter(|f| f.mark < SHARP_MARK);
    let flats = flats.map(|f| {
        let name = format!("plane at {} mm", f.distance_mm);
        (name, "plane", f.mark, &f.folder, Some(f.distance_mm))
    });
    let scenes =
        (captures.scenes.iter()).map(|s| (s.name.clone(), s.kind(), SCENE_MARK, &s.folder, None));
    for (name, kind, mark, folder, distance_mm) in flats.chain(scenes) {
        step(&format!("depth of {name}"));
        match depth_of(args, model, &mut curves, (mark, folder, distance_mm)) {
            Ok((found, known_m)) => results.depths.push(DepthResult {
                claimed: depths::score(&found, &known_m, depths::CLAIM_M),
                all: depths::score(&found, &known_m, f64::INFINITY),
                fitted: distance_mm.is_some_and(|d| (d, mark) == camera::FITTED_ON),
                kind: kind.to_owned(),
                name,
                mark,
                found,
                known_m,
            }),
            Err(e) => results.left_out.push(format!("{name}: {e}")),
        }
    }
    Ok(())
}

/// Estimated and known depth of one capture; `curves` are those that were made.
fn depth_of(
    args: &Args,
    model: &Model,
    curves: &mut Vec<(f64, FieldCurve)>,
    (mark, folder, distance_mm): (f64, &Path, Option<f64>),
) -> Result<(depths::Found, Image), Box<dyn Error>> {
    let views = Views::read(folder)?;
    let size = (views.left.width(), views.left.height());
    let known_m = match distance_mm {
        Some(mm) => {
            let all = vec![(mm * 1e-3) as f32; size.0 * size.1];
            Image::from_vec(size.0, size.1, 1, all)
                .unwrap_or_else(|| Image::zeros(size.0, size.1, 1))
        }
        None => data::depth_m(&folder.join("d.png"), size.0, size.1)?,
    };
    let fits = |(m, c): &(f64, FieldCurve)| *m == mark && (c.width_px, c.height_px) == size;
    let at = match curves.iter().position(fits) {
        Some(at) => at,
        None => {
            curves.push((mark, curve_at(args, model, mark, size)?));
            curves.len() - 1
        }
    };
    Ok((depths::found(&views, &curves[at].1)?, known_m))
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
    report::write_curve(&args.out, mark, &curve)?;
    Ok(curve)
}
