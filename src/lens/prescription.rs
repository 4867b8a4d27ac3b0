//! The prescription: a lens as its designer writes it down, checked.
//!
//! A list of surfaces in the order in which light meets them, each with the distance to the next one and the medium
//! behind it; the last distance is that to the image plane for an object at infinity. A stop may stand behind the
//! vertex of the glass that follows it (phone lenses), so a thickness next to the stop or to a dummy plane may be
//! negative; glass may not overlap (rims that do are trimmed when a file is read).

use std::borrow::Cow;
use std::fmt::Display;

use serde::Deserialize;

use super::error::LensError;
use super::fold::Fold;
use super::glass::Glass;
use super::system::{ASPHERE_TERMS, Aperture, OpticalSurface, Pose, SurfaceKind};
use crate::range::OutOfRange;

/// One surface as prescribed.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PrescribedSurface {
    /// Vertex curvature c = 1/R of the conic, 1/mm; 0 for a plane.
    pub curvature: f64,
    /// Distance along the axis to the next surface, or to the image plane, mm.
    pub thickness_mm: f64,
    /// The glass behind the surface; `None` for air.
    pub glass: Option<Glass>,
    /// Conic constant k.
    pub conic: f64,
    /// A_2, A_4, …, A_20 in mm^(1−p).
    pub aspheric: [f64; ASPHERE_TERMS],
    /// Clear semi-aperture, mm; infinite only for a dummy plane that is not the stop.
    pub semi_aperture_mm: f64,
    /// Part of the light that comes square on it that it reflects, 0 to 1; `None`: not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<f64>,
    /// Whether this is the aperture stop.
    pub is_stop: bool,
    /// What the designer calls the element that starts or ends here; may be empty.
    pub label: String,
}

/// The figures that the source of a lens prints; what it does not print is `None`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Stated {
    /// Effective focal length, mm.
    pub efl_mm: Option<f64>,
    /// F-number.
    pub f_number: Option<f64>,
    /// Half of the diagonal field of view, degrees.
    pub half_fov_deg: Option<f64>,
    /// Half of the image's diagonal, mm.
    pub image_height_mm: Option<f64>,
    /// Diameter of the aperture stop, mm.
    pub aperture_stop_diameter_mm: Option<f64>,
}

/// The figures that an independent ray tracer found for a lens (see `library/README.md`).
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Verification {
    /// Effective focal length at the d line, mm.
    pub computed_efl_mm: Option<f64>,
    /// Back focal length at the d line, from the last surface, mm.
    pub computed_bfl_mm: Option<f64>,
    /// Distance from the last surface to the image plane as prescribed, mm.
    pub given_bfl_mm: Option<f64>,
    /// Diameter of the entrance pupil, mm.
    pub epd_mm: Option<f64>,
    /// EFL over entrance pupil diameter.
    pub computed_f_number: Option<f64>,
    /// Semi-aperture of the stop, mm.
    pub stop_semi_aperture_mm: Option<f64>,
    /// z of the entrance pupil, mm.
    pub entrance_pupil_z_mm_from_surface0: Option<f64>,
    /// z of the image plane, mm.
    pub total_track_surface0_to_image_mm: Option<f64>,
    /// Focal lengths of the elements in air.
    pub element_focal_lengths_printed_vs_computed: Vec<VerifiedElement>,
    /// Spots over the field.
    pub rms_spot_um: Vec<VerifiedField>,
}

/// Focal length of one element in air.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct VerifiedElement {
    /// The element's label.
    pub element: String,
    /// As the patent prints it, mm.
    pub printed_mm: f64,
    /// As the independent tracer found it, mm.
    pub computed_mm: f64,
}

/// What the independent tracer found at one field angle.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct VerifiedField {
    /// Field angle, degrees.
    pub field_deg: f64,
    /// Height of the chief ray on the image plane, mm; `None` where it is clipped.
    pub chief_height_mm: Option<f64>,
    /// Angle of the chief ray on the image plane, degrees.
    pub chief_ray_angle_deg: Option<f64>,
    /// (h − f tan θ)/(f tan θ), %; 0 where the chief ray is clipped.
    pub distortion_vs_ftan_pct: f64,
    /// Rays that pass, of those sent: `237/241`.
    pub rays_through: String,
    /// RMS spot radius about its centroid at the d line, µm.
    pub rms_d: Option<f64>,
    /// The same over the F, d and C lines.
    #[serde(rename = "rms_FdC")]
    pub rms_fdc: Option<f64>,
}

/// A lens as its designer writes it down.
#[derive(Clone, Debug, PartialEq)]
pub struct Prescription {
    /// The file it came from, or its name in the library: what errors call it.
    pub file: String,
    /// The lens's own name.
    pub name: String,
    /// Where its numbers come from.
    pub source: String,
    /// What else its file says of it.
    pub notes: String,
    /// The surfaces, in the order in which light meets them.
    pub surfaces: Vec<PrescribedSurface>,
    /// The wavelengths the lens is meant for, nm.
    pub wavelengths_nm: Vec<f64>,
    /// Where a mirror folds the axis, if one does.
    pub fold: Option<Fold>,
    /// The figures its source prints.
    pub stated: Stated,
    /// The figures an independent tracer found.
    pub verification: Verification,
    /// What was changed when it was read, one sentence each: rims that overlapped.
    pub warnings: Vec<String>,
}

impl PrescribedSurface {
    /// The same with all lengths `factor` times as long.
    fn scaled(&self, factor: f64) -> Self {
        let terms = self.aspheric.iter().enumerate();
        let mut aspheric = [0.0; ASPHERE_TERMS];
        // A_p of x^p, p = 2, 4, …, in mm^(1−p).
        terms.for_each(|(i, a)| aspheric[i] = a / factor.powi(2 * i as i32 + 1));
        Self {
            curvature: self.curvature / factor,
            thickness_mm: self.thickness_mm * factor,
            semi_aperture_mm: self.semi_aperture_mm * factor,
            aspheric,
            ..self.clone()
        }
    }
}

impl Prescription {
    /// The lens with all its lengths `factor` times as long: another focal length, the same angles and F-number. What
    /// its source states and what was verified of it are left out.
    ///
    /// # Errors
    /// A factor that is not positive and finite.
    pub fn scaled(&self, factor: f64) -> Result<Self, LensError> {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(self.refuse("scale", factor, "finite and > 0"));
        }
        let fold = self.fold.map(|fold| Fold {
            distance_mm: fold.distance_mm * factor,
            ..fold
        });
        Ok(Self {
            surfaces: self.surfaces.iter().map(|s| s.scaled(factor)).collect(),
            fold,
            stated: Stated::default(),
            verification: Verification::default(),
            ..self.clone()
        })
    }

    /// The lens's name, or that of its file where it has none.
    pub fn title(&self) -> &str {
        if self.name.is_empty() {
            &self.file
        } else {
            &self.name
        }
    }

    /// z of each surface's vertex, and of the image plane behind them, in the camera frame, mm.
    pub fn vertices_z_mm(&self) -> Vec<f64> {
        let mut z = 0.0;
        let mut all = vec![0.0];
        for surface in &self.surfaces {
            z += surface.thickness_mm;
            all.push(z);
        }
        all
    }

    /// Index of the aperture stop, if there is one.
    pub fn stop(&self) -> Option<usize> {
        self.surfaces.iter().position(|s| s.is_stop)
    }

    /// Whether any glass of the lens is dispersive. A lens without Abbe numbers is the same at every wavelength.
    pub fn is_dispersive(&self) -> bool {
        self.surfaces
            .iter()
            .any(|s| s.glass.is_some_and(|g| g.is_dispersive()))
    }

    /// First and last surface of each element: glass between two airs, a cemented group counting as one.
    pub fn elements(&self) -> Vec<(usize, usize)> {
        let mut elements = Vec::new();
        let mut first = None;
        for (i, surface) in self.surfaces.iter().enumerate() {
            match (first, surface.glass) {
                (None, Some(_)) => first = Some(i),
                (Some(start), None) => {
                    elements.push((start, i));
                    first = None;
                }
                _ => {}
            }
        }
        elements
    }

    /// Surface `i` at one wavelength, square to the axis with its vertex at `z_mm`, its clear aperture as prescribed.
    pub(crate) fn surface_at(&self, i: usize, z_mm: f64, wavelength_nm: f64) -> OpticalSurface {
        let index = |glass: Option<Glass>| glass.map_or(1.0, |g| g.index(wavelength_nm));
        let before = if i == 0 {
            None
        } else {
            self.surfaces[i - 1].glass
        };
        let surface = &self.surfaces[i];
        let terms = surface.aspheric.iter().rposition(|&a| a != 0.0);
        let plane = surface.curvature == 0.0 && terms.is_none();
        let air = before.is_none() && surface.glass.is_none();
        OpticalSurface {
            pose: Pose {
                vertex_mm: glam::DVec3::new(0.0, 0.0, z_mm),
                rotation: None,
            },
            curvature: surface.curvature,
            conic: surface.conic,
            aspheric: surface.aspheric,
            aspheric_terms: terms.map_or(0, |t| t + 1),
            aperture: Aperture {
                semi_mm: surface.semi_aperture_mm,
            },
            kind: if plane && air {
                SurfaceKind::Stop
            } else {
                SurfaceKind::Refract
            },
            index_before: index(before),
            index_after: index(surface.glass),
        }
    }

    /// z of the fold mirror's vertex in the camera frame, mm; `None` without a fold.
    pub fn fold_z_mm(&self) -> Option<f64> {
        let fold = self.fold?;
        Some(fold.after_surface.map_or(-fold.distance_mm, |i| {
            self.vertices_z_mm()[i] + fold.distance_mm
        }))
    }

    /// The error of a field of this lens, or of a request to it, which is `value` and may be `allowed`.
    pub(crate) fn refuse(
        &self,
        field: impl Into<Cow<'static, str>>,
        value: impl Display,
        allowed: impl Into<Cow<'static, str>>,
    ) -> LensError {
        OutOfRange::new(self.file.clone(), field, value, allowed).into()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::lens::{Lens, chief_ray};

    /// Aspheric phone lenses, a folded one and one of spheres: the same rays at another scale.
    #[test]
    fn a_scaled_lens_has_the_same_angles_and_another_focal_length() {
        for name in [
            "wide_US20120327520A1_emb3",
            "wide_US11940605B2_emb9",
            "tele_US10571665B2_220a",
            "lib_double_gauss_100mm_glass",
        ] {
            let own = Prescription::named(name).unwrap();
            let factor = 1.7;
            let scaled = own.scaled(factor).unwrap();
            let [a, b] = [&own, &scaled].map(|p| Lens::new(p).unwrap());
            let [p, q] = [&a, &b].map(|lens| lens.paraxial(550.0).unwrap());
            assert!((q.efl_mm / p.efl_mm / factor - 1.0).abs() < 1e-9, "{name}");
            assert!((q.f_number / p.f_number - 1.0).abs() < 1e-9, "{name}");
            let [a, b] = [a, b].map(|lens| lens.at(550.0).unwrap());
            for (x, y) in [(0.3, 0.0), (0.8, -1.1)] {
                let own = chief_ray(&a, x, y).unwrap();
                let other = chief_ray(&b, factor * x, factor * y).unwrap();
                assert!((own.direction - other.direction).length() < 1e-9, "{name}");
            }
        }
        let own = Prescription::named("lib_dgauss_50mm").unwrap();
        assert!(own.scaled(0.0).is_err() && own.scaled(f64::NAN).is_err());
    }
}
