//! Sizes of surfaces from the paraxial bundles of the axis and of the largest field, where a file gives none.

use super::commands::{Header, SystemAperture};
use super::surface::SeqSurface;
use crate::lens::error::LensError;
use crate::lens::zmx::format_error;
use crate::units::D_LINE_NM;

/// What the head of a file comes to.
pub(super) struct Aperture {
    pub stop_semi_mm: f64,
    /// Height of the marginal ray on each surface, mm.
    marginal_mm: Vec<f64>,
}

/// Heights of a paraxial ray on the surfaces behind the object, from the first one's height and the angle before it.
fn heights(surfaces: &[SeqSurface], height: f64, angle: f64) -> (Vec<f64>, f64) {
    let index = |s: &SeqSurface| s.glass.map_or(1.0, |g| g.index(D_LINE_NM));
    let (mut y, mut u, mut before) = (height, angle, 1.0);
    let mut all = vec![0.0; surfaces.len()];
    for i in 1..surfaces.len() {
        all[i] = y;
        let after = index(&surfaces[i]);
        let bend = surfaces[i].curvature + 2.0 * surfaces[i].aspheric[0];
        u = (before * u - y * bend * (after - before)) / after;
        if i + 1 < surfaces.len() {
            y += u * surfaces[i].thickness;
        }
        before = after;
    }
    (all, u)
}

/// The stop among the surfaces between object and image.
pub(super) fn stop(surfaces: &[SeqSurface]) -> Option<usize> {
    (1..surfaces.len() - 1).find(|&i| surfaces[i].is_stop)
}

/// The entrance pupil that `EPD` or `FNO` says, or the stop's own `CIR`.
pub(super) fn entrance_pupil(
    file: &str,
    surfaces: &[SeqSurface],
    header: &Header,
) -> Result<Aperture, LensError> {
    let stop = stop(surfaces).ok_or_else(|| {
        let reason = "no surface of the lens is the stop; allowed: one";
        format_error(file, "STO", reason)
    })?;
    let (unit, angle) = heights(&surfaces[..surfaces.len() - 1], 1.0, 0.0);
    let semi_mm = match (header.aperture, surfaces[stop].semi_mm) {
        (Some(SystemAperture::EntrancePupilDiameter(d)), _) => 0.5 * d * header.mm_per_unit,
        // f = −1/u' of a ray of height 1.
        (Some(SystemAperture::FNumber(f)), _) => (0.5 / (angle * f)).abs(),
        (None, Some(semi)) => (semi / unit[stop]).abs(),
        (None, None) => f64::NAN,
    };
    if !(semi_mm > 0.0 && semi_mm.is_finite()) {
        let reason =
            "nothing tells the size of the stop; allowed: EPD, FNO, or CIR below STO, above 0";
        return Err(format_error(file, "EPD", reason));
    }
    let marginal_mm: Vec<f64> = unit.iter().map(|y| semi_mm * y.abs()).collect();
    Ok(Aperture {
        stop_semi_mm: marginal_mm[stop],
        marginal_mm,
    })
}

/// Gives surfaces without `CIR` the size of the two bundles.
pub(super) fn fill_apertures(
    surfaces: &mut [SeqSurface],
    aperture: &Aperture,
    header: &Header,
    room: f64,
) {
    let stop = stop(surfaces).unwrap_or(1);
    let body = &surfaces[..surfaces.len() - 1];
    let (unit, end) = heights(body, 1.0, 0.0);
    let (slanted, _) = heights(body, 0.0, 1.0);
    let tangent = match header.field_deg {
        0.0 => (header.image_height * header.mm_per_unit * end).abs(),
        deg => deg.to_radians().tan(),
    };
    // The chief ray passes the middle of the stop.
    let first_mm = -tangent * slanted[stop] / unit[stop];
    let chief_mm = |i: usize| (first_mm * unit[i] + tangent * slanted[i]).abs();
    let filled: Vec<f64> = (0..body.len())
        .map(|i| room * (aperture.marginal_mm[i] + chief_mm(i)))
        .collect();
    for (surface, semi) in surfaces.iter_mut().zip(filled) {
        surface.semi_mm = surface.semi_mm.or(Some(semi).filter(|s| s.is_finite()));
    }
}
