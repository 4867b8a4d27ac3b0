//! The parameters of a camera, each with its prior: what is believed of it before anything is measured.
//!
//! | parameter | unit | of what |
//! |---|---|---|
//! | `radius_um`, `spacer_um`, `silicon_um` | µm | microlens, oxide below the filter, depth of the photodiodes |
//! | `lens_index` | 1 | refractive index of the microlens and of the resin below it |
//! | `isolation_split_um`, `isolation_border_um` | µm | strips between photodiodes, along the border: charge is lost |
//! | `diffusion_um` | µm | how far charge wanders before it is collected: σ, which is the split's width, too |
//! | `crosstalk` | 1 | part of the light of either half that the other one gets, whatever its direction |
//! | `f_number` | 1 | rim of the pupil: sin θ = 1/(2F) |
//! | `pupil_mm` | mm | how far the exit pupil stands before the sensor: the chief rays' angles |
//! | `shift_um`, `shift_1` … `shift_5` | µm, µm/mm^k | shift law, beside the chief ray's place |
//! | `centre_x_mm`, `centre_y_mm` | mm | where the lens's axis meets the sensor |
//! | `blur_px` … `tilt_y_px` | px | the lens: disk of a point out of focus ([`super::lens_law`]) |
//! | `left_over_right` | 1 | what charge of the left half counts for over that of the right one |
//! | `focus_mm` | mm | distance from the sensor that is in focus: of planes alone |

use quadpixel::range::OutOfRange;
use serde::{Deserialize, Serialize};

/// A parameter with its prior, a Gaussian between two bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name, with its unit.
    pub name: String,
    /// What is believed before the data.
    pub prior: f64,
    /// Standard deviation of the belief; 0 holds the parameter where it is.
    pub sigma: f64,
    /// Bounds.
    pub bounds: [f64; 2],
}

/// Which parameter; its number in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // because the table above says it
#[repr(usize)]
pub enum Name {
    RadiusUm,
    SpacerUm,
    SiliconUm,
    LensIndex,
    IsolationSplitUm,
    IsolationBorderUm,
    DiffusionUm,
    Crosstalk,
    FNumber,
    PupilMm,
    ShiftUm,
    Shift1,
    Shift3,
    Shift5,
    CentreXMm,
    CentreYMm,
    BlurPx,
    DefocusPx,
    FieldPx,
    Field4Px,
    SphericalPx,
    Spherical5Px,
    SphericalFieldPx,
    ComaPx,
    ComaFieldPx,
    ComaAperturePx,
    AstigmatismPx,
    EllipticalComaPx,
    AstigmatismFieldPx,
    ObliqueSphericalPx,
    TiltXPx,
    TiltYPx,
    FocusMm,
    LeftOverRight,
}

/// Number of parameters.
pub const COUNT: usize = Name::LeftOverRight as usize + 1;
/// Parameters of the layers: each change of one needs new waves.
pub const LAYERS: [Name; 6] = [
    Name::RadiusUm,
    Name::SpacerUm,
    Name::SiliconUm,
    Name::LensIndex,
    Name::IsolationSplitUm,
    Name::IsolationBorderUm,
];

/// Prior, its deviation, bounds.
type Prior = (f64, f64, [f64; 2]);

/// What is known of the camera before the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Pitch of the microlenses, µm.
    pub pitch_um: f64,
    /// F-number, as the maker says.
    pub f_number: f64,
    /// Diameter of the disk that a point makes in the middle of the picture, px of the views.
    pub disk_px: f64,
    /// Focal length, mm: what changes over the field does so by angles.
    pub focal_length_mm: f64,
    /// How far the exit pupil stands before the sensor, mm, where a lens says so.
    pub pupil_mm: Option<f64>,
    /// Distance from the sensor that was focused on, mm, where planes were captured.
    pub focus_mm: Option<f64>,
    /// Whether kernels tell of the lens.
    pub has_kernels: bool,
}

/// Focal length that the priors of what changes over the field are for, mm.
const PRIOR_FOCAL_LENGTH_MM: f64 = 4.4;
/// Field at which h of the lens's law is 1, focal lengths.
const UNIT_FIELD: f64 = 2.8 / 4.4;
/// Deviation of each term of the shift law at the unit of the field, of the pitch.
const LAW_PART: f64 = 0.3;
/// Deviations of an exit pupil that a lens tells, and of a focus that a scale tells, parts of them.
const PUPIL_PART: f64 = 0.05;
const FOCUS_PART: f64 = 0.03;

impl Known {
    /// Field at which h of the lens's law is 1, mm on the sensor.
    pub fn unit_mm(&self) -> f64 {
        UNIT_FIELD * self.focal_length_mm
    }

    /// The parameters with their priors.
    pub fn parameters(&self) -> Vec<Parameter> {
        let (p, d) = (self.pitch_um, 0.5 * self.disk_px);
        let has_lens = if self.has_kernels { 1.0 } else { 0.0 };
        let lens = |part: f64| (0.0, has_lens * part * d, [-3.0 * d, 3.0 * d]);
        let larger = self.focal_length_mm / PRIOR_FOCAL_LENGTH_MM;
        // More than a part of the pitch at the unit of the field, and light would go over to the neighbours.
        let law = |power: i32, most: f64| {
            let part = p / larger.powi(power);
            let sigma = LAW_PART * p / self.unit_mm().powi(power);
            (0.0, sigma, [-most * part, most * part])
        };
        let pupil =
            (self.pupil_mm).map_or((5.5 * larger, 1.5 * larger), |mm| (mm, PUPIL_PART * mm));
        let focus = (self.focus_mm).map_or((1e3, 0.0), |mm| (mm, FOCUS_PART * mm));
        let centre_mm = 0.05 * larger;
        let isolation = (0.05 * p, 0.05 * p, [0.0, 0.35 * p]);
        let rows: [(&str, Prior); COUNT] = [
            ("radius_um", (0.85 * p, 0.15 * p, [0.708 * p, 3.0 * p])),
            ("spacer_um", (0.5, 0.3, [0.0, p.max(2.0)])),
            ("silicon_um", (3.0, 0.7, [1.0, 6.0])),
            ("lens_index", (1.56, 0.05, [1.4, 1.9])),
            ("isolation_split_um", isolation),
            ("isolation_border_um", isolation),
            ("diffusion_um", (0.08 * p, 0.08 * p, [0.0, 0.4 * p])),
            ("crosstalk", (0.05, 0.05, [0.0, 0.4])),
            (
                "f_number",
                (
                    self.f_number,
                    0.03 * self.f_number,
                    [0.7 * self.f_number, 1.4 * self.f_number],
                ),
            ),
            (
                "pupil_mm",
                (
                    pupil.0,
                    pupil.1,
                    [2.0 * larger.min(1.0), 100.0 * larger.max(1.0)],
                ),
            ),
            ("shift_um", (0.0, 0.1 * p, [-0.5 * p, 0.5 * p])),
            ("shift_1_um_per_mm", law(1, 1.0)),
            ("shift_3_um_per_mm3", law(3, 0.5)),
            ("shift_5_um_per_mm5", law(5, 0.1)),
            (
                "centre_x_mm",
                (0.0, centre_mm, [-10.0 * centre_mm, 10.0 * centre_mm]),
            ),
            (
                "centre_y_mm",
                (0.0, centre_mm, [-10.0 * centre_mm, 10.0 * centre_mm]),
            ),
            ("blur_px", (1.5, 0.5 * has_lens, [0.6, 5.0])),
            ("defocus_px", (d, 0.3 * d * has_lens, [0.2 * d, 3.0 * d])),
            ("field_px", lens(0.5)),
            ("field_4_px", lens(0.5)),
            ("spherical_px", lens(0.5)),
            ("spherical_5_px", lens(0.5)),
            ("spherical_field_px", lens(0.5)),
            ("coma_px", lens(0.5)),
            ("coma_field_px", lens(0.5)),
            ("coma_aperture_px", lens(0.5)),
            ("astigmatism_px", lens(0.5)),
            ("elliptical_coma_px", lens(0.5)),
            ("astigmatism_field_px", lens(0.5)),
            ("oblique_spherical_px", lens(0.5)),
            ("tilt_x_px", lens(0.1)),
            ("tilt_y_px", lens(0.1)),
            (
                "focus_mm",
                (focus.0, focus.1, [0.5 * focus.0, 2.0 * focus.0]),
            ),
            ("left_over_right", (1.0, 0.1 * has_lens, [0.5, 2.0])),
        ];
        let parameter = |(name, (prior, sigma, bounds)): (&str, Prior)| Parameter {
            name: name.to_owned(),
            prior,
            sigma,
            bounds,
        };
        rows.into_iter().map(parameter).collect()
    }
}

/// Checks that a value and a deviation can be a prior.
///
/// # Errors
/// The value lies outside the parameter's bounds, or the deviation is negative or not finite.
pub fn with_prior(parameter: &mut Parameter, value: f64, sigma: f64) -> Result<(), OutOfRange> {
    let [low, high] = parameter.bounds;
    quadpixel::range::within("prior", parameter.name.clone(), value, low..=high)?;
    quadpixel::range::within("prior", "sigma", sigma, 0.0..=1e9)?;
    (parameter.prior, parameter.sigma) = (value, sigma);
    Ok(())
}
