//! Places of a sensor of 5.6 × 5.6 mm behind a phone lens, each with the rays that reach it.

use glam::{DVec2, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::frames::{camera_from_sensor_mm, uv_from_camera_direction};
use quadpixel::lens::{FocusBy, Lens, Prescription, trace_backward};
use quadpixel::rays::Ray;
use quadpixel::render::Camera;
use quadpixel::response::{AngularResponse, Response};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

use crate::error::LaboratoryError;

/// It covers the sensor; the paper's own lens is not public to us.
pub(super) const LENS: &str = "wide_US11940605B2_emb1";
/// Side of the paper's sensor (section 3.1), mm.
pub(super) const SIDE_MM: f64 = 5.6;
const FOCUS_MM: f64 = 750.0;
/// Rays of a place.
const RAYS: usize = 160;

/// The sensor.
pub(super) struct Sensor56(Camera);

/// A place of the sensor.
pub(super) struct Place {
    pub shift_um: [f64; 2],
    /// Direction cosines of the rays that come through the lens.
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    /// cos θ dω of each, in any unit.
    measure: Vec<f64>,
}

impl Sensor56 {
    /// With the lens shifts that the table holds for chief rays.
    pub fn new(stack: &PixelStack, table: &AngularResponse) -> Result<Self, LaboratoryError> {
        let wavelengths = ChannelWavelengths::default();
        let lens = Prescription::builtin(LENS)
            .and_then(|p| Lens::new(&p))
            .and_then(|l| l.focused_at(FOCUS_MM, FocusBy::Sensor, wavelengths.reference_nm()))?;
        let across = (SIDE_MM * 1e3 / stack.pitch_um).round() as usize;
        let size = (across, across);
        let sensor = Sensor::new(stack.pitch_um, stack.subpixels, size, DVec2::ZERO)?;
        let response = Response::Table(table.clone());
        Ok(Self(Camera::new(
            &lens,
            sensor,
            ShiftRule::ChiefRay,
            &response,
            wavelengths,
        )?))
    }

    /// The part of the sensor whose chief rays lie beyond the last one that a shift was found for.
    pub fn chief_rays_beyond(&self) -> f64 {
        self.0.chief_rays_beyond()
    }

    /// The place (x, y), mm; `None` where no light comes.
    pub fn place(&self, x_mm: f64, y_mm: f64) -> Option<Place> {
        let xy = DVec2::new(x_mm, y_mm);
        let pupil = self.0.pupil_at(xy)?;
        let system = self.0.system(ChannelWavelengths::REFERENCE);
        let origin_mm = camera_from_sensor_mm(xy, self.0.sensor_z_mm());
        let mut place = Place {
            shift_um: self.0.shift_at_um(xy).to_array(),
            u: Vec::new(),
            v: Vec::new(),
            measure: Vec::new(),
        };
        for k in 0..RAYS {
            // Equal areas, evenly turned (Vogel's spiral): the same at every place, so neighbours differ smoothly.
            let radius = ((k as f64 + 0.5) / RAYS as f64).sqrt();
            let (sin, cos) = (k as f64 * 2.399_963_229_728_653).sin_cos();
            let on_pupil: DVec3 = pupil.centre_mm
                + (radius * (cos * pupil.axis_a_mm + sin * pupil.axis_b_mm)).extend(0.0);
            let way = on_pupil - origin_mm;
            let direction = way.normalize();
            let ray = Ray {
                origin_mm,
                direction,
            };
            if trace_backward(system, ray).is_ok() {
                let uv = uv_from_camera_direction(-direction);
                place.u.push(uv.x as f32);
                place.v.push(uv.y as f32);
                place
                    .measure
                    .push(way.z * way.z / way.length_squared().powi(2));
            }
        }
        (!place.u.is_empty()).then_some(place)
    }
}

impl Sensor56 {
    /// The place (x, y), mm, with the rays of directions on a grid of (u, v), `step` apart: equal parts of the
    /// irradiance.
    pub fn place_on_nodes(&self, x_mm: f64, y_mm: f64, step: f64) -> Option<Place> {
        let whole = self.place(x_mm, y_mm)?;
        let xy = DVec2::new(x_mm, y_mm);
        let origin_mm = camera_from_sensor_mm(xy, self.0.sensor_z_mm());
        let ahead = (self.0.pupil_at(xy)?.centre_mm.z - origin_mm.z).signum();
        let system = self.0.system(ChannelWavelengths::REFERENCE);
        let mut place = Place {
            shift_um: whole.shift_um,
            u: Vec::new(),
            v: Vec::new(),
            measure: Vec::new(),
        };
        let reach = (0.94 / step) as i64;
        for (a, b) in (-reach..=reach).flat_map(|a| (-reach..=reach).map(move |b| (a, b))) {
            let (u, v) = (a as f64 * step, b as f64 * step);
            let w2 = 1.0 - u * u - v * v;
            if w2 < 0.1 {
                continue;
            }
            // The sensor frame's y runs against the camera frame's for directions away from the sensor (see
            // `uv_from_camera_direction`).
            let direction = DVec3::new(u, -v, ahead * w2.sqrt());
            let ray = Ray {
                origin_mm,
                direction,
            };
            if trace_backward(system, ray).is_ok() {
                place.u.push(u as f32);
                place.v.push(v as f32);
                place.measure.push(1.0);
            }
        }
        (!place.u.is_empty()).then_some(place)
    }
}

impl Place {
    /// What a white wall gives each sub-pixel, from the weights `[ray][sub-pixel]`.
    pub fn flat(&self, weights: &[f32], count: usize) -> Vec<f64> {
        let mut sums = vec![0.0; count];
        for (weights, measure) in weights.chunks_exact(count).zip(&self.measure) {
            for (sum, w) in sums.iter_mut().zip(weights) {
                *sum += measure * f64::from(*w);
            }
        }
        sums
    }
}
