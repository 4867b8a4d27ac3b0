//! Real rays from one object point aimed at points of the stop.
//!
//! An object point in the field direction (θ, azimuth) sends a ray through each point q of the plane through the
//! paraxial entrance pupil's centre, square to the direction. Newton's method, with a numerical Jacobian of the traced
//! map q ↦ p (p on the stop, in its own frame), finds the ray that meets the wanted p. Wide fields, whose pupil wanders
//! off the paraxial one, are reached in steps of angle, each started from the last one's chief ray.

use glam::{DMat2, DVec2, DVec3};

use super::paraxial::Paraxial;
use super::surface::Travel;
use super::system::OpticalSystem;
use super::trace::{Clipping, trace_visiting};
use crate::rays::Ray;

/// Newton's method stops when the stop is met within this part of its radius.
const AIM_TOLERANCE: f64 = 1e-9;
/// Step of the numerical Jacobian, as part of the entrance pupil's radius.
const JACOBIAN_STEP: f64 = 1e-4;
const NEWTON_STEPS: usize = 30;
const HALVINGS: usize = 10;
/// Most steps of angle in which a field is approached.
const MOST_FIELD_STEPS: usize = 64;

/// A direction in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Angle from the axis, degrees, below 90.
    pub angle_deg: f64,
    /// Where in the scene it lies about the axis, degrees: 0 to the right (+x), 90 up (+y).
    pub azimuth_deg: f64,
}

impl Field {
    /// A field above the axis.
    pub fn up(angle_deg: f64) -> Field {
        Field {
            angle_deg,
            azimuth_deg: 90.0,
        }
    }

    /// Unit vector from the axis towards the field, in the plane of x and y.
    pub fn outward(&self) -> DVec2 {
        DVec2::from_angle(self.azimuth_deg.to_radians())
    }

    /// Direction in which light from it travels.
    pub fn light_direction(&self) -> DVec3 {
        let (sin, cos) = self.angle_deg.to_radians().sin_cos();
        (-sin * self.outward()).extend(cos)
    }
}

/// Aims rays of one object point at the stop of one system.
pub struct Aim<'a> {
    system: &'a OpticalSystem,
    stop_semi_mm: f64,
    pupil_semi_mm: f64,
    source: Source,
    chief: DVec2,
}

/// The object point, and the plane of q.
#[derive(Clone, Copy)]
struct Source {
    direction: DVec3,
    centre_mm: DVec3,
    axis_a: DVec3,
    axis_b: DVec3,
    point_mm: Option<DVec3>,
}

impl Source {
    fn new(field: Field, entrance_pupil_z_mm: f64, object_distance_mm: f64) -> Source {
        let direction = field.light_direction();
        let centre_mm = DVec3::new(0.0, 0.0, entrance_pupil_z_mm);
        let sideways = field.outward().perp().extend(0.0);
        let along = (object_distance_mm + entrance_pupil_z_mm) / direction.z;
        Source {
            direction,
            centre_mm,
            axis_a: direction.cross(sideways),
            axis_b: sideways,
            point_mm: along.is_finite().then(|| centre_mm - along * direction),
        }
    }

    fn ray(&self, q: DVec2) -> Ray {
        let through = self.centre_mm + q.x * self.axis_a + q.y * self.axis_b;
        match self.point_mm {
            None => Ray {
                origin_mm: through,
                direction: self.direction,
            },
            Some(point) => Ray {
                origin_mm: point,
                direction: (through - point).normalize(),
            },
        }
    }
}

impl<'a> Aim<'a> {
    /// Finds the chief ray of a field, for an object in the plane `object_distance_mm` (infinite allowed) in front of
    /// the first vertex. `None` when no ray of the field reaches the middle of the stop.
    pub fn new(
        system: &'a OpticalSystem,
        paraxial: &Paraxial,
        field: Field,
        object_distance_mm: f64,
    ) -> Option<Aim<'a>> {
        let source = |angle_deg: f64| {
            let part = Field { angle_deg, ..field };
            Source::new(part, paraxial.entrance_pupil_z_mm, object_distance_mm)
        };
        let mut aim = Aim {
            system,
            stop_semi_mm: system.surfaces[system.stop].aperture.semi_mm,
            pupil_semi_mm: paraxial.entrance_pupil_semi_mm,
            source: source(0.0),
            chief: DVec2::ZERO,
        };
        let mut steps = 1;
        while steps <= MOST_FIELD_STEPS {
            aim.chief = DVec2::ZERO;
            let reached = (0..=steps).all(|k| {
                aim.source = source(field.angle_deg * k as f64 / steps as f64);
                match aim.solve(DVec2::ZERO, aim.chief) {
                    Some(q) => {
                        aim.chief = q;
                        true
                    }
                    None => false,
                }
            });
            if reached {
                return Some(aim);
            }
            steps *= 2;
        }
        None
    }

    /// The chief ray in object space.
    pub fn chief_ray(&self) -> Ray {
        self.source.ray(self.chief)
    }

    /// The ray in object space that meets the stop at `unit` times its semi-aperture, in the stop's own frame; `None`
    /// if there is none.
    pub fn ray_at(&self, unit: DVec2) -> Option<Ray> {
        let guess = self.chief + self.in_source_axes(unit) * self.pupil_semi_mm;
        let q = self.solve(unit * self.stop_semi_mm, guess)?;
        Some(self.source.ray(q))
    }

    /// A point of the stop's plane seen along the axes of the plane of q.
    fn in_source_axes(&self, p: DVec2) -> DVec2 {
        let b = self.source.axis_b.truncate();
        DVec2::new(-b.perp().dot(p), b.dot(p))
    }

    fn solve(&self, target_mm: DVec2, guess: DVec2) -> Option<DVec2> {
        let mut q = guess;
        let mut miss = self.stop_point(q)? - target_mm;
        let h = JACOBIAN_STEP * self.pupil_semi_mm;
        for _ in 0..NEWTON_STEPS {
            if miss.length() <= AIM_TOLERANCE * self.stop_semi_mm {
                return Some(q);
            }
            let along =
                |d: DVec2| Some((self.stop_point(q + d)? - self.stop_point(q - d)?) / (2.0 * h));
            let jacobian = DMat2::from_cols(along(DVec2::new(h, 0.0))?, along(DVec2::new(0.0, h))?);
            let step = jacobian.inverse() * miss;
            // Half the step as often as it leaves the lens or does not come nearer.
            let (nearer, left) = (0..HALVINGS)
                .map(|k| q - step * 0.5_f64.powi(k as i32))
                .filter_map(|next| Some((next, self.stop_point(next)? - target_mm)))
                .find(|(_, left)| left.length() < miss.length())?;
            (q, miss) = (nearer, left);
        }
        None
    }

    /// Where the ray through q meets the stop's surface, in the stop's frame; what happens behind the stop does not
    /// matter.
    fn stop_point(&self, q: DVec2) -> Option<DVec2> {
        let mut met = None;
        let visit = |surface, point: DVec3| {
            if surface == self.system.stop {
                met = Some(point.truncate());
            }
        };
        // A ray lost behind the stop has been there all the same.
        let _ = trace_visiting(
            self.system,
            self.source.ray(q),
            Travel::Forward,
            Clipping::Off,
            visit,
        );
        met
    }
}
