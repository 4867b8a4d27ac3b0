//! The chief ray of a sensor position: backward, through the centre of the stop.
//!
//! Newton's method on the two slopes m = (D_x, D_y)/D_z at the sensor, so that the ray meets the stop's own plane at
//! its own (0, 0); the Jacobian by differences. The start is the paraxial exit pupil. Where the ray from there does not
//! reach the stop (wide lenses far off the axis) the position is walked to from the axis. Along a row of positions each
//! start is the ray before, and so is the Jacobian, which follows by what each step brought (C. G. Broyden, Mathematics
//! of Computation 19, 577 (1965)).

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
/// What a step along a row may leave of the distance to the centre, for its Jacobian to be kept.
const FOLLOWS: f64 = 0.1;
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
    let from = |slope: DVec2| Start {
        slope,
        jacobian: None,
    };
    let found = match settle(system, target, from(paraxial_slope(target)), 0.0) {
        Ok(found) => found,
        Err(_) => (0..=WALK_STEPS).try_fold(from(DVec2::ZERO), |start, step| {
            let here = target * (step as f64 / WALK_STEPS as f64);
            settle(system, here, from(start.slope), 0.0)
        })?,
    };
    Ok(ray(system, target, found.slope))
}

/// The same for positions in a row: each is sought from those before it, which takes a third of the rays.
pub fn chief_rays(
    system: &OpticalSystem,
    row_mm: impl IntoIterator<Item = DVec2>,
) -> Vec<Result<Ray, RayFailure>> {
    let mut before: [Option<Start>; 2] = [None; 2];
    let one = |at: DVec2| {
        let start = match before {
            [Some(first), Some(last)] => Some(Start {
                slope: 2.0 * last.slope - first.slope,
                ..last
            }),
            [_, last] => last,
        };
        if let Some(found) = start.and_then(|start| settle(system, at, start, FOLLOWS).ok()) {
            before = [before[1], Some(found)];
            return Ok(ray(system, at, found.slope));
        }
        let found = chief_ray(system, at.x, at.y);
        let slope = |ray: &Ray| ray.direction.truncate() / ray.direction.z;
        let last = found.as_ref().ok().map(|ray| Start {
            slope: slope(ray),
            jacobian: None,
        });
        before = [None, last];
        found
    };
    row_mm.into_iter().map(one).collect()
}

/// What is known of a chief ray: its slope, and how the point in the stop changes with that.
#[derive(Clone, Copy)]
struct Start {
    slope: DVec2,
    jacobian: Option<DMat2>,
}

fn ray(system: &OpticalSystem, at_mm: DVec2, slope: DVec2) -> Ray {
    Ray {
        origin_mm: camera_from_sensor_mm(at_mm, system.sensor_z_mm),
        direction: -slope.extend(1.0).normalize(),
    }
}

/// The chief ray of `at_mm`, from a ray near it. A step that leaves less than `follows` of the distance to the stop's
/// centre keeps the Jacobian, brought up to date; after others it is found anew.
fn settle(
    system: &OpticalSystem,
    at_mm: DVec2,
    start: Start,
    follows: f64,
) -> Result<Start, RayFailure> {
    let on_stop = |slope: DVec2| stop_point_mm(system, ray(system, at_mm, slope));
    let lost = RayFailure::Missed {
        surface: system.stop,
    };
    let Start {
        mut slope,
        mut jacobian,
    } = start;
    let mut off = on_stop(slope)?;
    for _ in 0..NEWTON_LIMIT {
        if off.length() < CENTRED_MM {
            return Ok(Start { slope, jacobian });
        }
        let column = |d: DVec2| Ok((on_stop(slope + d)? - off) / SLOPE_DIFFERENCE);
        let known = match jacobian {
            Some(known) => known,
            None => DMat2::from_cols(
                column(DVec2::X * SLOPE_DIFFERENCE)?,
                column(DVec2::Y * SLOPE_DIFFERENCE)?,
            ),
        };
        let step = known.inverse() * off;
        // Half as far, until it reaches the stop and comes nearer to its centre.
        let nearer = (0..12)
            .map(|halvings| slope - step * 0.5_f64.powi(halvings))
            .find_map(|next| {
                let there = on_stop(next).ok()?;
                (there.length() < off.length()).then_some((next, there))
            });
        let Some((next, there)) = nearer else {
            // The known one was another place's, perhaps.
            jacobian.take().ok_or(lost)?;
            continue;
        };
        let (way, change) = (next - slope, there - off);
        let unforeseen = (change - known * way) / way.length_squared();
        let keeps = there.length() < follows * off.length();
        jacobian = keeps.then(|| known + DMat2::from_cols(unforeseen * way.x, unforeseen * way.y));
        (slope, off) = (next, there);
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::lens::{FocusBy, Lens, Prescription};

    /// Steps in a row may reach positions by the edge that the walk from the axis does not.
    #[test]
    fn chief_rays_in_a_row_are_those_of_each_position() {
        for (name, edge_mm) in [
            ("wide_US20120327520A1_emb3", 3.2),
            ("lib_dgauss_50mm", 25.0),
            ("lib_double_gauss_100mm_glass", 25.0),
            ("lib_fisheye_10mm", 14.0),
        ] {
            let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
            let lens = lens.focused_at(800.0, FocusBy::Sensor, 550.0).unwrap();
            let system = lens.at(550.0).unwrap();
            let place = |k: usize| DVec2::new(edge_mm * (k as f64 / 20.0 - 1.0), 0.3 * edge_mm);
            let places: Vec<DVec2> = (0..41).map(place).collect();
            let row = chief_rays(&system, places.iter().copied());
            let mut found = 0;
            for (place, in_row) in places.iter().zip(row) {
                let alone = chief_ray(&system, place.x, place.y);
                let Ok(in_row) = in_row else {
                    assert!(alone.is_err(), "{name} {place}");
                    continue;
                };
                let off = stop_point_mm(&system, in_row).unwrap().length();
                assert!(off < 2.0 * CENTRED_MM, "{name} {place}: {off}");
                if let Ok(alone) = alone {
                    let apart = in_row.direction.distance(alone.direction);
                    assert!(apart < 1e-10, "{name} {place}: {apart}");
                    found += 1;
                }
            }
            assert!(found > 20, "{name}: {found}");
        }
    }
}
