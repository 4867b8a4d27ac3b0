//! What a prescription must meet so that the lens can exist.
//!
//! Between each surface i and the next one j, at every radius r within both clear apertures, there must be room:
//! t + sag_j(r) − sag_i(r) ≥ 0. Stop and dummy planes are passed through by neighbours (a phone lens's stop stands
//! behind the first vertex), so they are left out and the surfaces on both sides of them are compared.

use super::error::LensError;
use super::prescription::Prescription;
use super::system::{OpticalSurface, SurfaceKind};
use crate::units::D_LINE_NM;

/// Two surfaces count as crossing where they overlap by more than this, mm: rounding of printed radii and thicknesses.
const OVERLAP_TOLERANCE_MM: f64 = 1e-6;
/// Radii, in equal steps over the common clear aperture, at which the gap between two surfaces is looked at.
const GAP_SAMPLES: usize = 64;

impl Prescription {
    /// Checks that the lens can exist.
    ///
    /// # Errors
    /// [`LensError::Value`] naming the first field that holds what no lens can have.
    pub fn check(&self) -> Result<(), LensError> {
        if self.surfaces.is_empty() {
            return Err(self.refuse("surfaces", "[]", "a list of at least one surface"));
        }
        for i in 0..self.surfaces.len() {
            self.check_surface(i)?;
        }
        let stops = self.surfaces.iter().filter(|s| s.is_stop).count();
        if stops != 1 {
            return Err(self.refuse(
                "surfaces[..].is_stop",
                format!("{stops} surfaces"),
                "true for exactly one surface",
            ));
        }
        if let Some(last) = self.surfaces.last().filter(|s| s.glass.is_some()) {
            let field = format!("surfaces[{}].nd", self.surfaces.len() - 1);
            let n = last.glass.map_or(1.0, |g| g.index(D_LINE_NM));
            return Err(self.refuse(field, n, "null: the sensor stands in air"));
        }
        if self.elements().is_empty() {
            return Err(self.refuse("surfaces[..].nd", "null", "given for at least one surface"));
        }
        self.check_fold()?;
        self.check_overlap()
    }

    fn check_fold(&self) -> Result<(), LensError> {
        let Some(fold) = &self.fold else {
            return Ok(());
        };
        if !(fold.distance_mm >= 0.0 && fold.distance_mm.is_finite()) {
            let allowed = "a length of 0 or more";
            return Err(self.refuse("fold.distance_mm", fold.distance_mm, allowed));
        }
        let has_air_behind = |i: usize| self.surfaces.get(i).is_some_and(|s| s.glass.is_none());
        match fold.after_surface {
            Some(i) if !has_air_behind(i) => {
                let allowed = "the index of a surface with air behind it, or null";
                Err(self.refuse("fold.after_surface", i, allowed))
            }
            _ => Ok(()),
        }
    }

    fn check_surface(&self, i: usize) -> Result<(), LensError> {
        let s = &self.surfaces[i];
        let field = |name: &str| format!("surfaces[{i}].{name}");
        if !s.curvature.is_finite() {
            return Err(self.refuse(
                field("radius_mm"),
                1.0 / s.curvature,
                "a finite number other than 0, or null for a plane",
            ));
        }
        for (name, x) in [("thickness_mm", s.thickness_mm), ("conic", s.conic)] {
            if !x.is_finite() {
                return Err(self.refuse(field(name), x, "a finite number"));
            }
        }
        if let Some(k) = s.aspheric.iter().position(|a| !a.is_finite()) {
            let name = format!("coefficients[\"{}\"]", 2 * k + 2);
            return Err(self.refuse(field(&name), s.aspheric[k], "a finite number"));
        }
        if let Some(glass) = s.glass {
            let (nd, vd) = glass.nd_vd();
            if !(1.0..=5.0).contains(&nd) {
                return Err(self.refuse(field("nd"), nd, "between 1 and 5"));
            }
            if glass.is_dispersive() && !(10.0..=200.0).contains(&vd) {
                return Err(self.refuse(field("vd"), vd, "between 10 and 200"));
            }
        }
        let optics = self.surface_at(i, 0.0, D_LINE_NM);
        let open_dummy = optics.kind == SurfaceKind::Stop && !s.is_stop;
        let semi = s.semi_aperture_mm;
        if !(semi > 0.0 && (semi.is_finite() || open_dummy)) {
            let allowed = "a finite length above 0";
            return Err(self.refuse(field("semi_aperture_mm"), semi, allowed));
        }
        if semi.is_finite() && optics.sag_mm(semi * semi).is_none() {
            let allowed = "small enough that the surface reaches that far from its axis";
            return Err(self.refuse(field("semi_aperture_mm"), semi, allowed));
        }
        Ok(())
    }

    /// Looks at the gap t + sag_j(r) − sag_i(r) between each surface i and the next one j, stop and dummy planes left
    /// out, and between the last surface and the image plane.
    fn check_overlap(&self) -> Result<(), LensError> {
        let z = self.vertices_z_mm();
        let optics: Vec<OpticalSurface> = (0..self.surfaces.len())
            .map(|i| self.surface_at(i, z[i], D_LINE_NM))
            .collect();
        let solid: Vec<usize> = (0..optics.len())
            .filter(|&i| optics[i].kind != SurfaceKind::Stop)
            .collect();
        for (k, &i) in solid.iter().enumerate() {
            let next = solid.get(k + 1).copied();
            let z_next = next.map_or(z[optics.len()], |j| z[j]);
            let common = next.map_or(f64::INFINITY, |j| optics[j].aperture.semi_mm);
            let radius = common.min(optics[i].aperture.semi_mm);
            for sample in 0..=GAP_SAMPLES {
                let r = radius * sample as f64 / GAP_SAMPLES as f64;
                let sag = |j: usize| optics[j].sag_mm(r * r).unwrap_or(0.0);
                let gap = z_next + next.map_or(0.0, sag) - z[i] - sag(i);
                if gap < -OVERLAP_TOLERANCE_MM {
                    let neighbour =
                        next.map_or("the image plane".into(), |j| format!("surface {j}"));
                    let field = format!("surfaces[{i}].thickness_mm");
                    return Err(self.refuse(
                        field,
                        self.surfaces[i].thickness_mm,
                        format!("larger: surface {i} and {neighbour} overlap by {:.6} mm at radius {r:.4} mm", -gap),
                    ));
                }
            }
        }
        Ok(())
    }
}
