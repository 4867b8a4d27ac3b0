//! What a prescription must meet so that the lens can exist.
//!
//! Between each surface i and the next one j, at every radius r within both clear apertures, there must be room:
//! t + sag_j(r) − sag_i(r) ≥ 0. Where there is none at the rims alone, a file's lens is trimmed to where there is. Stop
//! and dummy planes are passed through by neighbours (a phone lens's stop stands behind the first vertex), so they are
//! left out and the surfaces on both sides of them are compared.

use super::error::LensError;
use super::prescription::Prescription;
use super::system::SurfaceKind;
use crate::units::D_LINE_NM;

/// Two surfaces count as crossing where they overlap by more than this, mm: rounding of printed radii and thicknesses.
const OVERLAP_TOLERANCE_MM: f64 = 1e-6;
/// Radii, in equal steps over the common clear aperture, at which the gap between two surfaces is looked at.
const GAP_SAMPLES: usize = 64;
/// Surfaces that overlap only beyond this part of their common clear aperture overlap at their rims.
const RIM_FROM: f64 = 0.8;
/// Halvings that find where a rim begins.
const RIM_HALVINGS: usize = 40;

/// Where a surface and the next one, or the image plane, overlap.
struct Overlap {
    surface: usize,
    /// `None`: the image plane.
    next: Option<usize>,
    /// Of the gaps looked at, the last with room in front of the first without, as parts of `common_mm`.
    radii: [f64; 2],
    /// The smaller semi-aperture.
    common_mm: f64,
    depth_mm: f64,
}

impl Prescription {
    /// Checks that the lens can exist.
    ///
    /// # Errors
    /// [`LensError::Value`] naming the first field that holds what no lens can have.
    pub fn check(&self) -> Result<(), LensError> {
        self.check_surfaces()?;
        self.check_overlap()
    }

    /// As read from a file: rims that overlap are trimmed with a warning, and the rest is checked.
    ///
    /// # Errors
    /// Those of [`Self::check`].
    pub(super) fn checked(mut self) -> Result<Self, LensError> {
        self.check_surfaces()?;
        // A surface has two neighbours, and each may be found wanting again after the other's trimming.
        for _ in 0..4 * self.surfaces.len() {
            match self.overlap() {
                Some(overlap) if self.trim(&overlap) => {}
                _ => break,
            }
        }
        self.check_overlap()?;
        Ok(self)
    }

    fn check_surfaces(&self) -> Result<(), LensError> {
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
        self.check_fold()
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
        if let Some(part) = s.reflectance.filter(|r| !(0.0..=1.0).contains(r)) {
            return Err(self.refuse(field("reflectance"), part, "between 0 and 1"));
        }
        if semi.is_finite() && optics.sag_mm(semi * semi).is_none() {
            let allowed = "small enough that the surface reaches that far from its axis";
            return Err(self.refuse(field("semi_aperture_mm"), semi, allowed));
        }
        Ok(())
    }

    fn check_overlap(&self) -> Result<(), LensError> {
        let Some(overlap) = self.overlap() else {
            return Ok(());
        };
        let i = overlap.surface;
        let neighbour = match overlap.next {
            None => "the image plane".into(),
            Some(j) => format!("surface {j}"),
        };
        let (depth_mm, r) = (overlap.depth_mm, overlap.radii[1] * overlap.common_mm);
        Err(self.refuse(
            format!("surfaces[{i}].thickness_mm"),
            self.surfaces[i].thickness_mm,
            format!("larger: surface {i} and {neighbour} overlap by {depth_mm:.6} mm at radius {r:.4} mm"),
        ))
    }

    /// Room at a radius between surface `i` and the next one, or the image plane, mm.
    fn gap_mm(&self, i: usize, next: Option<usize>, radius_mm: f64) -> f64 {
        let z = self.vertices_z_mm();
        let surface = |i: usize| {
            let optics = self.surface_at(i, z[i], D_LINE_NM);
            z[i] + optics.sag_mm(radius_mm * radius_mm).unwrap_or(0.0)
        };
        next.map_or(z[self.surfaces.len()], surface) - surface(i)
    }

    /// The first place where there is no room, stop and dummy planes left out.
    fn overlap(&self) -> Option<Overlap> {
        let is_solid = |&i: &usize| self.surface_at(i, 0.0, D_LINE_NM).kind != SurfaceKind::Stop;
        let solid: Vec<usize> = (0..self.surfaces.len()).filter(is_solid).collect();
        for (k, &surface) in solid.iter().enumerate() {
            let next = solid.get(k + 1).copied();
            let semi_mm = |i: usize| self.surfaces[i].semi_aperture_mm;
            let common_mm = next.map_or(f64::INFINITY, semi_mm).min(semi_mm(surface));
            let part = |sample: usize| sample as f64 / GAP_SAMPLES as f64;
            for sample in 0..=GAP_SAMPLES {
                let depth_mm = -self.gap_mm(surface, next, common_mm * part(sample));
                if depth_mm > OVERLAP_TOLERANCE_MM {
                    return Some(Overlap {
                        surface,
                        next,
                        radii: [sample.saturating_sub(1), sample].map(part),
                        common_mm,
                        depth_mm,
                    });
                }
            }
        }
        None
    }

    /// Trims two surfaces to where their rims touch, unless that is far inside. Of a stop and its neighbour, and before
    /// the image plane, one surface alone is trimmed: the stop keeps its diameter, and what is left out is vignetted.
    fn trim(&mut self, overlap: &Overlap) -> bool {
        let (i, next) = (overlap.surface, overlap.next);
        let [mut clear, mut crossed] = overlap.radii;
        let cut: Vec<usize> = [Some(i), next]
            .into_iter()
            .flatten()
            .filter(|&k| !self.surfaces[k].is_stop)
            .collect();
        if clear < RIM_FROM || cut.is_empty() {
            return false;
        }
        let rim_mm = -self.gap_mm(i, next, overlap.common_mm);
        for _ in 0..RIM_HALVINGS {
            let middle = 0.5 * (clear + crossed);
            if self.gap_mm(i, next, middle * overlap.common_mm) >= 0.0 {
                clear = middle;
            } else {
                crossed = middle;
            }
        }
        let trimmed_mm = clear * overlap.common_mm;
        let pair = match next {
            Some(j) => format!("surfaces[{i}] and surfaces[{j}]"),
            None => format!("surfaces[{i}] and the image plane"),
        };
        let stated: Vec<String> = cut
            .iter()
            .map(|&k| format!("{} of surfaces[{k}]", self.surfaces[k].semi_aperture_mm))
            .collect();
        self.warnings.push(format!(
            "{}: {pair} overlap beyond a radius of {trimmed_mm:.4} mm, by {rim_mm:.4} mm at {:.4} mm: semi_aperture_mm \
             ({}) is trimmed to it",
            self.file,
            overlap.common_mm,
            stated.join(" and ")
        ));
        for k in cut {
            let semi_mm = &mut self.surfaces[k].semi_aperture_mm;
            *semi_mm = semi_mm.min(trimmed_mm);
        }
        true
    }
}
