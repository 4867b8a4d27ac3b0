//! Lenses: names, figures, spots, drawings.

use pyo3::prelude::*;
use quadpixel::lens::{
    Field, FocusBy, Lens, LensError, Prescription, SPOT_LINES_NM, builtin_names, rms_radius,
};
use quadpixel::units::D_LINE_NM;
use quadpixel_laboratory::lens_drawing::layout_svg;
use serde_json::json;

use crate::call::run;
use crate::json::of;

/// Parts of the half field of a spot diagram and of a drawing, as of the command line.
const SPOT_FIELDS: [f64; 5] = [0.0, 0.35, 0.7, 0.85, 1.0];
const SECTION_FIELDS: [f64; 3] = [0.0, 0.6, 1.0];

/// Names of the built-in lenses.
#[pyfunction]
pub fn lens_names() -> Vec<&'static str> {
    builtin_names()
}

fn lens(name: &str, focus_mm: Option<f64>, f_number: Option<f64>) -> Result<Lens, LensError> {
    let mut lens = Lens::new(&Prescription::named(name)?)?;
    if let Some(f_number) = f_number {
        lens = lens.with_f_number(f_number)?;
    }
    match focus_mm {
        Some(distance_mm) => lens.focused_at(distance_mm, FocusBy::Sensor, D_LINE_NM),
        None => Ok(lens),
    }
}

/// Field angles of a lens, deg.
fn fields_deg(lens: &Lens, parts: &[f64]) -> Result<Vec<f64>, LensError> {
    let half = lens.half_field_deg()?;
    Ok(parts.iter().map(|part| part * half).collect())
}

/// Paraxial figures at the d line, as JSON.
#[pyfunction]
#[pyo3(signature = (name, focus_mm=None, f_number=None))]
pub fn lens_info(
    py: Python<'_>,
    name: String,
    focus_mm: Option<f64>,
    f_number: Option<f64>,
) -> PyResult<String> {
    run(py, None, move |watch| {
        let lens = lens(&name, focus_mm, f_number)?;
        let p = lens.paraxial(D_LINE_NM)?;
        let prescription = lens.prescription();
        prescription
            .warnings
            .iter()
            .for_each(|text| watch.warn(text));
        let info = json!({
            "title": prescription.title(), "source": prescription.source, "efl_mm": p.efl_mm, "f_number": p.f_number,
            "half_field_deg": lens.half_field_deg()?, "sensor_z_mm": lens.sensor_z_mm(),
        });
        Ok(of(info))
    })
}

/// Spot diagrams, as JSON: the words of `qpgen lens spots --json`.
#[pyfunction]
#[pyo3(signature = (name, focus_mm=None, f_number=None))]
pub fn lens_spots(
    py: Python<'_>,
    name: String,
    focus_mm: Option<f64>,
    f_number: Option<f64>,
) -> PyResult<String> {
    run(py, None, move |_| {
        let lens = lens(&name, focus_mm, f_number)?;
        let mut spots = Vec::new();
        for angle in fields_deg(&lens, &SPOT_FIELDS)? {
            for line in SPOT_LINES_NM {
                let spot = lens.spot(Field::up(angle), line)?;
                let points: Vec<[f64; 2]> = spot.points_mm.iter().map(|p| p.to_array()).collect();
                spots.push(json!({
                    "field_deg": angle, "wavelength_nm": line, "rays_sent": spot.sent,
                    "rms_um": rms_radius(&spot.points_mm).map(|r| r * 1e3), "points_mm": points,
                }));
            }
        }
        Ok(of(spots.into()))
    })
}

/// The section with fans of rays, as SVG.
#[pyfunction]
#[pyo3(signature = (name, focus_mm=None, f_number=None))]
pub fn lens_layout(
    py: Python<'_>,
    name: String,
    focus_mm: Option<f64>,
    f_number: Option<f64>,
) -> PyResult<String> {
    run(py, None, move |_| {
        let lens = lens(&name, focus_mm, f_number)?;
        Ok(layout_svg(&lens, &fields_deg(&lens, &SECTION_FIELDS)?)?)
    })
}
