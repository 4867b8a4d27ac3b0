//! The studies whose result is curves, and the pixels of each.

use quadpixel::em::light::direction_cosines;
use quadpixel::em::{Material, PixelStack};
use quadpixel::response::ResponseError;

use crate::error::LaboratoryError;
use quadpixel_generators::assemble::pixel;

/// Wavelength of all studies but one, nm.
const GREEN_NM: f64 = 550.0;
/// Chief-ray angle of the shifted lens of Fig. 13, deg.
const CHIEF_RAY_DEG: f64 = 25.0;
/// Pitches of Fig. 11, µm.
const PITCHES_UM: [f64; 9] = [1.2, 1.6, 2.0, 2.4, 2.8, 3.5, 4.0, 5.0, 6.0];

/// A study whose result is curves of P over θ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CurveStudy {
    /// P of left and right sub-pixel over θ, and their ratio (Fig. 2), of pixels by built-in name or TOML file.
    Rejection {
        /// Names or files.
        pixels: Vec<String>,
    },
    /// Nine microlenses on the 3.5 µm pixel, ranked by the paper's four criteria (section 2.1.2).
    Microlens,
    /// R_a and R_b from 1.2 to 6 µm (Fig. 11).
    Pitch,
    /// 1.6 µm pixel at 400, 532 and 700 nm, centred and shifted for a chief ray at 25° (Fig. 13).
    Wavelength,
    /// Colour filters of 1 µm and 750 nm (Fig. 3(a)).
    Filter,
    /// Tungsten walls on the 2.8 µm pixel (Fig. 3(b)); needs a vector model.
    Tungsten,
}

impl CurveStudy {
    /// Stem of its files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Rejection { .. } => "rejection",
            Self::Microlens => "microlens",
            Self::Pitch => "pitch",
            Self::Wavelength => "wavelength",
            Self::Filter => "filter",
            Self::Tungsten => "tungsten",
        }
    }
}

/// One curve of a study.
pub(super) struct Case {
    pub name: String,
    pub stack: PixelStack,
    pub wavelength_nm: f64,
    /// Chief-ray angle that the lens is shifted for, deg; the curve is taken about it.
    pub centre_deg: f64,
    /// (R_a, R_b) that the paper prints, deg.
    pub paper: Option<(f64, f64)>,
    /// Group of cases that share a chart.
    pub chart: usize,
}

impl Case {
    fn new(name: impl Into<String>, stack: PixelStack, chart: usize) -> Self {
        Self {
            name: name.into(),
            stack,
            wavelength_nm: GREEN_NM,
            centre_deg: 0.0,
            paper: None,
            chart,
        }
    }
}

/// The cases of a study.
///
/// # Errors
/// An unknown pixel, or one that has no left and right half.
pub(super) fn cases(study: &CurveStudy) -> Result<Vec<Case>, LaboratoryError> {
    match study {
        CurveStudy::Rejection { pixels } => named(pixels),
        CurveStudy::Filter => named(&["3.5um", "3.5um-thin-filter"]),
        CurveStudy::Tungsten => named(&["2.8um", "2.8um-tungsten"]),
        CurveStudy::Microlens => Ok(microlenses()),
        CurveStudy::Pitch => Ok(pitches()),
        CurveStudy::Wavelength => Ok(wavelengths()?),
    }
}

fn named<Name: AsRef<str>>(pixels: &[Name]) -> Result<Vec<Case>, LaboratoryError> {
    let case = |(chart, name): (usize, &Name)| {
        let name = name.as_ref();
        let stack = pixel(name)?;
        if stack.subpixels.m() < 2 {
            return Err(LaboratoryError::OneColumn {
                pixel: name.to_owned(),
                subpixels: stack.subpixels,
            });
        }
        let paper = match name {
            "3.5um-roc3.5" => Some((16.0, 13.0)),
            "3.5um" => Some((10.0, 18.0)),
            _ => None,
        };
        Ok(Case {
            paper,
            ..Case::new(stack.name.clone(), stack, chart)
        })
    };
    pixels.iter().enumerate().map(case).collect()
}

/// RoC and h each half the diagonal (2.475 µm; the paper rounds it to 2.48), 3.0 and 3.5 µm, where the lens reaches the
/// corners.
fn microlenses() -> Vec<Case> {
    let pitch = 3.5;
    let sizes = [pitch * std::f64::consts::FRAC_1_SQRT_2, 3.0, 3.5];
    let mut cases = Vec::new();
    for height in sizes {
        for radius in sizes {
            let stack = PixelStack::paper(pitch, radius, height, 1.0);
            if stack.check().is_err() {
                continue;
            }
            let chart = cases.len();
            let case = Case::new(format!("RoC {radius:.2}, h {height:.2}"), stack, chart);
            cases.push(Case {
                paper: match chart {
                    0 => Some((10.0, 18.0)),
                    2 => Some((16.0, 13.0)),
                    _ => None,
                },
                ..case
            });
        }
    }
    cases
}

/// RoC = h = half the diagonal, a filter of 750 nm, all else as the reference pixel; and the 3.5 µm pixel with its own
/// filter.
fn pitches() -> Vec<Case> {
    let case = |pitch: f64, filter: f64| {
        let size = pitch * std::f64::consts::FRAC_1_SQRT_2;
        let stack = PixelStack::paper(pitch, size, size, filter);
        Case::new(format!("{pitch} um"), stack, 0)
    };
    let mut cases: Vec<Case> = PITCHES_UM.iter().map(|&p| case(p, 0.75)).collect();
    cases.push(Case {
        name: "3.5 um, filter 1 um".into(),
        paper: Some((10.0, 18.0)),
        chart: 1,
        ..case(3.5, 1.0)
    });
    cases
}

/// Each wavelength through a filter of its own colour; the shift of the second lens is the same at all.
fn wavelengths() -> Result<Vec<Case>, ResponseError> {
    let colours = [(400.0, "blue"), (532.0, "green"), (700.0, "red")];
    let mut cases = Vec::new();
    for (chart, centre_deg) in [0.0, CHIEF_RAY_DEG].into_iter().enumerate() {
        for (wavelength_nm, colour) in colours {
            let mut stack = PixelStack::builtin("1.6um")?;
            if centre_deg > 0.0 {
                let [u, v] = direction_cosines(centre_deg, 0.0);
                // The green frame: a lens is moulded once.
                let frame = stack.moving_frame(colours[1].0)?;
                stack.lens.shift_um = frame.shift_for_chief_ray(u, v);
            }
            if let Some(filter) = stack.filter_layer_mut() {
                filter.material = Material::Table(format!("CFA_{colour}_SYNTH"));
            }
            let name = if centre_deg > 0.0 {
                format!("{wavelength_nm} nm, chief ray {centre_deg} deg")
            } else {
                format!("{wavelength_nm} nm")
            };
            cases.push(Case {
                wavelength_nm,
                centre_deg,
                ..Case::new(name, stack, chart)
            });
        }
    }
    Ok(cases)
}
