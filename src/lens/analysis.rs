//! What a lens does over its field: spots, chief ray, distortion.
//!
//! A spot diagram is the pattern that rays of one object point draw on the sensor. The rays are spread evenly over the
//! stop: one in its middle and 24 on each of 10 rings, at the radius √((i + ½)/10) that halves the area of ring i;
//! every other ring is turned by half a spoke. They are aimed at the d line and the same rays are traced in every
//! colour, so that the colours share one pupil in the scene; the stop does not clip them a second time. The RMS radius
//! is taken about the centroid p̄: √(Σ |p − p̄|² / N). Distortion compares the chief ray's height h with the paraxial
//! one, (h − h₀)/h₀ with h₀ = f tan θ for an object at infinity.
//!
//! The object stands in the plane in focus, [`Lens::focus_distance_mm`].

use glam::DVec2;
use std::f64::consts::TAU;

use super::aim::{Aim, Field};
use super::error::LensError;
use super::placed::Lens;
use super::trace::trace_forward;
use crate::rays::Ray;
use crate::units::{C_LINE_NM, D_LINE_NM, F_LINE_NM};

const SPOT_RINGS: usize = 10;
const SPOT_SPOKES: usize = 24;
const UM_PER_MM: f64 = 1e3;

/// The lines over which a spot in colour is taken: F, d, C, in nm.
pub const SPOT_LINES_NM: [f64; 3] = [F_LINE_NM, D_LINE_NM, C_LINE_NM];

/// The spot of one field at one wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// Wavelength, nm.
    pub wavelength_nm: f64,
    /// Where the rays that pass meet the sensor: x, y in the camera frame, mm.
    pub points_mm: Vec<DVec2>,
    /// How many rays were sent.
    pub sent: usize,
}

/// What the lens does with one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldFigures {
    /// The field.
    pub field: Field,
    /// Height of the chief ray on the sensor at the d line, opposite to the field, mm; `None` where it is clipped.
    pub chief_height_mm: Option<f64>,
    /// Angle of the chief ray to the sensor's normal, degrees.
    pub chief_ray_angle_deg: Option<f64>,
    /// Distortion, %.
    pub distortion_pct: Option<f64>,
    /// Rays that pass, of [`FieldFigures::rays_sent`], at the d line.
    pub rays_through: usize,
    /// Rays sent.
    pub rays_sent: usize,
    /// RMS spot radius at the d line, µm; `None` where no ray passes.
    pub rms_d_um: Option<f64>,
    /// RMS spot radius over the F, d and C lines together, µm; `None` also for a lens without dispersion.
    pub rms_fdc_um: Option<f64>,
}

/// The points of the unit stop through which a spot's rays go.
pub fn pupil_grid() -> Vec<DVec2> {
    let mut points = vec![DVec2::ZERO];
    for ring in 0..SPOT_RINGS {
        let radius = ((ring as f64 + 0.5) / SPOT_RINGS as f64).sqrt();
        let turn = if ring % 2 == 1 { 0.5 } else { 0.0 };
        for spoke in 0..SPOT_SPOKES {
            let angle = TAU * (spoke as f64 + turn) / SPOT_SPOKES as f64;
            points.push(DVec2::from_angle(angle) * radius);
        }
    }
    points
}

/// Root of the mean squared distance from the centroid, in the points' unit; `None` without points.
pub fn rms_radius(points: &[DVec2]) -> Option<f64> {
    let count = points.len() as f64;
    let centroid = points.iter().sum::<DVec2>() / count;
    let squares: f64 = points.iter().map(|p| p.distance_squared(centroid)).sum();
    (!points.is_empty()).then(|| (squares / count).sqrt())
}

impl Lens {
    /// The spot that a field's object point draws on the sensor at one wavelength.
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees, or a wavelength out of range.
    pub fn spot(&self, field: Field, wavelength_nm: f64) -> Result<Spot, LensError> {
        self.check_field(field)?;
        let aimed_at = self.at(D_LINE_NM)?;
        let paraxial = self.paraxial(D_LINE_NM)?;
        let mut colour = self.at(wavelength_nm)?;
        colour.surfaces[colour.stop].aperture.semi_mm = f64::INFINITY;
        let grid = pupil_grid();
        let points_mm = Aim::new(&aimed_at, &paraxial, field, self.focus_distance_mm())
            .map(|aim| {
                grid.iter()
                    .filter_map(|&unit| trace_forward(&colour, aim.ray_at(unit)?).ok())
                    .map(|ray| ray.origin_mm.truncate())
                    .collect()
            })
            .unwrap_or_default();
        Ok(Spot {
            wavelength_nm,
            points_mm,
            sent: grid.len(),
        })
    }

    /// The field's d-line chief ray as it meets the sensor; `None` where it is clipped.
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees.
    pub fn chief_ray(&self, field: Field) -> Result<Option<Ray>, LensError> {
        self.check_field(field)?;
        let system = self.at(D_LINE_NM)?;
        let paraxial = self.paraxial(D_LINE_NM)?;
        Ok(
            Aim::new(&system, &paraxial, field, self.focus_distance_mm())
                .and_then(|aim| trace_forward(&system, aim.chief_ray()).ok()),
        )
    }

    /// Chief ray, distortion and spot of one field.
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees.
    pub fn field_figures(&self, field: Field) -> Result<FieldFigures, LensError> {
        self.check_field(field)?;
        let paraxial = self.paraxial(D_LINE_NM)?;
        let distance = self.focus_distance_mm();
        let chief = self.chief_ray(field)?;
        let spots = SPOT_LINES_NM
            .map(|line| self.spot(field, line))
            .into_iter()
            .collect::<Result<Vec<_>, _>>()?;
        let all: Vec<DVec2> = spots.iter().flat_map(|s| s.points_mm.clone()).collect();
        let spot_d = &spots[1];

        let height = chief.map(|ray| -ray.origin_mm.truncate().dot(field.outward()));
        // Paraxial height m (s + z_E) tan θ with m = f / (s + z_F), which is f tan θ at infinity.
        let conjugate =
            (distance + paraxial.entrance_pupil_z_mm) / (distance + paraxial.front_focal_z_mm);
        let ideal = paraxial.efl_mm
            * field.angle_deg.to_radians().tan()
            * if distance.is_finite() { conjugate } else { 1.0 };
        let distortion = |h: f64| {
            if ideal == 0.0 {
                0.0
            } else {
                100.0 * (h / ideal - 1.0)
            }
        };
        Ok(FieldFigures {
            field,
            chief_height_mm: height,
            chief_ray_angle_deg: chief.map(|ray| {
                let across = ray.direction.truncate().length();
                across.atan2(ray.direction.z).to_degrees()
            }),
            distortion_pct: height.map(distortion),
            rays_through: spot_d.points_mm.len(),
            rays_sent: spot_d.sent,
            rms_d_um: rms_radius(&spot_d.points_mm).map(|r| r * UM_PER_MM),
            rms_fdc_um: rms_radius(&all)
                .filter(|_| self.prescription().is_dispersive())
                .map(|r| r * UM_PER_MM),
        })
    }

    pub(super) fn check_field(&self, field: Field) -> Result<(), LensError> {
        if (0.0..90.0).contains(&field.angle_deg) && field.azimuth_deg.is_finite() {
            return Ok(());
        }
        let allowed = "at least 0 and below 90";
        Err(self
            .prescription
            .refuse("field angle_deg", field.angle_deg, allowed))
    }
}
