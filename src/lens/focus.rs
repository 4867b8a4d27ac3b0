//! Focus and stop.
//!
//! The sensor stands at the paraxial image of the object, plus the shift that the designer chose: the prescribed image
//! plane minus the paraxial focus at the d line, for an object at infinity. So focusing at infinity at the d line gives
//! the prescribed plane back.

use super::error::LensError;
use super::paraxial::Paraxial;
use super::placed::Lens;
use crate::units::D_LINE_NM;

/// A larger aperture than the design's is refused beyond this relative margin (a printed F-number is rounded).
const F_NUMBER_MARGIN: f64 = 5e-3;

/// What moves when the camera is focused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FocusBy {
    /// The sensor: the first vertex stays where it is.
    Sensor,
    /// The whole lens: the sensor stays, so the lens comes closer to the object by the advance e that it makes, and the
    /// plane in focus is only (distance − e) in front of the first vertex, the camera frame's origin.
    Lens,
}

/// The farthest plane that is focused on but infinity, mm: 10 km. Rays that begin farther away lose their digits.
const FARTHEST_MM: f64 = 1e7;

impl Lens {
    /// The lens focused on the plane `distance_mm` (infinite allowed) in front of where the first vertex stands at
    /// infinity focus. [`Lens::focus_distance_mm`] of the result counts from where it stands now.
    ///
    /// # Errors
    /// [`LensError::Value`] beyond 10 km, but for infinity; within the near limit: at or inside the front focal point,
    /// or, when the lens moves, so near
    /// that no place of the lens between object and sensor gives an image.
    pub fn focused_at(
        &self,
        distance_mm: f64,
        by: FocusBy,
        wavelength_nm: f64,
    ) -> Result<Lens, LensError> {
        let p = self.paraxial(wavelength_nm)?;
        let z = self.prescription.vertices_z_mm();
        let prescribed = z[z.len() - 1];
        let design = self.paraxial(D_LINE_NM)?;
        let shift = prescribed - design.image_z_mm(f64::INFINITY).unwrap_or(prescribed);
        let sensor_z = |distance: f64| p.image_z_mm(distance).map(|image| image + shift);
        let focused = match by {
            FocusBy::Sensor => sensor_z(distance_mm).map(|at| (distance_mm, at)),
            FocusBy::Lens => advance(distance_mm, &p)
                .and_then(|e| Some((distance_mm - e, sensor_z(distance_mm - e)?))),
        };
        let too_far = distance_mm > FARTHEST_MM && distance_mm.is_finite();
        if too_far {
            let allowed = format!("up to {FARTHEST_MM:e} mm, or inf");
            return Err(self
                .prescription
                .refuse("focus distance_mm", distance_mm, allowed));
        }
        let Some((focus_distance_mm, sensor_z_mm)) = focused else {
            let near = match by {
                FocusBy::Sensor => -p.front_focal_z_mm,
                // Unit magnification: two focal lengths from the front principal point, and one of advance.
                FocusBy::Lens => 3.0 * p.efl_mm - p.front_principal_z_mm,
            };
            let allowed = format!("beyond the near limit of {near:.3} mm");
            return Err(self
                .prescription
                .refuse("focus distance_mm", distance_mm, allowed));
        };
        Ok(Lens {
            sensor_z_mm,
            focus_distance_mm,
            ..self.clone()
        })
    }

    /// The lens focused on the plane `distance_mm` in front of the *sensor*, as photographers count, by moving the
    /// whole lens: afterwards [`Lens::focus_distance_mm`] and [`Lens::sensor_z_mm`] add up to it.
    ///
    /// # Errors
    /// Those of [`Lens::focused_at`].
    pub fn focused_from_sensor(
        &self,
        distance_mm: f64,
        wavelength_nm: f64,
    ) -> Result<Lens, LensError> {
        // At infinity focus the first vertex stands as far in front of the sensor as the lens is long.
        let far = self.focused_at(f64::INFINITY, FocusBy::Lens, wavelength_nm)?;
        let before_vertex_mm = distance_mm - far.sensor_z_mm;
        self.focused_at(before_vertex_mm, FocusBy::Lens, wavelength_nm)
    }

    /// The lens with its stop set to a semi-aperture, for lenses whose marked F-numbers stand for known stops.
    ///
    /// # Errors
    /// [`LensError::Value`] unless it is above 0 and at most twice the prescribed one.
    pub fn with_stop_semi_mm(&self, semi_mm: f64) -> Result<Lens, LensError> {
        let most = 2.0 * self.prescription.surfaces[self.stop].semi_aperture_mm;
        if !(semi_mm > 0.0 && semi_mm <= most) {
            return Err(self.prescription.refuse(
                "stop_semi_mm",
                semi_mm,
                format!("above 0, at most {most:.3}"),
            ));
        }
        Ok(Lens {
            stop_semi_mm: semi_mm,
            ..self.clone()
        })
    }

    /// The lens with its sensor `error_mm` behind (+) where it is in focus. The plane in focus moves along, and
    /// [`Lens::focus_distance_mm`] tells where it is now. The sensor comes no nearer than where infinity is in focus:
    /// an actuator's end stop.
    ///
    /// # Errors
    /// [`LensError::Value`] for an error that is not finite, or a wavelength out of range.
    pub fn with_focus_error(&self, error_mm: f64, wavelength_nm: f64) -> Result<Lens, LensError> {
        if !error_mm.is_finite() {
            return Err(self
                .prescription
                .refuse("focus error_mm", error_mm, "a finite length"));
        }
        let p = self.paraxial(wavelength_nm)?;
        let image = |distance| p.image_z_mm(distance).unwrap_or(f64::NAN);
        // Newton's equation: z' = z_F' + f²/(z_F + D).
        let (before, end) = (image(self.focus_distance_mm), image(f64::INFINITY));
        let after = (before + error_mm).max(end);
        let focus_distance_mm = if after > end {
            p.efl_mm * p.efl_mm / (after - end) - p.front_focal_z_mm
        } else {
            f64::INFINITY
        };
        Ok(Lens {
            sensor_z_mm: self.sensor_z_mm + (after - before),
            focus_distance_mm,
            ..self.clone()
        })
    }

    /// The lens stopped down to an F-number (EFL over entrance pupil diameter, at infinity and the d line).
    ///
    /// # Errors
    /// [`LensError::Value`] when `f_number` is smaller than the open lens's, or not finite.
    pub fn with_f_number(&self, f_number: f64) -> Result<Lens, LensError> {
        let open = Lens {
            stop_semi_mm: self.prescription.surfaces[self.stop].semi_aperture_mm,
            ..self.clone()
        };
        let fastest = open.paraxial(D_LINE_NM)?.f_number;
        if !(f_number.is_finite() && f_number >= fastest * (1.0 - F_NUMBER_MARGIN)) {
            let allowed = format!("{fastest:.4} (fully open) or more");
            return Err(self.prescription.refuse("f_number", f_number, allowed));
        }
        Ok(Lens {
            stop_semi_mm: open.stop_semi_mm * (fastest / f_number).min(1.0),
            ..open
        })
    }
}

/// How far the lens moves towards an object `distance_mm` away at infinity focus. By Newton's equation x e = f², with
/// x = X − e the object's distance from the front focal point once the lens has moved, X before; of the two conjugate
/// places the one nearer to the sensor.
fn advance(distance_mm: f64, p: &Paraxial) -> Option<f64> {
    let before = distance_mm + p.front_focal_z_mm;
    let ratio = 2.0 * p.efl_mm / before;
    (before > 0.0 && ratio <= 1.0).then(|| p.efl_mm * ratio / (1.0 + (1.0 - ratio * ratio).sqrt()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::lens::Prescription;

    fn phone() -> Lens {
        Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap()
    }

    #[test]
    fn infinity_at_the_d_line_is_the_prescribed_plane() {
        for by in [FocusBy::Sensor, FocusBy::Lens] {
            let lens = phone().focused_at(f64::INFINITY, by, D_LINE_NM).unwrap();
            assert!((lens.sensor_z_mm() - phone().sensor_z_mm()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_focus_error_moves_sensor_and_focus_and_ends_at_infinity() {
        let focused = phone()
            .focused_at(400.0, FocusBy::Sensor, D_LINE_NM)
            .unwrap();
        for error in [0.004, -0.004, 0.0] {
            let off = focused.with_focus_error(error, D_LINE_NM).unwrap();
            assert!((off.sensor_z_mm() - focused.sensor_z_mm() - error).abs() < 1e-12);
            // Focused at the distance that it tells, the sensor stands at the same place.
            let twin = phone().focused_at(off.focus_distance_mm(), FocusBy::Sensor, D_LINE_NM);
            assert!((twin.unwrap().sensor_z_mm() - off.sensor_z_mm()).abs() < 1e-10);
            assert_eq!(off.focus_distance_mm() < 399.0, error > 0.0);
        }
        let end = focused.with_focus_error(-1.0, D_LINE_NM).unwrap();
        assert_eq!(end.focus_distance_mm(), f64::INFINITY);
        assert!((end.sensor_z_mm() - phone().sensor_z_mm()).abs() < 1e-12);
        assert!(focused.with_focus_error(f64::NAN, D_LINE_NM).is_err());
    }

    #[test]
    fn moved_lens_keeps_object_and_sensor_where_they_were() {
        let lens = phone().focused_at(100.0, FocusBy::Lens, D_LINE_NM).unwrap();
        let apart = lens.focus_distance_mm() + lens.sensor_z_mm();
        assert!((apart - (100.0 + phone().sensor_z_mm())).abs() < 1e-9);
        let twin = phone()
            .focused_at(lens.focus_distance_mm(), FocusBy::Sensor, D_LINE_NM)
            .unwrap();
        assert!((twin.sensor_z_mm() - lens.sensor_z_mm()).abs() < 1e-12);
    }

    #[test]
    fn photographers_distance_counts_from_the_sensor() {
        for distance_mm in [300.0, 1000.0, 5e4] {
            let lens = Lens::new(&Prescription::builtin("lib_50mm_US20210263286_ex1").unwrap());
            let lens = lens
                .unwrap()
                .focused_from_sensor(distance_mm, D_LINE_NM)
                .unwrap();
            let apart = lens.focus_distance_mm() + lens.sensor_z_mm();
            assert!((apart - distance_mm).abs() < 1e-9, "{apart}");
        }
    }

    #[test]
    fn a_stop_set_by_its_size_is_that_size_and_a_wild_one_is_refused() {
        let open = phone();
        let set = open.with_stop_semi_mm(0.5 * open.stop_semi_mm()).unwrap();
        let f = open.paraxial(D_LINE_NM).unwrap().f_number;
        assert!((set.paraxial(D_LINE_NM).unwrap().f_number / (2.0 * f) - 1.0).abs() < 1e-12);
        for bad in [0.0, -1.0, f64::NAN, 3.0 * open.stop_semi_mm()] {
            assert!(open.with_stop_semi_mm(bad).is_err());
        }
    }

    #[test]
    fn near_limit_is_the_front_focal_point_or_unit_magnification() {
        let p = phone().paraxial(D_LINE_NM).unwrap();
        let focal_point = -p.front_focal_z_mm;
        let at = |d: f64, by| phone().focused_at(d, by, D_LINE_NM);
        assert!(at(focal_point * 1.001, FocusBy::Sensor).is_ok());
        assert!(at(focal_point * 0.999, FocusBy::Sensor).is_err());
        let unit = 3.0 * p.efl_mm - p.front_principal_z_mm;
        assert!(at(unit * 1.01, FocusBy::Lens).is_ok());
        assert!(at(unit * 0.99, FocusBy::Lens).is_err());
        for bad in [0.0, -5.0, f64::NAN, f64::NEG_INFINITY] {
            assert!(at(bad, FocusBy::Sensor).is_err());
            assert!(at(bad, FocusBy::Lens).is_err());
        }
    }

    #[test]
    fn stopping_down_scales_the_pupil_and_opening_further_is_refused() {
        let lens = phone().with_f_number(5.6).unwrap();
        assert!((lens.paraxial(D_LINE_NM).unwrap().f_number - 5.6).abs() < 1e-12);
        assert!(phone().with_f_number(1.2).is_err());
        assert!(phone().with_f_number(f64::NAN).is_err());
        // A printed F-number, rounded below the computed one, opens the lens fully.
        let open = lens.with_f_number(2.5).unwrap();
        assert_eq!(open.stop_semi_mm(), phone().stop_semi_mm());
    }
}
