//! (stand-in until the pupil map lands)
use super::*;
use crate::sensor::SensorWindowMm;
use glam::{DVec2, DVec3};
#[derive(Clone, Copy, Debug)]
pub struct PupilEllipse {
    pub centre_mm: DVec3,
    pub axis_a_mm: DVec2,
    pub axis_b_mm: DVec2,
}
impl PupilEllipse {
    pub fn area_mm2(&self) -> f64 {
        std::f64::consts::PI * self.axis_a_mm.perp_dot(self.axis_b_mm).abs()
    }
}
#[derive(Clone, Debug)]
pub struct ExitPupilMap {
    e: PupilEllipse,
}
impl ExitPupilMap {
    pub fn new(systems: &[OpticalSystem], _w: SensorWindowMm) -> Self {
        let p = paraxial::Paraxial::of_aligned(&systems[0]);
        let a = p.exit_pupil_semi_mm * 1.3;
        Self {
            e: PupilEllipse {
                centre_mm: DVec3::new(0.0, 0.0, p.exit_pupil_z_mm),
                axis_a_mm: DVec2::X * a,
                axis_b_mm: DVec2::Y * a,
            },
        }
    }
    pub fn at(&self, _x: f64, _y: f64) -> Option<PupilEllipse> {
        Some(self.e)
    }
}
pub fn chief_ray(s: &OpticalSystem, x: f64, y: f64) -> Result<Ray, RayFailure> {
    let o = crate::frames::camera_from_sensor_mm(DVec2::new(x, y), s.sensor_z_mm);
    let p = paraxial::Paraxial::of_aligned(s);
    let mut t = DVec2::ZERO;
    let ray = |t: DVec2| Ray {
        origin_mm: o,
        direction: (DVec3::new(t.x, t.y, p.exit_pupil_z_mm) - o).normalize(),
    };
    for _ in 0..20 {
        let mut at = DVec2::ZERO;
        let _ = trace_visiting(s, ray(t), Travel::Backward, Clipping::Off, |i, q| {
            if i == s.stop {
                at = q.truncate()
            }
        });
        t -= at * (p.exit_pupil_semi_mm / s.surfaces[s.stop].aperture.semi_mm);
    }
    Ok(ray(t))
}
