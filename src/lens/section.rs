//! The section of a lens through its axis with fans of rays, as lines of points (z to the right, y up, camera frame,
//! mm): what a drawing of the lens shows.

use glam::{DVec2, DVec3};

use super::aim::{Aim, Field};
use super::error::LensError;
use super::placed::Lens;
use super::surface::Travel;
use super::system::{OpticalSystem, SurfaceKind};
use super::trace::{Clipping, trace_visiting};
use crate::units::D_LINE_NM;

/// Rays of a fan, and the part of the stop's radius that they reach.
const FAN: usize = 7;
const FAN_REACH: f64 = 0.98;
/// Length of the rays drawn in front of the lens, as part of its length.
const LEAD: f64 = 0.15;
const PROFILE_POINTS: usize = 33;
/// Largest field angle looked for, degrees.
const WIDEST_FIELD_DEG: f64 = 89.0;
/// Steps in which it is looked for.
const FIELD_STEPS: usize = 200;

/// Points of a line in the section: (z, y), mm.
pub type SectionLine = Vec<DVec2>;

/// A lens cut through its axis.
pub struct Section {
    /// Profile of each surface, from −semi-aperture to +semi-aperture; empty for the stop and for open dummies.
    pub profiles: Vec<SectionLine>,
    /// Closed outlines of the glasses.
    pub glasses: Vec<SectionLine>,
    /// Per field the paths of its rays, from a little in front of the lens to the sensor; rays that are lost are left
    /// out.
    pub fans: Vec<Vec<SectionLine>>,
    /// Upper and lower edge of the stop, and the unit vector away from its opening.
    pub stop: [(DVec2, DVec2); 2],
    /// The sensor, as far as the rays reach either way.
    pub sensor: [DVec2; 2],
    /// The mirror at which a folded lens is drawn straight on.
    pub mirror: Option<[DVec2; 2]>,
}

impl Lens {
    /// The section of the lens as it stands, with a fan of d-line rays for each field angle (degrees, above the axis).
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees.
    pub fn section(&self, fields_deg: &[f64]) -> Result<Section, LensError> {
        let system = self.at(D_LINE_NM)?;
        let fans = fields_deg
            .iter()
            .map(|&angle| fan(self, &system, angle))
            .collect::<Result<Vec<_>, _>>()?;
        let profiles: Vec<SectionLine> = (0..system.surfaces.len())
            .map(|i| profile(&system, i))
            .collect();
        let surfaces = self.prescription().surfaces.iter().enumerate();
        let glasses = surfaces
            .filter(|(_, surface)| surface.glass.is_some())
            .map(|(i, _)| {
                let back = profiles[i + 1].iter().rev();
                profiles[i].iter().chain(back).copied().collect()
            })
            .collect();
        let half = 0.5 * system.surfaces[system.stop].aperture.semi_mm;
        let mirror = self.prescription().fold_z_mm();
        Ok(Section {
            glasses,
            stop: stop_edges(&system),
            sensor: sensor_line(&system, &fans),
            mirror: mirror.map(|z| [DVec2::new(z - half, -half), DVec2::new(z + half, half)]),
            profiles,
            fans,
        })
    }

    /// Half the field of view, degrees: what the source states, or else the last field verified, or else the widest;
    /// and in any case no wider than where the chief ray still passes.
    ///
    /// # Errors
    /// None for a lens that [`Lens::new`] made.
    pub fn half_field_deg(&self) -> Result<f64, LensError> {
        let prescription = self.prescription();
        let verified = prescription.verification.rms_spot_um.last();
        let given = prescription
            .stated
            .half_fov_deg
            .or(verified.map(|f| f.field_deg))
            .unwrap_or(WIDEST_FIELD_DEG)
            .clamp(0.0, WIDEST_FIELD_DEG);
        for step in (1..=FIELD_STEPS).rev() {
            let angle = given * step as f64 / FIELD_STEPS as f64;
            if self.chief_ray(Field::up(angle))?.is_some() {
                return Ok(angle);
            }
        }
        Ok(0.0)
    }
}

/// The section's point of a camera-frame point.
fn section(p: DVec3) -> DVec2 {
    DVec2::new(p.z, p.y)
}

/// The paths of one field's rays, from a little in front of the lens to the sensor; those that are lost are left out.
fn fan(lens: &Lens, system: &OpticalSystem, angle_deg: f64) -> Result<Vec<Vec<DVec2>>, LensError> {
    let field = Field::up(angle_deg);
    lens.check_field(field)?;
    let paraxial = lens.paraxial(D_LINE_NM)?;
    let Some(aim) = Aim::new(system, &paraxial, field, lens.focus_distance_mm()) else {
        return Ok(Vec::new());
    };
    let lead_mm = LEAD * system.sensor_z_mm;
    let path = |k: usize| {
        let unit = FAN_REACH * (2.0 * k as f64 / (FAN - 1) as f64 - 1.0);
        let ray = aim.ray_at(DVec2::new(0.0, unit))?;
        let mut points = Vec::new();
        let visit = |surface: usize, local: DVec3| {
            // A stop behind the glass that follows it would send the line there and back.
            if system.surfaces[surface].kind == SurfaceKind::Stop {
                return;
            }
            let point = system.surfaces[surface].pose.camera_point_mm(local);
            if points.is_empty() {
                points.push(section(point - lead_mm * ray.direction));
            }
            points.push(section(point));
        };
        let end = trace_visiting(system, ray, Travel::Forward, Clipping::All, visit).ok()?;
        points.push(section(end.origin_mm));
        Some(points)
    };
    Ok((0..FAN).filter_map(path).collect())
}

/// A surface's profile from −semi-aperture to +semi-aperture; empty for an open dummy.
fn profile(system: &OpticalSystem, i: usize) -> Vec<DVec2> {
    let surface = &system.surfaces[i];
    let semi = surface.aperture.semi_mm;
    if i == system.stop || !semi.is_finite() {
        return Vec::new();
    }
    (0..PROFILE_POINTS)
        .filter_map(|k| {
            let y = semi * (2.0 * k as f64 / (PROFILE_POINTS - 1) as f64 - 1.0);
            let local = DVec3::new(0.0, y, surface.sag_mm(y * y)?);
            Some(section(surface.pose.camera_point_mm(local)))
        })
        .collect()
}

/// Upper and lower edge of the stop, and the unit vector away from its opening.
fn stop_edges(system: &OpticalSystem) -> [(DVec2, DVec2); 2] {
    let stop = &system.surfaces[system.stop];
    let semi = stop.aperture.semi_mm;
    let sag = stop.sag_mm(semi * semi).unwrap_or(0.0);
    [1.0, -1.0].map(|side| {
        let point = |y: f64| section(stop.pose.camera_point_mm(DVec3::new(0.0, side * y, sag)));
        (point(semi), point(semi + 1.0) - point(semi))
    })
}

/// The sensor, as far as the rays drawn reach either way.
fn sensor_line(system: &OpticalSystem, fans: &[Vec<Vec<DVec2>>]) -> [DVec2; 2] {
    let ends = fans.iter().flatten().filter_map(|ray| ray.last());
    let half = ends.map(|p| p.y.abs()).fold(0.0, f64::max);
    let half = if half > 0.0 { 1.05 * half } else { 1.0 };
    [-half, half].map(|y| DVec2::new(system.sensor_z_mm, y))
}
