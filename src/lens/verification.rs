//! A lens against the figures in its own file: those its source states, and those an independent tracer found.
//!
//! What a figure may differ by follows from its digits and from nothing else:
//!
//! | figure | may differ by |
//! |---|---|
//! | found by the independent tracer: lengths, focal length | one unit of the last digit kept (0.1 µm) |
//! | — focal lengths of elements | one unit of the last digit kept (1 µm) |
//! | — entrance pupil diameter | half a unit, and what half a unit of the stop's semi-aperture makes of it |
//! | — F-number | one unit of the last digit kept (1e-4), and what half a unit of the stop makes of it |
//! | — chief-ray angle, distortion | one unit of the last digit kept (0.01°, 0.001 %) |
//! | — rays that pass, of 241 | those that pass within 0.5 µm of an edge: semi-apertures are kept to 1 µm |
//! | — RMS spot | 2 % or 0.02 µm |
//! | stated by the source | 0.5 %: indices are printed to three digits, 0.0005 in 0.5 |
//!
//! Stated figures that differ by more are listed in [`WHY_STATED_FIGURES_DIFFER`] with the reason.

use super::aim::Field;
use super::analysis::FieldFigures;
use super::error::LensError;
use super::paraxial::singlet_efl_mm;
use super::placed::Lens;
use super::prescription::{Prescription, VerifiedField};
use crate::units::D_LINE_NM;

const STATED_PART: f64 = 5e-3;
const SPOT_PART: f64 = 0.02;
const SPOT_UM: f64 = 0.02;
const SEMI_APERTURE_DIGIT_MM: f64 = 5e-4;
/// Room for the rounding of a printed decimal to binary.
const DECIMAL_ROUNDING: f64 = 1e-9;

/// Stated figures that the prescription printed beside them does not have: lens, figure, why. Each is what the
/// independent tracer finds too.
pub const WHY_STATED_FIGURES_DIFFER: &[(&str, &str, &str)] = &[
    (
        "lib_dgauss_50mm",
        "EFL, mm",
        "a nominal length: the file is the book's lens scaled by one half, and its radii give 50.36 mm",
    ),
    (
        "lib_dgauss_50mm",
        "F-number",
        "nominal: the printed stop (17.1 mm) gives F/2.03",
    ),
    (
        "lib_fisheye_10mm",
        "F-number",
        "nominal: the printed stop (6.08 mm) gives F/3.95",
    ),
    (
        "lib_telephoto_250mm",
        "F-number",
        "nominal: the printed stop (40.5 mm) gives F/5.42",
    ),
    (
        "wide_US11940605B2_emb1",
        "focal length of Lens 5, mm",
        "a meniscus nearly without power: half a last digit of one radius (0.5 µm of 1.256 mm) moves its focal length by 1.2 %",
    ),
    (
        "wide_deeplens_cellphone80deg",
        "EFL, mm",
        "not a paraxial length: it is the image height over the tangent of the real half field, 3.83 mm / tan 41.39°, and so holds \
         15 % of distortion (the chief ray of that field lands at 3.81 mm here)",
    ),
    (
        "wide_deeplens_cellphone80deg",
        "F-number",
        "that length over the pupil's diameter, 4.346 / 2.18",
    ),
    (
        "wide_deeplens_cellphone80deg",
        "image height at the half field, mm",
        "the sensor's half diagonal, reached at 41.7°; 40° is nominal",
    ),
];

/// Who gives a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The source of the lens.
    Stated,
    /// The independent tracer.
    Verified,
}

/// One figure of a lens, as given and as this crate finds it. `None` = there is no such value (a clipped chief ray).
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Who gives it.
    pub origin: Origin,
    /// Its name, such as `RMS d, µm`.
    pub figure: String,
    /// Field angle, degrees, of a figure over the field.
    pub field_deg: Option<f64>,
    /// As given.
    pub given: Option<f64>,
    /// As found.
    pub found: Option<f64>,
    /// Largest difference with which they agree.
    pub tolerance: f64,
}

impl Comparison {
    /// Whether the two agree: both within the tolerance, or both absent.
    pub fn agrees(&self) -> bool {
        match (self.given, self.found) {
            (Some(given), Some(found)) => {
                (given - found).abs() <= self.tolerance + DECIMAL_ROUNDING * given.abs()
            }
            (given, found) => given.is_none() && found.is_none(),
        }
    }

    /// Why the figure that the source of `lens` states is not the prescription's, where that is known.
    pub fn why_it_differs(&self, lens: &str) -> Option<&'static str> {
        WHY_STATED_FIGURES_DIFFER
            .iter()
            .find(|(name, figure, _)| {
                self.origin == Origin::Stated && *name == lens && *figure == self.figure
            })
            .map(|(_, _, why)| *why)
    }
}

/// All figures of one lens.
#[derive(Clone, Debug, Default)]
struct List(Vec<Comparison>);

impl List {
    fn stated(&mut self, figure: &str, given: Option<f64>, found: Option<f64>) {
        if given.is_some() {
            self.0.push(Comparison {
                origin: Origin::Stated,
                figure: figure.into(),
                field_deg: None,
                given,
                found,
                tolerance: STATED_PART * given.unwrap_or(0.0).abs(),
            });
        }
    }

    fn verified(&mut self, figure: &str, given: Option<f64>, found: f64, tolerance: f64) {
        if given.is_some() {
            self.0.push(Comparison {
                origin: Origin::Verified,
                figure: figure.into(),
                field_deg: None,
                given,
                found: Some(found),
                tolerance,
            });
        }
    }
}

/// Compares every figure in the file of a lens with what this crate finds.
///
/// # Errors
/// Those of [`Lens::new`].
pub fn compare(prescription: &Prescription) -> Result<Vec<Comparison>, LensError> {
    let lens = Lens::new(prescription)?;
    let mut list = List::default();
    compare_paraxial(&lens, &mut list)?;
    compare_elements(&lens, &mut list)?;
    for given in &prescription.verification.rms_spot_um {
        let found = lens.field_figures(Field::up(given.field_deg))?;
        let doubtful = rays_near_an_edge(prescription, found.field)?;
        compare_field(given, &found, doubtful, &mut list);
    }
    Ok(list.0)
}

/// How many rays more pass when every semi-aperture but the stop's is half its last digit larger than when it is as
/// much smaller.
fn rays_near_an_edge(prescription: &Prescription, field: Field) -> Result<f64, LensError> {
    let passing = |change_mm: f64| -> Result<f64, LensError> {
        let mut changed = prescription.clone();
        for surface in changed.surfaces.iter_mut().filter(|s| !s.is_stop) {
            surface.semi_aperture_mm += change_mm;
        }
        let spot = Lens::new(&changed)?.spot(field, D_LINE_NM)?;
        Ok(spot.points_mm.len() as f64)
    };
    Ok(passing(SEMI_APERTURE_DIGIT_MM)? - passing(-SEMI_APERTURE_DIGIT_MM)?)
}

fn compare_paraxial(lens: &Lens, list: &mut List) -> Result<(), LensError> {
    let prescription = lens.prescription();
    let (s, v) = (&prescription.stated, &prescription.verification);
    let p = lens.paraxial(D_LINE_NM)?;
    let stop_mm = lens.stop_semi_mm();
    list.stated("EFL, mm", s.efl_mm, Some(p.efl_mm));
    list.stated("F-number", s.f_number, Some(p.f_number));
    let diameter = s.aperture_stop_diameter_mm;
    list.stated("stop diameter, mm", diameter, Some(2.0 * stop_mm));
    if let (Some(height), Some(half_fov)) = (s.image_height_mm, s.half_fov_deg) {
        let corner = lens.field_figures(Field::up(half_fov))?.chief_height_mm;
        list.stated("image height at the half field, mm", Some(height), corner);
    }
    let epd = 2.0 * p.entrance_pupil_semi_mm;
    let stop_part = 0.5e-4 / stop_mm;
    let epd_tolerance = 0.5e-4 + epd * stop_part;
    let f_tolerance = 1e-4 + p.f_number * stop_part;
    let last_mm = prescription.surfaces.last().map_or(0.0, |s| s.thickness_mm);
    list.verified("EFL, mm", v.computed_efl_mm, p.efl_mm, 1e-4);
    list.verified("BFL, mm", v.computed_bfl_mm, p.bfl_mm, 1e-4);
    list.verified("image distance, mm", v.given_bfl_mm, last_mm, 1e-4);
    list.verified("entrance pupil diameter, mm", v.epd_mm, epd, epd_tolerance);
    list.verified("F-number", v.computed_f_number, p.f_number, f_tolerance);
    let stop = v.stop_semi_aperture_mm;
    list.verified("stop semi-aperture, mm", stop, stop_mm, 1e-4);
    let pupil = v.entrance_pupil_z_mm_from_surface0;
    list.verified("entrance pupil z, mm", pupil, p.entrance_pupil_z_mm, 1e-4);
    let track = v.total_track_surface0_to_image_mm;
    list.verified("image plane z, mm", track, lens.sensor_z_mm(), 1e-4);
    Ok(())
}

fn compare_elements(lens: &Lens, list: &mut List) -> Result<(), LensError> {
    let prescription = lens.prescription();
    let surfaces = lens.at(D_LINE_NM)?.surfaces;
    for given in &prescription
        .verification
        .element_focal_lengths_printed_vs_computed
    {
        let front = prescription
            .surfaces
            .iter()
            .position(|s| s.label == given.element);
        let found = front.and_then(|i| Some(singlet_efl_mm(&surfaces[i], surfaces.get(i + 1)?)));
        let figure = format!("focal length of {}, mm", given.element);
        list.stated(&figure, Some(given.printed_mm), found);
        let found = found.unwrap_or(f64::NAN);
        list.verified(&figure, Some(given.computed_mm), found, 1e-3);
    }
    Ok(())
}

fn compare_field(given: &VerifiedField, found: &FieldFigures, doubtful: f64, list: &mut List) {
    let spot = |rms: Option<f64>| (SPOT_PART * rms.unwrap_or(0.0)).max(SPOT_UM);
    let chief_passes = given.chief_height_mm.is_some();
    let distortion = Some(given.distortion_vs_ftan_pct).filter(|_| chief_passes);
    let through = given.rays_through.split('/').next().unwrap_or("");
    let rows = [
        (
            "chief height, mm",
            given.chief_height_mm,
            found.chief_height_mm,
            1e-4,
        ),
        (
            "chief-ray angle, °",
            given.chief_ray_angle_deg,
            found.chief_ray_angle_deg,
            0.01,
        ),
        ("distortion, %", distortion, found.distortion_pct, 1e-3),
        (
            "rays of 241",
            through.parse().ok(),
            Some(found.rays_through as f64),
            doubtful,
        ),
        ("RMS d, µm", given.rms_d, found.rms_d_um, spot(given.rms_d)),
        (
            "RMS FdC, µm",
            given.rms_fdc,
            found.rms_fdc_um,
            spot(given.rms_fdc),
        ),
    ];
    for (figure, given_value, found, tolerance) in rows {
        list.0.push(Comparison {
            origin: Origin::Verified,
            figure: figure.into(),
            field_deg: Some(given.field_deg),
            given: given_value,
            found,
            tolerance,
        });
    }
}
