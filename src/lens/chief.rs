//! The chief ray of a sensor position: backward, through the centre of the stop.
//!
//! Newton's method on the two slopes m = (D_x, D_y)/D_z at the sensor, so that the ray meets the stop's own plane at
//! its own (0, 0); the Jacobian by differences. The start is the paraxial exit pupil. Where the ray from there does not
//! reach the stop (wide lenses far off the axis) the position is walked to from the axis.

use glam::{DMat2, DVec2, DVec3};

use super::paraxial::Paraxial;
use super::surface::Travel;
use super::system::OpticalSystem;
use super::trace::{Clipping, trace_visiting};
use crate::frames::camera_from_sensor_mm;
use crate::rays::{Ray, RayFailure};

const NEWTON_LIMIT: usize = 30;
/// Distance from the stop's centre that is close enough, mm.
const CENTRED_MM: f64 = 1e-10;
const SLOPE_DIFFERENCE: f64 = 1e-6;
const WALK_STEPS: usize = 24;

/// The ray from the sensor position (`x_mm`, `y_mm`) (sensor frame) through the centre of the stop, at the sensor, with
/// `direction.z < 0` (camera frame). Clear apertures are not looked at: in a vignetted field it may be blocked. Without
/// surfaces it runs along the axis.
///
/// # Errors
/// Where such a ray fails to reach the stop; [`RayFailure::Missed`] at the stop if none settles on its centre.
pub fn chief_ray(system: &OpticalSystem, x_mm: f64, y_mm: f64) -> Result<Ray, RayFailure> {
    let target = DVec2::new(x_mm, y_mm);
    let pupil_distance = if system.surfaces.is_empty() {
        f64::INFINITY
    } else {
        system.sensor_z_mm - Paraxial::from_aligned(system).exit_pupil_z_mm
    };
    let paraxial_slope = |at: DVec2| {
        let slope = camera_from_sensor_mm(at, 0.0).truncate() / pupil_distance;
        if slope.is_finite() {
            slope
        } else {
            DVec2::ZERO
        }
    };
    let slope = match settle(system, target, paraxial_slope(target)) {
        Ok(slope) => slope,
        Err(_) => (0..=WALK_STEPS).try_fold(DVec2::ZERO, |slope, step| {
            settle(system, target * (step as f64 / WALK_STEPS as f64), slope)
        })?,
    };
    Ok(ray(system, target, slope))
}

fn ray(system: &OpticalSystem, at_mm: DVec2, slope: DVec2) -> Ray {
    Ray {
        origin_mm: camera_from_sensor_mm(at_mm, system.sensor_z_mm),
        direction: -slope.extend(1.0).normalize(),
    }
}

/// Slope of the chief ray of `at_mm`, from the slope of a ray near it.
fn settle(system: &OpticalSystem, at_mm: DVec2, start: DVec2) -> Result<DVec2, RayFailure> {
    let on_stop = |slope: DVec2| stop_point_mm(system, ray(system, at_mm, slope));
    let lost = RayFailure::Missed {
        surface: system.stop,
    };
    let mut slope = start;
    let mut off = on_stop(slope)?;
    for _ in 0..NEWTON_LIMIT {
        if off.length() < CENTRED_MM {
            return Ok(slope);
        }
        let column = |d: DVec2| Ok((on_stop(slope + d)? - off) / SLOPE_DIFFERENCE);
        let jacobian = DMat2::from_cols(
            column(DVec2::X * SLOPE_DIFFERENCE)?,
            column(DVec2::Y * SLOPE_DIFFERENCE)?,
        );
        let step = jacobian.inverse() * off;
        // Half as far, until it reaches the stop and comes nearer to its centre.
        (slope, off) = (0..12)
            .map(|halvings| slope - step * 0.5_f64.powi(halvings))
            .find_map(|next| {
                let there = on_stop(next).ok()?;
                (there.length() < off.length()).then_some((next, there))
            })
            .ok_or(lost)?;
    }
    Err(lost)
}

/// Where the ray meets the stop, in the stop's frame; what happens to it beyond does not matter.
fn stop_point_mm(system: &OpticalSystem, ray: Ray) -> Result<DVec2, RayFailure> {
    let mut found: Option<DVec3> = None;
    let end = trace_visiting(system, ray, Travel::Backward, Clipping::Off, |i, point| {
        if i == system.stop {
            found = Some(point);
        }
    });
    match (found, end) {
        (Some(point), _) => Ok(point.truncate()),
        (None, Err(failure)) => Err(failure),
        // A lens without surfaces: nothing to aim at.
        (None, Ok(_)) => Ok(DVec2::ZERO),
    }
}
