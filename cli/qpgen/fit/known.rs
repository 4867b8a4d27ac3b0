//! What is known of the camera before the fit: pixel, optics, priors.

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::file;
use quadpixel_laboratory::fit::camera_model::Optics;
use quadpixel_laboratory::fit::capture::CaptureDescription;
use quadpixel_laboratory::fit::conjugates::Conjugates;
use quadpixel_laboratory::fit::figures::FieldFigures;
use quadpixel_laboratory::fit::measurements::{Measurements, sum_of};
use quadpixel_laboratory::fit::parameters::{Known, Parameter, with_prior};

use super::args::FitArgs;
use crate::exit::CommandError;

/// The pixel that the fit begins with.
pub(super) fn pixel(
    args: &FitArgs,
    description: &CaptureDescription,
) -> Result<PixelStack, CommandError> {
    let Some(path) = &args.pixel else {
        return Ok(description.pixel());
    };
    let name = path.to_str().unwrap_or_default();
    if PixelStack::builtin_toml(name).is_some() {
        return PixelStack::builtin(name).map_err(CommandError::input);
    }
    let text = file::read_text(path).map_err(CommandError::input)?;
    PixelStack::from_toml(&text, &path.display().to_string()).map_err(CommandError::input)
}

/// What is known of the camera before the fit.
pub(super) fn known(
    description: &CaptureDescription,
    folder: &Path,
    measured: &Measurements,
) -> Result<(Known, Optics), CommandError> {
    let camera = &description.camera;
    let mut conjugates = Conjugates {
        focal_length_mm: camera.focal_length_mm,
        hiatus_mm: 0.0,
    };
    let mut pupil_mm = None;
    if let Some(lens) = description.lens(folder)? {
        let lens = lens
            .paraxial(camera.wavelength_nm)
            .map_err(CommandError::input)?;
        // A lens that stands in for another one is scaled to its focal length.
        let scale = camera.focal_length_mm / lens.efl_mm;
        conjugates.hiatus_mm = scale * (lens.rear_principal_z_mm - lens.front_principal_z_mm);
        let picture_mm = lens.rear_principal_z_mm + lens.efl_mm;
        pupil_mm = Some(scale * (picture_mm - lens.exit_pupil_z_mm));
    }
    let has_kernels = !measured.fields.is_empty();
    let disk_px = match has_kernels {
        true => middle_disk_px(measured),
        false => largest_disk_px(description, &conjugates),
    };
    let known = Known {
        pitch_um: camera.pitch_um,
        f_number: camera.f_number,
        disk_px,
        focal_length_mm: camera.focal_length_mm,
        pupil_mm: pupil_mm.filter(|mm| *mm > 0.0 && mm.is_finite()),
        focus_mm: camera.focus_mm.filter(|_| !measured.planes.is_empty()),
        has_kernels,
    };
    let optics = Optics {
        f_number: camera.f_number,
        unit_mm: known.unit_mm(),
        side: measured.side,
        view_pixel_um: measured.view_pixel_um,
        collected_at: camera.collected_at,
        conjugates,
    };
    Ok((known, optics))
}

/// Diameter of the largest disk of the planes, px.
fn largest_disk_px(description: &CaptureDescription, lens: &Conjugates) -> f64 {
    let focus_mm = description.camera.focus_mm.unwrap_or(f64::NAN);
    let tangent = 0.5 / description.camera.f_number;
    let radius = |mm: f64| lens.disk_radius_mm(focus_mm, mm, tangent).abs();
    let radii = description
        .planes
        .iter()
        .map(|plane| radius(plane.distance_mm));
    2e3 * radii.fold(0.0, f64::max) / description.views.pixel_um
}

/// Diameter of the disk in the middle of the picture, px.
fn middle_disk_px(measured: &Measurements) -> f64 {
    let [columns, rows] = measured.grid;
    let field = &measured.fields[rows / 2 * columns + columns / 2];
    let sum = sum_of(&field.views, field.left_part);
    let figures = FieldFigures::new(&[sum.clone(), sum], 0.5, measured.side);
    figures.disk_px
}

/// The usual priors, but for those that are given.
pub(super) fn priors(
    mut parameters: Vec<Parameter>,
    given: &[String],
) -> Result<Vec<Parameter>, CommandError> {
    for text in given {
        let refused = |why: String| CommandError::input(format!("--prior {text}: {why}"));
        let parts = text.split_once('=').and_then(|(name, numbers)| {
            let (value, sigma) = numbers.split_once(',')?;
            Some((name, value.parse().ok()?, sigma.parse().ok()?))
        });
        let Some((name, value, sigma)) = parts else {
            return Err(refused("allowed: such as silicon_um=3,0.5".into()));
        };
        let names: Vec<String> = parameters.iter().map(|p| p.name.clone()).collect();
        let found = parameters.iter_mut().find(|p| p.name == name);
        let Some(parameter) = found else {
            return Err(refused(format!(
                "there is no such parameter; there are: {}",
                names.join(", ")
            )));
        };
        with_prior(parameter, value, sigma).map_err(|e| refused(e.to_string()))?;
    }
    Ok(parameters)
}
