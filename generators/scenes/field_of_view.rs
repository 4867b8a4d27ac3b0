//! What a window of the sensor sees: the card that covers it, and the window that has a given chief-ray angle.

use glam::{DMat3, DVec2, DVec3};
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{Clipping, OpticalSystem, Travel, chief_ray, trace_backward, trace_visiting};
use quadpixel::rays::Ray;
use quadpixel::render::Camera;
use quadpixel::spectrum::ChannelWavelengths;

/// Why a window does not see what it should.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// A card that the window does not see.
    #[error("distance_mm is {distance_mm}; no ray of the sensor window meets the card there")]
    Unseen {
        /// Depth of the card, mm.
        distance_mm: f64,
    },
    /// A chief-ray angle that the lens does not reach.
    #[error("window.theta_deg is {theta_deg}; no chief ray of this lens arrives at that angle")]
    NoChiefRay {
        /// The angle to the axis, deg.
        theta_deg: f64,
    },
}

/// Points around the rim of the pupil that bound the blur.
const RIM: usize = 16;
/// Room left around what is seen, as a fraction.
const MARGIN: f64 = 0.02;

/// The ray from a sensor place through the middle of the bundle that passes, away from the sensor.
pub(crate) fn middle_ray(camera: &Camera, place_mm: DVec2) -> Option<Ray> {
    let pupil = camera.pupil_at(place_mm)?;
    let origin = camera_from_sensor_mm(place_mm, camera.sensor_z_mm());
    Some(Ray {
        origin_mm: origin,
        direction: (pupil.centre_mm - origin).normalize(),
    })
}

/// Centre and side (mm) of the square card with orientation `turn` that the whole window sees, blur included, and whose
/// plane meets the window's middle ray at depth `distance_mm`.
///
/// # Errors
/// When no ray of the window meets the plane.
pub fn covering(camera: &Camera, distance_mm: f64, turn: DMat3) -> Result<(DVec3, f64), ViewError> {
    let window = camera.sensor().window_mm();
    let system = camera.system(ChannelWavelengths::REFERENCE);
    let fail = || ViewError::Unseen { distance_mm };
    let middle = middle_ray(camera, window.centre)
        .and_then(|r| trace_backward(system, r).ok())
        .ok_or_else(fail)?;
    let anchor = middle.origin_mm
        + (-distance_mm - middle.origin_mm.z) / middle.direction.z * middle.direction;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (i, j) in (0..9).map(|k| (k % 3, k / 3)).filter(|&k| k != (1, 1)) {
        let half = DVec2::new(window.half_width, window.half_height);
        let place = window.centre + half * DVec2::new(f64::from(i) - 1.0, f64::from(j) - 1.0);
        let Some(pupil) = camera.pupil_at(place) else {
            continue;
        };
        let origin = camera_from_sensor_mm(place, camera.sensor_z_mm());
        for k in 0..=RIM {
            let (sin, cos) = (k as f64 / RIM as f64 * std::f64::consts::TAU).sin_cos();
            // The last one is the middle. Apertures are left out: the ellipse's rim lies just outside them.
            let r = if k == RIM { 0.0 } else { 1.0 };
            let target =
                pupil.centre_mm + (r * (cos * pupil.axis_a_mm + sin * pupil.axis_b_mm)).extend(0.0);
            let ray = Ray {
                origin_mm: origin,
                direction: (target - origin).normalize(),
            };
            // Every channel: the colours' blurs and heights differ.
            for channel in 0..3 {
                let (system, open) = (camera.system(channel), Clipping::Off);
                let Ok(ray) = trace_visiting(system, ray, Travel::Backward, open, |_, _| ()) else {
                    continue;
                };
                let tau = turn.z_axis.dot(anchor - ray.origin_mm) / turn.z_axis.dot(ray.direction);
                if tau > 0.0 && tau.is_finite() {
                    let p = ray.origin_mm + tau * ray.direction - anchor;
                    let at = DVec2::new(turn.x_axis.dot(p), turn.y_axis.dot(p));
                    (low, high) = (low.min(at), high.max(at));
                }
            }
        }
    }
    if !(low.is_finite() && high.is_finite()) {
        return Err(fail());
    }
    let middle = 0.5 * (low + high);
    let side = (high - low).max_element() * (1.0 + 2.0 * MARGIN);
    Ok((
        anchor + middle.x * turn.x_axis + middle.y * turn.y_axis,
        side,
    ))
}

/// The place on the sensor where the chief ray arrives at `theta_deg` from the axis, at azimuth `phi_deg` (sensor
/// frame).
///
/// # Errors
/// When the lens has no such chief ray.
pub fn centre_at(system: &OpticalSystem, theta_deg: f64, phi_deg: f64) -> Result<DVec2, ViewError> {
    let fail = || ViewError::NoChiefRay { theta_deg };
    if !(0.0..90.0).contains(&theta_deg) {
        return Err(fail());
    }
    let (sin, cos) = phi_deg.to_radians().sin_cos();
    let along = DVec2::new(cos, sin);
    let angle = |h: f64| {
        let p = along * h;
        chief_ray(system, p.x, p.y)
            .ok()
            .map(|r| r.direction.z.abs().min(1.0).acos().to_degrees())
    };
    // March outwards to the first crossing (the angle may turn back near the edge of phone lenses), then bisect.
    let step = 0.01 * system.sensor_z_mm.abs().max(1.0);
    let (mut low, mut high) = (0.0, 0.0);
    loop {
        match angle(high) {
            Some(a) if a >= theta_deg => break,
            Some(_) if high < 200.0 * step => (low, high) = (high, high + step),
            _ => return Err(fail()),
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if angle(middle).is_some_and(|a| a < theta_deg) {
            low = middle
        } else {
            high = middle
        }
    }
    Ok(along * high)
}
