//! The camera file of a fit.

use glam::{DMat4, DVec4};
use quadpixel::sensor::{Charge, MicrolensLaw};
use quadpixel_generators::camera_file::{CameraFile, LensPart};

use super::Fitted;
use super::camera_model::{CameraModel, Set};
use super::capture::CaptureDescription;
use super::error::FitError;
use super::parameters::Name;

/// Places over the field that the law of the microlenses is taken at.
const PLACES: usize = 41;

/// What a fit found, as `--camera` of other commands takes it; the law of the microlenses over the field to `half_mm`
/// from the middle.
///
/// # Errors
/// A pixel that cannot be.
pub fn camera_file(
    description: &CaptureDescription,
    model: &CameraModel,
    fitted: &Fitted,
    half_mm: f64,
) -> Result<CameraFile, FitError> {
    let v = |name: Name| fitted.values[name as usize];
    let set = model.at(&fitted.values)?;
    Ok(CameraFile {
        name: description.camera.name.clone(),
        lens: LensPart {
            file: description.camera.lens.clone(),
            focal_length_mm: description.camera.focal_length_mm,
            f_number: v(Name::FNumber),
        },
        charge: Charge {
            diffusion_um: v(Name::DiffusionUm),
            crosstalk: v(Name::Crosstalk),
            collected_at: description.camera.collected_at,
        },
        left_over_right: v(Name::LeftOverRight),
        microlenses: law(&set, v(Name::CentreXMm), half_mm),
        pixel: model.pixel(&fitted.values),
        parameters: fitted.table(),
    })
}

/// How far the microlenses stand beside where both halves get the same. Beside the first-order place, which the fit's
/// own law counts from, it would hold for the fitted chief rays alone; another lens in the place of the camera's has
/// others.
fn law(set: &Set<'_>, axis_x_mm: f64, half_mm: f64) -> MicrolensLaw {
    let (mut normal, mut right) = (DMat4::ZERO, DVec4::ZERO);
    for k in 0..PLACES {
        let x = 2.0 * k as f64 / (PLACES - 1) as f64 - 1.0;
        let beside = set.beside_balance_um(axis_x_mm + half_mm * x);
        let basis = DVec4::new(1.0, x, x.powi(3), x.powi(5));
        normal += DMat4::from_cols(
            basis * basis.x,
            basis * basis.y,
            basis * basis.z,
            basis * basis.w,
        );
        right += beside * basis;
    }
    let k = normal.inverse() * right;
    MicrolensLaw {
        um: k.x,
        um_per_mm: k.y / half_mm,
        um_per_mm3: k.z / half_mm.powi(3),
        um_per_mm5: k.w / half_mm.powi(5),
        axis_x_mm,
    }
}
