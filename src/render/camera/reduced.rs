//! The camera with one effect left out. Each keeps the bundles that the rays are aimed at, so that two renders of one
//! seed follow the same rays and their difference is the effect's.

use std::sync::Arc;

use super::super::tracer::Tracer;
use super::Camera;
use crate::lens::{IdealLens, OpticalSystem, Paraxial};
use crate::response::{GeometricResponse, ResponseLookup};
use crate::sensor::{MicrolensLaw, MicrolensShifts};
use crate::spectrum::{Bands, ChannelWavelengths};

impl Camera {
    /// Some rows of its window, which see what they saw ([`Sensor::rows`](crate::sensor::Sensor::rows)).
    ///
    /// # Panics
    /// Rows that the window does not have, or none.
    pub fn rows(&self, rows: std::ops::Range<usize>) -> Self {
        Self {
            sensor: self.sensor.rows(rows),
            ..self.clone()
        }
    }

    /// All channels by the rays of the reference wavelength: a third of the rays. `None` where they are already.
    pub fn without_dispersion(&self) -> Option<Self> {
        let system = self.system(ChannelWavelengths::REFERENCE);
        self.is_dispersive().then(|| Self {
            systems: vec![system.clone()],
            channel_paraxial: self.paraxial.iter().copied().collect(),
            colours: self.colours.traced_by(system, &self.reference_tracer),
            ..self.clone()
        })
    }

    /// Each channel at one wavelength, the middle of its band, and weighed by the middle one of its responses. `None`
    /// where it is so already.
    pub fn without_band_width(&self) -> Option<Self> {
        let bands = self.wavelengths.bands().filter(|b| b.wavelengths > 1)?;
        let one = Bands {
            wavelengths: 1,
            ..*bands
        };
        let tracers = self.systems.iter().map(|s| self.tracer_like(s));
        let tracers = tracers.collect::<Option<Vec<_>>>()?;
        Some(Self {
            colours: self.colours.of_one_wavelength(&self.systems, tracers),
            wavelengths: ChannelWavelengths::from_bands(one).ok()?,
            ..self.clone()
        })
    }

    /// The lens by first-order optics, stopped by its entrance pupil alone: no aberration, no vignetting. `None` where
    /// it is already, for bare pixels, and for a lens whose entrance pupil lies at infinity.
    pub fn without_aberrations(&self) -> Option<Self> {
        if !self.is_real_lens() {
            return None;
        }
        let reference = self.system(ChannelWavelengths::REFERENCE);
        Some(Self {
            reference_tracer: self.ideal(reference)?,
            colours: self.colours.retraced(|system| self.ideal(system))?,
            lens_diffraction: (self.lens_diffraction.as_ref())
                .map(|d| Arc::new(d.without_phases())),
            ..self.clone()
        })
    }

    /// Whether rays go through the surfaces of a lens, one by one.
    pub fn is_real_lens(&self) -> bool {
        self.paraxial.is_some() && matches!(self.reference_tracer, Tracer::Surfaces(_))
    }

    /// Every microlens shifted as the one in the middle of the window is; a response of several shifts is read at this
    /// one, as quickly as that of a centred lens. `None` where all are alike already.
    pub fn without_chief_ray_variation(&self) -> Option<Self> {
        let alike = MicrolensLaw {
            um: self.microlens_law.um,
            ..MicrolensLaw::default()
        };
        let is_alike = matches!(
            self.shifts,
            MicrolensShifts::Centred | MicrolensShifts::Constant { .. }
        );
        if is_alike && self.microlens_law == alike {
            return None;
        }
        let middle = self.sensor.centre_mm();
        let shift_um = self.shift_at_um(middle).to_array();
        let fixed = |response: &Arc<ResponseLookup>| match &**response {
            ResponseLookup::Shifted(all) => Arc::new(ResponseLookup::Fixed(all.at_shift(shift_um))),
            _ => response.clone(),
        };
        Some(Self {
            shifts: MicrolensShifts::Constant {
                shift_um: self.shifts.at_um(middle) + self.microlens_law.at_um(middle),
            },
            microlens_law: MicrolensLaw::default(),
            colours: self.colours.responding(fixed),
            ..self.clone()
        })
    }

    /// The ideal pixel (boxes) whose microlens has the focal length of this one's, H/n of the moving frame: no
    /// diffraction, no crosstalk, no loss, the same at all wavelengths. `None` where it is one already.
    pub fn without_pixel_diffraction(&self) -> Option<Self> {
        if matches!(self.response(), ResponseLookup::Geometric(_)) {
            return None;
        }
        let frame = self.response_frame();
        let focal_um = frame.height_um / frame.index;
        let sensor = &self.sensor;
        let ideal = GeometricResponse::new(sensor.subpixels(), sensor.pitch_um(), focal_um);
        let ideal = Arc::new(ResponseLookup::Geometric(ideal.ok()?));
        Some(Self {
            colours: self.colours.responding(|_| ideal.clone()),
            ..self.clone()
        })
    }

    /// Light through the lens as rays. `None` where it is so already.
    pub fn without_lens_diffraction(&self) -> Option<Self> {
        self.lens_diffraction.is_some().then(|| Self {
            lens_diffraction: None,
            ..self.clone()
        })
    }

    /// Without light that surfaces of the lens reflect twice. `None` where it is so already.
    pub fn without_reflections(&self) -> Option<Self> {
        self.reflections.is_some().then(|| Self {
            reflections: None,
            ..self.clone()
        })
    }

    /// A tracer of the kind that this camera has.
    fn tracer_like(&self, system: &OpticalSystem) -> Option<Tracer> {
        match self.reference_tracer {
            Tracer::Surfaces(_) => Some(Tracer::surfaces(system)),
            Tracer::Ideal(_) => self.ideal(system),
        }
    }

    /// First-order optics of an optical system in the place of the lens.
    fn ideal(&self, system: &OpticalSystem) -> Option<Tracer> {
        let image_z_mm = self.paraxial.as_ref()?.image_z_mm(self.focus_distance_mm)?;
        IdealLens::new(&Paraxial::from_aligned(system), image_z_mm, system.stop).map(Tracer::Ideal)
    }
}
