//! The camera with one effect left out. Each keeps the bundles that the rays are aimed at, so that two renders of one seed follow the same
//! rays and their difference is the effect's.

use std::sync::Arc;

use super::super::tracer::Tracer;
use super::Camera;
use crate::lens::{IdealLens, Paraxial};
use crate::response::{GeometricResponse, ResponseLookup};
use crate::sensor::MicrolensShifts;
use crate::spectrum::ChannelWavelengths;

impl Camera {
    /// All channels by the rays of the reference wavelength: a third of the rays. `None` where they are already.
    pub fn without_dispersion(&self) -> Option<Self> {
        let own = ChannelWavelengths::REFERENCE;
        self.is_dispersive().then(|| Self {
            systems: vec![self.systems[own].clone()],
            tracers: vec![self.tracers[own].clone()],
            ..self.clone()
        })
    }

    /// The lens by first-order optics, stopped by its entrance pupil alone: no aberration, no vignetting. `None` where it is already, for bare
    /// pixels, and for a lens whose entrance pupil lies at infinity.
    pub fn without_aberrations(&self) -> Option<Self> {
        if !self.is_real_lens() {
            return None;
        }
        let image_z_mm = self.paraxial.as_ref()?.image_z_mm(self.focus_distance_mm)?;
        let ideal = |system: &crate::lens::OpticalSystem| {
            IdealLens::new(&Paraxial::of_aligned(system), image_z_mm, system.stop)
                .map(Tracer::Ideal)
        };
        Some(Self {
            tracers: self.systems.iter().map(ideal).collect::<Option<_>>()?,
            ..self.clone()
        })
    }

    /// Whether rays go through the surfaces of a lens, one by one.
    pub fn is_real_lens(&self) -> bool {
        let real = |t: &Tracer| matches!(t, Tracer::Surfaces(_));
        self.paraxial.is_some() && self.tracers.iter().all(real)
    }

    /// Every microlens shifted as the one in the middle of the window is; a response of several shifts is read at this one, as quickly as that of a
    /// centred lens. `None` where all are alike already.
    pub fn without_chief_ray_variation(&self) -> Option<Self> {
        if matches!(
            self.shifts,
            MicrolensShifts::Centred | MicrolensShifts::Constant { .. }
        ) {
            return None;
        }
        let middle = self.sensor.centre_mm();
        let response = match &*self.response {
            ResponseLookup::Shifted(all) => {
                let fixed = all.at_shift(self.shift_at_um(middle).to_array());
                Arc::new(ResponseLookup::Fixed(fixed))
            }
            _ => self.response.clone(),
        };
        Some(Self {
            shifts: MicrolensShifts::Constant {
                shift_um: self.shifts.at_um(middle),
            },
            response,
            ..self.clone()
        })
    }

    /// The ideal pixel (boxes) whose microlens has the focal length of this one's, H/n of the moving frame: no diffraction, no crosstalk, no
    /// loss. `None` where it is one already.
    pub fn without_pixel_diffraction(&self) -> Option<Self> {
        if matches!(*self.response, ResponseLookup::Geometric(_)) {
            return None;
        }
        let frame = self.response.frame();
        let focal_um = frame.height_um / frame.index;
        let ideal =
            GeometricResponse::new(self.sensor.subpixels(), self.sensor.pitch_um(), focal_um);
        Some(Self {
            response: Arc::new(ResponseLookup::Geometric(ideal.ok()?)),
            ..self.clone()
        })
    }
}
