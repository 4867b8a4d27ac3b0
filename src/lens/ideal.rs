//! The lens without aberrations: what first-order optics makes of it.
//!
//! A line of slope m = (dx, dy)/dz that stands at x in the image plane crosses the rear principal plane at h and goes
//! on from the front one at the same height, bent by the focal length f (Welford, Aberrations of Optical Systems,
//! section 3.5):
//!
//! ```text
//! h = x + m (z_H' − z')        m_scene = m + h/f        it passes z at  h + m_scene (z − z_H)
//! ```
//!
//! with z' the image of the depth in focus. The entrance pupil alone stops it: no distortion, no field curvature, no
//! vignetting. One ray costs a root and a division, whatever the number of surfaces.

use glam::DVec2;

use super::paraxial::Paraxial;
use crate::rays::{RayBatch, RayStatus};

/// A lens by its principal planes, focal length and entrance pupil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealLens {
    power_per_mm: f64,
    /// z_H' − z', mm.
    from_image_mm: f64,
    front_principal_z_mm: f64,
    pupil_z_mm: f64,
    pupil_semi_mm: f64,
    stop: u16,
}

impl IdealLens {
    /// From first-order data; rays start in the plane `image_z_mm`. `stop` is the surface that lost rays are said to be
    /// lost at. `None` for a lens without an entrance pupil at a finite place.
    pub fn new(p: &Paraxial, image_z_mm: f64, stop: usize) -> Option<Self> {
        let lens = Self {
            power_per_mm: 1.0 / p.efl_mm,
            from_image_mm: p.rear_principal_z_mm - image_z_mm,
            front_principal_z_mm: p.front_principal_z_mm,
            pupil_z_mm: p.entrance_pupil_z_mm,
            pupil_semi_mm: p.entrance_pupil_semi_mm,
            stop: u16::try_from(stop).ok()?,
        };
        let numbers = [
            lens.power_per_mm,
            lens.from_image_mm,
            lens.front_principal_z_mm,
            lens.pupil_z_mm,
            lens.pupil_semi_mm,
        ];
        numbers.iter().all(|x| x.is_finite()).then_some(lens)
    }

    /// Takes every ray of `batch` from the sensor into the scene, as [`super::PacketTracer::trace_backward`] does: it
    /// ends in the plane of the first vertex, z = 0. The sensor's small distance from the image plane is not looked at.
    pub fn trace_backward(&self, batch: &mut RayBatch) {
        let n = batch.len();
        batch.status.resize(n, 0);
        batch.surface.resize(n, 0);
        let reach = self.pupil_semi_mm * self.pupil_semi_mm;
        let to_pupil = self.pupil_z_mm - self.front_principal_z_mm;
        for i in 0..n {
            let x = DVec2::new(batch.ox[i], batch.oy[i]);
            let m = DVec2::new(batch.dx[i], batch.dy[i]) / batch.dz[i];
            let h = x + m * self.from_image_mm;
            let bent = m + h * self.power_per_mm;
            // Written so that a ray along the sensor, whose slope is not finite, is stopped.
            if (h + bent * to_pupil).length_squared() <= reach {
                let at = h - bent * self.front_principal_z_mm;
                let z = -1.0 / (1.0 + bent.length_squared()).sqrt();
                (batch.ox[i], batch.oy[i], batch.oz[i]) = (at.x, at.y, 0.0);
                (batch.dx[i], batch.dy[i], batch.dz[i]) = (bent.x * z, bent.y * z, z);
                (batch.status[i], batch.surface[i]) = (RayStatus::Ok as u8, 0);
            } else {
                (batch.status[i], batch.surface[i]) = (RayStatus::Vignetted as u8, self.stop);
            }
        }
    }

    /// Slope at the sensor of the ray through the middle of the entrance pupil, from (x, y) mm, camera frame.
    pub fn chief_slope(&self, at_mm: DVec2) -> DVec2 {
        let to_pupil = self.pupil_z_mm - self.front_principal_z_mm;
        let lever = 1.0 + to_pupil * self.power_per_mm;
        -at_mm * lever / (self.from_image_mm * lever + to_pupil)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::lens::{FocusBy, Lens, Prescription, trace_backward};

    const FOCUS_MM: f64 = 2000.0;

    fn double_gauss() -> (Lens, IdealLens) {
        let lens = Lens::new(&Prescription::builtin("lib_dgauss_50mm").unwrap()).unwrap();
        let lens = lens.focused_at(FOCUS_MM, FocusBy::Sensor, 550.0).unwrap();
        let p = lens.paraxial(550.0).unwrap();
        let ideal = IdealLens::new(&p, p.image_z_mm(FOCUS_MM).unwrap(), 5).unwrap();
        (lens, ideal)
    }

    fn traced(ideal: &IdealLens, origin: DVec3, slope: DVec2) -> RayBatch {
        let mut batch = RayBatch::default();
        batch.push(origin, -slope.extend(1.0).normalize());
        ideal.trace_backward(&mut batch);
        batch
    }

    #[test]
    fn all_rays_of_a_place_meet_in_one_point_of_the_plane_in_focus() {
        let (lens, ideal) = double_gauss();
        let p = lens.paraxial(550.0).unwrap();
        // Newton: magnification −f/x with x from the front focal point.
        let scale = (FOCUS_MM + p.front_focal_z_mm) / p.efl_mm;
        let place = DVec2::new(3.0, -8.0);
        let origin = place.extend(lens.sensor_z_mm());
        let chief = ideal.chief_slope(place);
        for offset in [DVec2::ZERO, DVec2::new(0.1, 0.02), DVec2::new(-0.05, 0.12)] {
            let batch = traced(&ideal, origin, chief + offset);
            let ray = batch.get(0).unwrap();
            let at =
                ray.origin_mm + ray.direction * ((-FOCUS_MM - ray.origin_mm.z) / ray.direction.z);
            assert!(
                (at.truncate() + place * scale).length() < 1e-9 * scale,
                "{at}"
            );
        }
    }

    #[test]
    fn its_pupil_ends_where_the_entrance_pupil_does() {
        let (lens, ideal) = double_gauss();
        let p = lens.paraxial(550.0).unwrap();
        let image_z = p.image_z_mm(FOCUS_MM).unwrap();
        let origin = DVec3::new(0.0, 0.0, lens.sensor_z_mm());
        // From the axis, the edge of the exit pupil.
        let edge = p.exit_pupil_semi_mm / (p.exit_pupil_z_mm - image_z);
        assert!(
            traced(&ideal, origin, DVec2::new(0.999 * edge, 0.0))
                .get(0)
                .is_ok()
        );
        let lost = traced(&ideal, origin, DVec2::new(0.0, 1.001 * edge)).get(0);
        assert_eq!(lost, Err(crate::rays::RayFailure::Vignetted { surface: 5 }));
        let mut along = RayBatch::default();
        along.push(origin, DVec3::X);
        ideal.trace_backward(&mut along);
        assert!(along.get(0).is_err());
    }

    #[test]
    fn near_the_axis_it_is_the_real_lens() {
        let (lens, ideal) = double_gauss();
        let system = lens.at(550.0).unwrap();
        let shift =
            lens.sensor_z_mm() - lens.paraxial(550.0).unwrap().image_z_mm(FOCUS_MM).unwrap();
        // Third order: a tenth of the height and slope, a thousandth of the error; at heights where the fifth order is
        // small (a full aperture's slopes are 0.22).
        let error = |height: f64| {
            let slope = DVec2::new(0.2 * height, 0.1 * height);
            let place = DVec2::new(0.3 * height, -0.5 * height);
            let ours = traced(&ideal, place.extend(lens.sensor_z_mm()), slope).ray(0);
            let start = crate::rays::Ray {
                origin_mm: (place + slope * shift).extend(lens.sensor_z_mm()),
                direction: -slope.extend(1.0).normalize(),
            };
            let real = trace_backward(&system, start).unwrap();
            let at = |r: crate::rays::Ray| {
                (r.origin_mm + r.direction * ((-FOCUS_MM - r.origin_mm.z) / r.direction.z))
                    .truncate()
            };
            (at(ours) - at(real)).length()
        };
        let (coarse, fine) = (error(0.2), error(0.02));
        assert!(fine < 2e-3 * coarse && coarse > 1e-6, "{coarse} {fine}");
    }
}
