//! A camera ready to render: the lens at each channel's wavelengths, its pupils over the window, the sensor, the
//! response.

mod error;
mod lens_effects;
mod mapped;
mod microlenses;
mod mirror;
mod reduced;

use std::sync::Arc;

use glam::DVec2;

use super::colours::Colours;
use crate::lens::{
    ExitPupilMap, Lens, LensError, LensMap, OpticalSystem, Paraxial, PupilEllipse, Reflections,
    chief_ray,
};
use crate::response::{Response, ResponseLookup};
use crate::sensor::{MicrolensLaw, MicrolensShifts, MovingFrame, Sensor, ShiftRule};
use crate::spectrum::ChannelWavelengths;

use super::diffraction::LensDiffraction;
use super::lens_maps::LensMaps;
use super::tracer::Tracer;
pub use error::CameraError;
use microlenses::Microlenses;

/// Where the rays of a pixel are aimed.
#[derive(Clone, Debug)]
enum Pupils {
    /// At the exit pupil of a lens, as seen from each place of the window.
    ByField(ExitPupilMap),
    /// At one ellipse, from everywhere.
    Fixed(PupilEllipse),
}

/// See the module. Everything that changes slowly over the sensor is tabulated here, once.
#[derive(Clone, Debug)]
pub struct Camera {
    sensor: Sensor,
    /// R, G, B in the middle of their bands; a single one when the lens has no dispersion.
    systems: Vec<OpticalSystem>,
    reference_tracer: Tracer,
    colours: Colours,
    pupils: Pupils,
    shifts: MicrolensShifts,
    chief_rays_beyond: f64,
    microlens_offset_um: DVec2,
    microlens_law: MicrolensLaw,
    paraxial: Option<Paraxial>,
    /// As `systems`; none for bare pixels.
    channel_paraxial: Vec<Paraxial>,
    focus_distance_mm: f64,
    wavelengths: ChannelWavelengths,
    lens_diffraction: Option<Arc<LensDiffraction>>,
    lens_maps: LensMaps,
    reflections: Option<Arc<Reflections>>,
}

impl Camera {
    /// Puts a focused lens, a sensor window, a microlens rule and a response together.
    ///
    /// # Errors
    /// See [`CameraError`].
    pub fn new(
        lens: &Lens,
        sensor: Sensor,
        rule: ShiftRule,
        response: &Response,
        wavelengths: ChannelWavelengths,
    ) -> Result<Self, CameraError> {
        same_subpixels(response, &sensor)?;
        let reference = lens.at(wavelengths.reference_nm())?;
        let systems = if lens.prescription().is_dispersive() {
            wavelengths
                .rgb_nm
                .iter()
                .map(|&w| lens.at(w))
                .collect::<Result<Vec<_>, _>>()?
        } else {
            vec![reference.clone()]
        };
        let window = sensor.window_mm();
        let pupils = ExitPupilMap::new(&with_ends(lens, &systems, &wavelengths)?, window);
        if let Some(dark) = corners(&sensor)
            .into_iter()
            .find(|p| pupils.at(p.x, p.y).is_none())
        {
            return Err(CameraError::OutsideImageCircle {
                x_mm: dark.x,
                y_mm: dark.y,
                height_mm: dark.length(),
            });
        }
        let placed = Microlenses::new(rule, &reference, &sensor, response);
        Ok(Self {
            reference_tracer: Tracer::surfaces(&reference),
            colours: Colours::for_lens(lens, response, &wavelengths)?,
            paraxial: Some(lens.paraxial(wavelengths.reference_nm())?),
            channel_paraxial: (systems.iter().map(|s| lens.paraxial(s.wavelength_nm)))
                .collect::<Result<_, _>>()?,
            focus_distance_mm: lens.focus_distance_mm(),
            sensor,
            systems,
            pupils: Pupils::ByField(pupils),
            shifts: placed.shifts,
            chief_rays_beyond: placed.beyond,
            microlens_offset_um: DVec2::ZERO,
            microlens_law: MicrolensLaw::default(),
            wavelengths,
            lens_diffraction: None,
            lens_maps: LensMaps::NotAsked,
            reflections: None,
        })
    }

    /// Bare pixels without a main lens at the origin of the camera frame, looking at `target` (z < 0): the camera of
    /// the paper's validation experiments (section 2.2.2). Its microlenses are centred.
    ///
    /// # Errors
    /// A response of other sub-pixels than the sensor's.
    pub fn bare(
        sensor: Sensor,
        response: &Response,
        wavelengths: ChannelWavelengths,
        target: PupilEllipse,
    ) -> Result<Self, CameraError> {
        same_subpixels(response, &sensor)?;
        let system = OpticalSystem {
            surfaces: Vec::new(),
            stop: 0,
            sensor_z_mm: 0.0,
            wavelength_nm: wavelengths.reference_nm(),
        };
        Ok(Self {
            reference_tracer: Tracer::surfaces(&system),
            colours: Colours::for_system(&system, response, &wavelengths),
            systems: vec![system],
            sensor,
            pupils: Pupils::Fixed(target),
            shifts: MicrolensShifts::Centred,
            chief_rays_beyond: 0.0,
            microlens_offset_um: DVec2::ZERO,
            microlens_law: MicrolensLaw::default(),
            paraxial: None,
            channel_paraxial: Vec::new(),
            focus_distance_mm: f64::INFINITY,
            wavelengths,
            lens_diffraction: None,
            lens_maps: LensMaps::NotAsked,
            reflections: None,
        })
    }

    /// The camera with its microlenses beside where the rule puts them.
    pub fn with_microlens_law(self, microlens_law: MicrolensLaw) -> Self {
        Self {
            microlens_law,
            ..self
        }
    }

    /// The camera with all its microlenses out of place by the same (x, y), sensor frame: the error of aligning their
    /// mask.
    pub fn with_microlens_offset_um(self, offset_um: DVec2) -> Self {
        Self {
            microlens_offset_um: offset_um,
            ..self
        }
    }

    /// What became of the maps that were asked for; see [`Camera::with_lens_maps`].
    pub fn lens_maps(&self) -> &LensMaps {
        &self.lens_maps
    }
    fn mapped(self, maps: Vec<Option<Arc<LensMap>>>, lens_maps: LensMaps) -> Self {
        Self {
            colours: self.colours.with_maps(maps),
            lens_maps,
            ..self
        }
    }
    /// The bundles of a lens whose surfaces are traced; `None` for bare pixels and first-order optics.
    fn lens_pupils(&self) -> Option<&ExitPupilMap> {
        match &self.pupils {
            Pupils::ByField(map) if self.is_real_lens() => Some(map),
            _ => None,
        }
    }
    /// The sensor window.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }
    /// The pixel's response in the middle of the reference channel.
    pub fn response(&self) -> &ResponseLookup {
        let middle = self.colours.count() / 2;
        let number = (self.colours).response_number(ChannelWavelengths::REFERENCE, middle);
        self.colours.response(number)
    }
    /// Where light lands behind a microlens.
    pub fn response_frame(&self) -> MovingFrame {
        self.response().frame()
    }
    /// Wavelengths of each channel.
    pub fn wavelengths(&self) -> ChannelWavelengths {
        self.wavelengths
    }
    /// Paraxial data of the focused lens at the reference wavelength; `None` for bare pixels.
    pub fn paraxial(&self) -> Option<&Paraxial> {
        self.paraxial.as_ref()
    }
    /// The same in the middle of a channel's band.
    pub fn channel_paraxial(&self, channel: usize) -> Option<&Paraxial> {
        let last = self.channel_paraxial.len().checked_sub(1)?;
        self.channel_paraxial.get(channel.min(last))
    }
    /// Depth in focus, mm from the first vertex; infinite for bare pixels.
    pub fn focus_distance_mm(&self) -> f64 {
        self.focus_distance_mm
    }
    /// By how much each of `rays` rays' share of a pixel grows with distance in front of the lens, mm per mm: the
    /// pixel's angle over √rays. 0 for bare pixels.
    pub(super) fn ray_spread(&self, rays: usize) -> f32 {
        let angle = |p: &Paraxial| self.sensor.pitch_mm() / p.efl_mm.abs();
        let angle = self.paraxial.as_ref().map_or(0.0, angle);
        (angle / (rays.max(1) as f64).sqrt()) as f32
    }
    /// The lens in the middle of a channel's band.
    pub fn system(&self, channel: usize) -> &OpticalSystem {
        &self.systems[channel.min(self.systems.len() - 1)]
    }
    /// Whether each channel is traced at wavelengths of its own.
    pub fn is_dispersive(&self) -> bool {
        self.systems.len() > 1
    }
    /// z of the sensor, camera frame, mm.
    pub fn sensor_z_mm(&self) -> f64 {
        self.systems[0].sensor_z_mm
    }
    /// The tracer at the reference wavelength.
    pub(super) fn reference_tracer(&self) -> &Tracer {
        &self.reference_tracer
    }
    /// Tracers and responses of the channels.
    pub(super) fn colours(&self) -> &Colours {
        &self.colours
    }
    /// Slopes (dx/dz, dy/dz), camera frame, of the chief rays of sensor positions in a row at the reference wavelength;
    /// `None` where there is none.
    pub(super) fn chief_slopes(&self, row_mm: &[DVec2]) -> Vec<Option<DVec2>> {
        let system = self.system(ChannelWavelengths::REFERENCE);
        self.reference_tracer.chief_slopes(system, row_mm)
    }
    /// Bounds of the bundle that passes the lens from a sensor position.
    pub fn pupil_at(&self, xy_mm: DVec2) -> Option<PupilEllipse> {
        match &self.pupils {
            Pupils::ByField(map) => map.at(xy_mm.x, xy_mm.y),
            Pupils::Fixed(ellipse) => Some(*ellipse),
        }
    }
    /// The part of the window whose chief rays lie beyond those that the response's shifts were found for: the shift of
    /// the last one is taken there.
    pub fn chief_rays_beyond(&self) -> f64 {
        self.chief_rays_beyond
    }
    /// Shift of the microlens at a sensor position, µm.
    pub fn shift_at_um(&self, xy_mm: DVec2) -> DVec2 {
        self.shifts.at_um(xy_mm) + self.microlens_law.at_um(xy_mm) + self.microlens_offset_um
    }
    /// Chief-ray angle (deg) at a sensor position, reference wavelength; `None` where no chief ray passes.
    pub fn chief_ray_angle_deg(&self, xy_mm: DVec2) -> Option<f64> {
        let system = self.system(ChannelWavelengths::REFERENCE);
        chief_ray(system, xy_mm.x, xy_mm.y)
            .ok()
            .map(|r| r.direction.z.abs().min(1.0).acos().to_degrees())
    }
}

fn same_subpixels(response: &Response, sensor: &Sensor) -> Result<(), CameraError> {
    let (response, sensor) = (response.subpixels(), sensor.subpixels());
    if response == sensor {
        return Ok(());
    }
    Err(CameraError::SubpixelsDiffer {
        response: response.to_string(),
        sensor: sensor.to_string(),
    })
}

/// The lens at the shortest and the longest wavelength that is traced as well, if they are not among `systems`: every
/// bundle between them lies within their bounds.
fn with_ends(
    lens: &Lens,
    systems: &[OpticalSystem],
    wavelengths: &ChannelWavelengths,
) -> Result<Vec<OpticalSystem>, LensError> {
    let mut all = systems.to_vec();
    if wavelengths.bands().is_some() && systems.len() > 1 {
        let traced = (0..3).flat_map(|c| wavelengths.traced_nm(c));
        let (first, last) = traced.fold((f64::INFINITY, 0f64), |(a, b), nm| (a.min(nm), b.max(nm)));
        for nm in [first, last] {
            if !all.iter().any(|s| s.wavelength_nm == nm) {
                all.push(lens.at(nm)?);
            }
        }
    }
    Ok(all)
}

/// Corners and centre of the window.
fn corners(sensor: &Sensor) -> [DVec2; 5] {
    let w = sensor.window_mm();
    let at = |x: f64, y: f64| w.centre + DVec2::new(x * w.half_width, y * w.half_height);
    [
        at(0.0, 0.0),
        at(-1.0, -1.0),
        at(1.0, -1.0),
        at(-1.0, 1.0),
        at(1.0, 1.0),
    ]
}
