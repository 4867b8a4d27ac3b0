//! How rays go through the lens: what a file may say, and what `meta.json` says of it.

use quadpixel::render::{Camera, LensMaps, LensTracing, RenderStats};
use quadpixel_datasets as spec;

use crate::field_error::FieldError;

/// Refuses a bound that nothing meets.
///
/// # Errors
/// The field, its value and what is allowed.
pub(crate) fn check(tracing: &LensTracing) -> Result<(), FieldError> {
    let Some(bound) = tracing.bound() else {
        return Ok(());
    };
    let fields = [
        ("lens_tracing.rms_px", bound.rms_px),
        ("lens_tracing.worst_px", bound.worst_px),
    ];
    let bad = fields.iter().find(|(_, px)| !(*px > 0.0 && px.is_finite()));
    bad.map_or(Ok(()), |&(field, px)| {
        Err(FieldError::new(field, px, "above 0"))
    })
}

/// Why a camera whose lens was to be mapped is traced surface by surface, for people.
pub(crate) fn warning(camera: &Camera) -> Option<String> {
    match camera.lens_maps() {
        LensMaps::Failed {
            wavelength_nm,
            failure,
            ..
        } => Some(format!(
            "the lens is traced surface by surface, which takes longer: it cannot be mapped at {wavelength_nm} nm, {failure}"
        )),
        _ => None,
    }
}

/// What became of it.
pub(crate) fn described(camera: &Camera, stats: &RenderStats) -> spec::LensTracing {
    let exact_share = stats.exact_rays as f64 / stats.rays.max(1) as f64;
    let bounds = |bound: &quadpixel::lens::MapBound| spec::MapError {
        rms_px: bound.rms_px,
        worst_px: bound.worst_px,
    };
    let exact = |method, bound| spec::LensTracing {
        method,
        bound,
        map: None,
        failure: None,
        exact_share,
    };
    match camera.lens_maps() {
        LensMaps::NotAsked => exact(spec::LensMethod::Exact, None),
        LensMaps::TooFewRays => exact(spec::LensMethod::TooFewRays, None),
        LensMaps::Failed { bound, failure, .. } => spec::LensTracing {
            failure: Some(failure.to_string()),
            ..exact(spec::LensMethod::NotMapped, Some(bounds(bound)))
        },
        LensMaps::Mapped { bound, report } => spec::LensTracing {
            map: Some(spec::LensMap {
                degree: report.degree as u32,
                nodes: [report.nodes.0 as u32, report.nodes.1 as u32],
                unmapped_share: report.unmapped_share,
                error: spec::MapError {
                    rms_px: report.rms_px,
                    worst_px: report.worst_px,
                },
            }),
            ..exact(spec::LensMethod::Map, Some(bounds(bound)))
        },
    }
}
