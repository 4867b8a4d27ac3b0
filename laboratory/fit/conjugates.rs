//! How large the disk of a point is, by its distance from the sensor: a thick lens focused on another distance.
//!
//! With the distance D from the sensor, the distance t between the principal planes, and s, s' those from them,
//!
//! ```text
//! D = s + t + s' ,  1/s + 1/s' = 1/f        disk radius = tan θ s'² (1/s_point − 1/s_focus)
//! ```
//! positive for near points; θ is the half angle of the cone of light on the sensor. The pupils stand in the principal
//! planes: another place of them changes it by the square of the disk.

use quadpixel::range::{OutOfRange, require};

/// A lens by its focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conjugates {
    /// Effective focal length, mm.
    pub focal_length_mm: f64,
    /// From the front to the rear principal plane, mm.
    pub hiatus_mm: f64,
}

impl Conjugates {
    /// Distances of object and picture from their principal planes, mm, at this distance from the sensor; `None` where
    /// none is sharp: nearer than four focal lengths.
    fn focused(&self, distance_mm: f64) -> Option<[f64; 2]> {
        let (f, sum) = (self.focal_length_mm, distance_mm - self.hiatus_mm);
        let root = sum * sum - 4.0 * f * sum;
        let picture = 0.5 * (sum - root.max(0.0).sqrt());
        (sum > 0.0 && root >= 0.0).then_some([sum - picture, picture])
    }

    /// Checks that a distance can be in focus.
    ///
    /// # Errors
    /// It is nearer than four focal lengths.
    pub fn check(&self, field: &'static str, distance_mm: f64) -> Result<(), OutOfRange> {
        let is_far = self.focused(distance_mm).is_some();
        let allowed = "four focal lengths and more, from the sensor";
        require(is_far, || {
            OutOfRange::new("capture", field, distance_mm, allowed)
        })
    }

    /// Radius of the disk of a point at `distance_mm` behind a lens that is focused on `focus_mm`, mm on the sensor,
    /// positive for near points. NaN where the lens cannot be focused so near, or the point lies in it.
    pub fn disk_radius_mm(&self, focus_mm: f64, distance_mm: f64, tangent: f64) -> f64 {
        let Some([object, picture]) = self.focused(focus_mm) else {
            return f64::NAN;
        };
        let point = distance_mm - self.hiatus_mm - picture;
        match point > 0.0 {
            true => tangent * picture * picture * (1.0 / point - 1.0 / object),
            false => f64::NAN,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::lens::{Lens, Prescription};
    use quadpixel::render::truth::Defocus;

    use super::*;

    #[test]
    fn a_point_s_rays_come_together_behind_the_sensor_by_newton_s_equation() {
        // x x' = f²: 1000 mm before the front focal point in focus, 800 mm the point.
        let lens = Conjugates {
            focal_length_mm: 50.0,
            hiatus_mm: 7.0,
        };
        let distance = |x: f64| x + 50.0 + 7.0 + 50.0 + 2500.0 / 1000.0;
        let tangent = 0.125;
        let picture = 52.5;
        let behind = 2500.0 / 800.0 - 2.5;
        // A cone of half angle θ onto the sensor from the rear principal plane, and its end behind it.
        let semi = tangent * picture;
        let radius = semi * behind / (picture + behind);
        let found = lens.disk_radius_mm(distance(1000.0), distance(800.0), tangent);
        assert!((found / radius - 1.0).abs() < 1e-12, "{found} {radius}");
        assert!(lens.disk_radius_mm(distance(1000.0), distance(1300.0), tangent) < 0.0);
        assert!(
            lens.check("distance_mm", 150.0).is_err() && lens.check("distance_mm", 220.0).is_ok()
        );
    }

    #[test]
    fn a_thick_photographic_lens_has_the_disks_of_its_prescription() {
        let prescription = Prescription::builtin("lib_dgauss_50mm").unwrap();
        let lens = Lens::new(&prescription).unwrap();
        let lens = lens.focused_from_sensor(1000.0, 550.0).unwrap();
        let paraxial = lens.paraxial(550.0).unwrap();
        let sensor_z_mm = lens.at(550.0).unwrap().sensor_z_mm;
        let defocus = Defocus::of_focused(&paraxial, 1000.0 - sensor_z_mm);
        let thick = Conjugates {
            focal_length_mm: paraxial.efl_mm,
            hiatus_mm: paraxial.rear_principal_z_mm - paraxial.front_principal_z_mm,
        };
        let pupil_mm = sensor_z_mm - paraxial.exit_pupil_z_mm;
        let tangent = paraxial.exit_pupil_semi_mm / pupil_mm;
        for distance_mm in [500.0, 700.0, 1500.0, 4000.0] {
            let found = thick.disk_radius_mm(1000.0, distance_mm, tangent);
            let depth_mm = distance_mm - sensor_z_mm;
            let truth = 0.5 * defocus.circle_of_confusion_mm(depth_mm).abs();
            assert!(
                (found.abs() / truth - 1.0).abs() < 0.02,
                "{distance_mm}: {found} {truth}"
            );
        }
    }
}
