//! A lens that stands in the camera: prescription, stop, focus and misalignments, ready to be asked at any wavelength.

use std::sync::Arc;

use super::error::LensError;
use super::glass::checked_wavelength;
use super::paraxial::Paraxial;
use super::prescription::Prescription;
use super::system::{OpticalSystem, Pose};
use super::tolerance::{Misalignment, check_misalignments, misalign};
use crate::units::D_LINE_NM;

/// A checked lens in the camera frame. Every change returns a new lens; changes of different kinds commute.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    pub(super) prescription: Arc<Prescription>,
    pub(super) misalignments: Vec<Misalignment>,
    pub(super) stop: usize,
    pub(super) stop_semi_mm: f64,
    pub(super) sensor_z_mm: f64,
    pub(super) focus_distance_mm: f64,
}

impl Lens {
    /// The lens as prescribed: aligned, fully open, its sensor on the prescribed image plane (focus at infinity).
    ///
    /// # Errors
    /// Those of [`Prescription::check`], and [`LensError::Value`] when the lens forms no real image of infinity.
    pub fn new(prescription: &Prescription) -> Result<Lens, LensError> {
        prescription.check()?;
        let no_stop =
            || prescription.refuse("surfaces[..].is_stop", "false", "true for one surface");
        let stop = prescription.stop().ok_or_else(no_stop)?;
        let z = prescription.vertices_z_mm();
        let lens = Lens {
            misalignments: Vec::new(),
            stop,
            stop_semi_mm: prescription.surfaces[stop].semi_aperture_mm,
            sensor_z_mm: z[z.len() - 1],
            focus_distance_mm: f64::INFINITY,
            prescription: Arc::new(prescription.clone()),
        };
        let p = lens.paraxial(D_LINE_NM)?;
        let image_is_real = p.efl_mm > 0.0 && p.efl_mm.is_finite() && p.f_number.is_finite();
        if !image_is_real {
            let allowed = "such that the focal length is finite and above 0, and the pupil is too";
            return Err(prescription.refuse("surfaces (focal length, mm)", p.efl_mm, allowed));
        }
        Ok(lens)
    }

    /// The lens with its elements out of place as `misalignments` say, in place of any earlier misalignments.
    ///
    /// # Errors
    /// [`LensError::Value`] for an element it does not have or that is named twice, a mirror where there is no fold, or
    /// a value out of range.
    pub fn perturbed(&self, misalignments: &[Misalignment]) -> Result<Lens, LensError> {
        check_misalignments(&self.prescription, misalignments)?;
        Ok(Lens {
            misalignments: misalignments.to_vec(),
            ..self.clone()
        })
    }

    /// What a ray meets at one wavelength.
    ///
    /// # Errors
    /// [`LensError::Value`] outside [`super::glass::WAVELENGTH_RANGE_NM`].
    pub fn at(&self, wavelength_nm: f64) -> Result<OpticalSystem, LensError> {
        let mut system = self.aligned_at(wavelength_nm)?;
        let mut poses: Vec<Pose> = system.surfaces.iter().map(|s| s.pose).collect();
        misalign(&self.prescription, &self.misalignments, &mut poses);
        for (surface, pose) in system.surfaces.iter_mut().zip(poses) {
            surface.pose = pose;
        }
        Ok(system)
    }

    /// First-order data of the aligned lens, at its present stop.
    ///
    /// # Errors
    /// [`LensError::Value`] outside [`super::glass::WAVELENGTH_RANGE_NM`].
    pub fn paraxial(&self, wavelength_nm: f64) -> Result<Paraxial, LensError> {
        Ok(Paraxial::from_aligned(&self.aligned_at(wavelength_nm)?))
    }

    fn aligned_at(&self, wavelength_nm: f64) -> Result<OpticalSystem, LensError> {
        let wavelength_nm = checked_wavelength(&self.prescription.file, wavelength_nm)?;
        let z = self.prescription.vertices_z_mm();
        let mut surfaces: Vec<_> = (0..self.prescription.surfaces.len())
            .map(|i| self.prescription.surface_at(i, z[i], wavelength_nm))
            .collect();
        surfaces[self.stop].aperture.semi_mm = self.stop_semi_mm;
        Ok(OpticalSystem {
            surfaces,
            stop: self.stop,
            sensor_z_mm: self.sensor_z_mm,
            wavelength_nm,
        })
    }

    /// The prescription it was made from.
    pub fn prescription(&self) -> &Prescription {
        &self.prescription
    }

    /// What is out of place.
    pub fn misalignments(&self) -> &[Misalignment] {
        &self.misalignments
    }

    /// z of the sensor plane in the camera frame, mm.
    pub fn sensor_z_mm(&self) -> f64 {
        self.sensor_z_mm
    }

    /// Semi-aperture of the stop as it is set, mm.
    pub fn stop_semi_mm(&self) -> f64 {
        self.stop_semi_mm
    }

    /// Distance from the first vertex, as the lens now stands, to the plane in focus, mm; infinite as prescribed.
    pub fn focus_distance_mm(&self) -> f64 {
        self.focus_distance_mm
    }
}
