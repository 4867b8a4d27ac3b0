//! Prescriptions as JSON: the format of the lens library.
//!
//! | field of a surface | unit | meaning |
//! |---|---|---|
//! | `radius_mm` | mm | radius of curvature, positive when its centre is on the sensor's side; null = plane |
//! | `thickness_mm` | mm | to the next surface; the last one to the image plane |
//! | `nd`, `vd` | 1 | index and Abbe number behind the surface; `nd` null = air, `vd` null = no dispersion known |
//! | `sellmeier` | 1, µm² | instead of `nd`, `vd`: `{"b": [B1, B2, B3], "c_um2": [C1, C2, C3]}` |
//! | `conic` | 1 | conic constant k |
//! | `coefficients` | mm^(1−p) | A_p of Σ A_p r^p by even power p = 2 … 20, as `{"4": -0.01}` |
//! | `semi_aperture_mm` | mm | clear semi-aperture |
//! | `reflectance` | 1 | part of the light that comes square on it that it reflects, 0 to 1; may be left out |
//! | `is_stop` | | true for the aperture stop |
//! | `element_label` | | the designer's name of the element, or null |
//!
//! Beside `surfaces`, a file has `name`, `source`, `wavelengths` (nm), and may have `notes`, `plane_convention`,
//! `stated`, `verification`, and `fold`: `{"after_surface": 4, "distance_mm": 3.0}` (`after_surface` null = in front of
//! the first). Where `verification` has a `stop_semi_aperture_mm` smaller than the stop's `semi_aperture_mm`, it is the
//! stop: files made from Zemax's carry there the largest ray height on the stop's surface, not the aperture that
//! defines the F-number.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer};

use super::error::LensError;
use super::fold::Fold;
use super::glass::Glass;
use super::prescription::{PrescribedSurface, Prescription, Stated, Verification};
use super::system::ASPHERE_TERMS;
use crate::range::OutOfRange;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LensFile {
    name: String,
    source: String,
    wavelengths: Vec<f64>,
    #[serde(default)]
    notes: String,
    #[serde(default, rename = "plane_convention")]
    _plane_convention: String,
    #[serde(default)]
    stated: Stated,
    #[serde(default)]
    verification: Verification,
    #[serde(default)]
    fold: Option<Fold>,
    surfaces: Vec<SurfaceEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceEntry {
    #[serde(deserialize_with = "required_or_null")]
    radius_mm: Option<f64>,
    thickness_mm: f64,
    #[serde(default)]
    sellmeier: Option<SellmeierEntry>,
    #[serde(default, deserialize_with = "present_or_null")]
    nd: Option<Option<f64>>,
    #[serde(default)]
    vd: Option<f64>,
    conic: f64,
    coefficients: BTreeMap<String, f64>,
    semi_aperture_mm: f64,
    #[serde(default)]
    reflectance: Option<f64>,
    is_stop: bool,
    #[serde(default)]
    element_label: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SellmeierEntry {
    b: [f64; 3],
    c_um2: [f64; 3],
}

/// Null means something here, so that leaving the field out must not mean the same.
fn required_or_null<'de, D: Deserializer<'de>>(d: D) -> Result<Option<f64>, D::Error> {
    Option::deserialize(d)
}

/// `None` when the field is left out, `Some(None)` when it is null.
fn present_or_null<'de, D: Deserializer<'de>>(d: D) -> Result<Option<Option<f64>>, D::Error> {
    Option::deserialize(d).map(Some)
}

impl Prescription {
    /// Reads and checks a prescription in the lens library's JSON; `file` is what errors call it.
    ///
    /// # Errors
    /// [`LensError::Format`] for bad JSON, missing, unknown or mistyped fields; [`LensError::Value`] for values that no
    /// lens can have (see [`Prescription::check`]).
    pub fn from_json(text: &str, file: &str) -> Result<Prescription, LensError> {
        let mut deserializer = serde_json::Deserializer::from_str(text);
        let parsed: LensFile =
            serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
                LensError::Format {
                    file: file.into(),
                    field: error.path().to_string(),
                    reason: error.inner().to_string(),
                }
            })?;
        deserializer.end().map_err(|error| LensError::Format {
            file: file.into(),
            field: "end of file".into(),
            reason: error.to_string(),
        })?;
        let mut surfaces = parsed
            .surfaces
            .into_iter()
            .enumerate()
            .map(|(i, entry)| entry.prescribed(file, i))
            .collect::<Result<Vec<_>, _>>()?;
        if let Some(semi) = parsed.verification.stop_semi_aperture_mm {
            for stop in surfaces.iter_mut().filter(|s| s.is_stop) {
                stop.semi_aperture_mm = stop.semi_aperture_mm.min(semi);
            }
        }
        Prescription {
            file: file.into(),
            name: parsed.name,
            source: parsed.source,
            notes: parsed.notes,
            surfaces,
            wavelengths_nm: parsed.wavelengths,
            fold: parsed.fold,
            stated: parsed.stated,
            verification: parsed.verification,
            warnings: Vec::new(),
        }
        .checked()
    }
}

impl SurfaceEntry {
    fn prescribed(self, file: &str, i: usize) -> Result<PrescribedSurface, LensError> {
        let refuse = |name: &str, value: f64, allowed: &'static str| {
            let field = format!("surfaces[{i}].{name}");
            LensError::from(OutOfRange::new(file.to_owned(), field, value, allowed))
        };
        let curvature = match self.radius_mm {
            None => 0.0,
            Some(radius) if radius != 0.0 => 1.0 / radius,
            Some(radius) => {
                let allowed = "a finite number other than 0, or null for a plane";
                return Err(refuse("radius_mm", radius, allowed));
            }
        };
        let glass = match (self.nd, self.sellmeier) {
            (None, None) => {
                return Err(LensError::Format {
                    file: file.into(),
                    field: format!("surfaces[{i}].nd"),
                    reason: "missing: must be the index behind the surface, or null for air".into(),
                });
            }
            (None | Some(None), Some(SellmeierEntry { b, c_um2 })) => {
                Some(Glass::Sellmeier { b, c_um2 })
            }
            (Some(Some(nd)), Some(_)) => {
                let allowed = "null or left out beside `sellmeier`";
                return Err(refuse("nd", nd, allowed));
            }
            (Some(nd), None) => match (nd, self.vd) {
                (None, None) => None,
                (None, Some(vd)) => {
                    return Err(refuse("vd", vd, "null where `nd` is null"));
                }
                (Some(nd), vd) => Some(checked_glass(nd, vd, &refuse)?),
            },
        };
        let mut aspheric = [0.0; ASPHERE_TERMS];
        for (power, a) in &self.coefficients {
            let slot = match power.parse::<usize>() {
                Ok(p) if p % 2 == 0 && (2..=2 * ASPHERE_TERMS).contains(&p) => p / 2 - 1,
                _ => {
                    let field = format!("coefficients[\"{power}\"]");
                    return Err(refuse(&field, *a, "of an even power from 2 to 20"));
                }
            };
            aspheric[slot] = *a;
        }
        Ok(PrescribedSurface {
            curvature,
            thickness_mm: self.thickness_mm,
            glass,
            conic: self.conic,
            aspheric,
            semi_aperture_mm: self.semi_aperture_mm,
            reflectance: self.reflectance,
            is_stop: self.is_stop,
            label: self.element_label.unwrap_or_default(),
        })
    }
}

/// The glass of `nd` and `vd`, each in the range of [`Prescription::check`]; here because a fit hides the value given.
fn checked_glass(
    nd: f64,
    vd: Option<f64>,
    refuse: &impl Fn(&str, f64, &'static str) -> LensError,
) -> Result<Glass, LensError> {
    if !(1.0..=5.0).contains(&nd) {
        return Err(refuse("nd", nd, "between 1 and 5, or null for air"));
    }
    if let Some(vd) = vd.filter(|vd| !(10.0..=200.0).contains(vd)) {
        let allowed = "between 10 and 200, or null where there is no dispersion";
        return Err(refuse("vd", vd, allowed));
    }
    Ok(Glass::from_nd_vd(nd, vd))
}
