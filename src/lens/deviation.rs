//! Surfaces that came out of the mould otherwise than prescribed: radius of curvature and index of the glass.
//!
//! Positions stay where the prescription has them; what is out of place is in [`super::tolerance`]. A camera is focused
//! after it is assembled, so the sensor follows the paraxial focus of the lens as made: the designer's shift between
//! the two is kept.

use serde::{Deserialize, Serialize};

use super::error::LensError;
use super::placed::Lens;
use super::prescription::Prescription;
use crate::units::D_LINE_NM;

/// Largest deviation of a radius, %.
pub const LARGEST_RADIUS_PERCENT: f64 = 10.0;
/// Largest deviation of an index.
pub const LARGEST_INDEX_DEVIATION: f64 = 0.05;

/// How one surface deviates. What a file leaves out is 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviation {
    /// Which surface, from 1 at the scene's side, the stop and dummy planes counted.
    pub surface: usize,
    /// Radius of curvature: by how many per cent it is larger than prescribed. The aspheric terms stay.
    #[serde(default)]
    pub radius_percent: f64,
    /// Index, at the d line, of the glass behind the surface: by how much it is larger.
    #[serde(default)]
    pub index: f64,
}

impl Prescription {
    /// The lens as it was made, with the image plane where its own paraxial focus takes it.
    ///
    /// # Errors
    /// [`LensError::Value`] for a surface that it does not have or that is named twice, a deviation out of range, an
    /// index where there is air; what [`Lens::new`] finds in the result.
    pub fn with_deviations(&self, deviations: &[Deviation]) -> Result<Prescription, LensError> {
        let mut made = self.clone();
        let count = made.surfaces.len();
        for (k, d) in deviations.iter().enumerate() {
            let twice = deviations[..k].iter().any(|e| e.surface == d.surface);
            if twice || !(1..=count).contains(&d.surface) {
                let allowed = format!("1 to {count}, given once each");
                return Err(self.refuse("deviation.surface", d.surface, allowed));
            }
            if !(-LARGEST_RADIUS_PERCENT..=LARGEST_RADIUS_PERCENT).contains(&d.radius_percent) {
                let allowed = format!("{LARGEST_RADIUS_PERCENT} % at most either way");
                return Err(self.refuse("deviation.radius_percent", d.radius_percent, allowed));
            }
            let surface = &mut made.surfaces[d.surface - 1];
            let glass = surface.glass.is_some();
            if !(-LARGEST_INDEX_DEVIATION..=LARGEST_INDEX_DEVIATION).contains(&d.index)
                || (d.index != 0.0 && !glass)
            {
                let allowed =
                    format!("{LARGEST_INDEX_DEVIATION} at most either way, and 0 before air");
                return Err(self.refuse("deviation.index", d.index, allowed));
            }
            surface.curvature /= 1.0 + 0.01 * d.radius_percent;
            surface.glass = surface.glass.map(|g| g.with_index_deviation(d.index));
        }
        let moved = infinity_focus_mm(&made)? - infinity_focus_mm(self)?;
        if let Some(last) = made.surfaces.last_mut() {
            last.thickness_mm += moved;
        }
        Ok(made)
    }
}

/// z of the paraxial focus of infinity at the d line, mm.
fn infinity_focus_mm(lens: &Prescription) -> Result<f64, LensError> {
    let p = Lens::new(lens)?.paraxial(D_LINE_NM)?;
    // Infinity always has an image behind a lens that `Lens::new` accepts.
    Ok(p.image_z_mm(f64::INFINITY).unwrap_or(f64::NAN))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::lens::glass::Glass;
    use crate::lens::prescription::{PrescribedSurface, Stated, Verification};
    use crate::lens::{FocusBy, Prescription};

    fn singlet(glass: Glass) -> Prescription {
        let surface = |radius_mm: f64, thickness_mm, glass, is_stop| PrescribedSurface {
            curvature: 1.0 / radius_mm,
            thickness_mm,
            glass,
            conic: 0.0,
            aspheric: Default::default(),
            semi_aperture_mm: 3.0,
            reflectance: None,
            is_stop,
            label: String::new(),
        };
        Prescription {
            file: "singlet".into(),
            name: String::new(),
            source: String::new(),
            notes: String::new(),
            surfaces: vec![
                surface(40.0, 4.0, Some(glass), true),
                surface(-60.0, 45.0, None, false),
            ],
            wavelengths_nm: vec![D_LINE_NM],
            fold: None,
            stated: Stated::default(),
            verification: Verification::default(),
            warnings: Vec::new(),
        }
    }

    fn at(surface: usize, radius_percent: f64, index: f64) -> Deviation {
        Deviation {
            surface,
            radius_percent,
            index,
        }
    }

    #[test]
    fn focal_length_of_a_deviating_singlet_is_the_lensmakers() {
        let glasses = [
            Glass::Constant { n: 1.5 },
            Glass::from_nd_vd(1.5, Some(60.0)),
            // Sellmeier of one term, n² = 2.25 at the d line.
            Glass::Sellmeier {
                b: [1.25 * (1.0 - 0.01 / (D_LINE_NM * 1e-3).powi(2)), 0.0, 0.0],
                c_um2: [0.01, 0.0, 0.0],
            },
        ];
        for glass in glasses {
            let made = singlet(glass)
                .with_deviations(&[at(1, 2.0, 0.004), at(2, -3.0, 0.0)])
                .unwrap();
            let (n, c1, c2, t) = (1.504, 1.0 / (40.0 * 1.02), -1.0 / (60.0 * 0.97), 4.0);
            let power = (n - 1.0) * (c1 - c2 + (n - 1.0) * t * c1 * c2 / n);
            let efl = Lens::new(&made)
                .unwrap()
                .paraxial(D_LINE_NM)
                .unwrap()
                .efl_mm;
            assert!((efl * power - 1.0).abs() < 1e-9, "{glass:?}: {efl}");
        }
    }

    #[test]
    fn the_sensor_follows_the_focus_and_keeps_the_designers_shift() {
        let nominal = Prescription::builtin("wide_US20120327520A1_emb3").unwrap();
        let glass = nominal
            .surfaces
            .iter()
            .position(|s| s.glass.is_some())
            .unwrap()
            + 1;
        let made = nominal.with_deviations(&[at(glass, 0.5, 1e-3)]).unwrap();
        let defocus = |p: &Prescription| {
            let lens = Lens::new(p)
                .unwrap()
                .focused_at(500.0, FocusBy::Sensor, 550.0)
                .unwrap();
            let image = lens.paraxial(550.0).unwrap().image_z_mm(500.0).unwrap();
            (lens.sensor_z_mm() - image, lens.sensor_z_mm())
        };
        let ((a, za), (b, zb)) = (defocus(&nominal), defocus(&made));
        assert!((a - b).abs() < 1e-9 && (za - zb).abs() > 1e-4, "{a} {b}");
        assert_eq!(
            nominal.with_deviations(&[]).unwrap().surfaces.len(),
            nominal.surfaces.len()
        );
    }

    #[test]
    fn surfaces_that_are_not_there_and_deviations_out_of_range_are_refused() {
        let lens = singlet(Glass::Constant { n: 1.5 });
        let bad = [
            vec![at(0, 0.0, 0.0)],
            vec![at(3, 0.0, 0.0)],
            vec![at(1, 0.0, 0.0), at(1, 1.0, 0.0)],
            vec![at(1, 11.0, 0.0)],
            vec![at(1, f64::NAN, 0.0)],
            vec![at(1, 0.0, 0.06)],
            vec![at(2, 0.0, 0.001)],
        ];
        for deviations in bad {
            assert!(lens.with_deviations(&deviations).is_err(), "{deviations:?}");
        }
    }
}
