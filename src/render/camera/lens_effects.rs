//! What a camera's lens does beside refracting: diffraction at its aperture, and reflections.

use std::sync::Arc;

use super::{Camera, Pupils};
use crate::lens::Reflections;
use crate::render::diffraction::LensDiffraction;
use crate::spectrum::ChannelWavelengths;

impl Camera {
    /// The camera with diffraction at the lens's aperture, as each place of the window sees it; as it was for bare
    /// pixels.
    pub fn with_lens_diffraction(self) -> Self {
        let lens_diffraction = match &self.pupils {
            Pupils::ByField(map) => LensDiffraction::new(map, self.sensor_z_mm()),
            Pupils::Fixed(_) => None,
        };
        let system = self.system(ChannelWavelengths::REFERENCE);
        let lens_diffraction = lens_diffraction.map(|diffraction| {
            Arc::new(match self.is_real_lens() {
                true => diffraction.with_phases(system, self.focus_distance_mm),
                false => diffraction,
            })
        });
        Self {
            lens_diffraction,
            ..self
        }
    }

    /// The camera with light that two surfaces of its lens, or one and the sensor, reflect: a
    /// [`Render`](crate::render::Render) adds it to the image. As it was where nothing reflects.
    pub fn with_reflections(self, reflections: Reflections) -> Self {
        let ghosts = !reflections
            .pairs(self.system(ChannelWavelengths::REFERENCE))
            .is_empty();
        Self {
            reflections: ghosts.then(|| Arc::new(reflections)),
            ..self
        }
    }

    /// What reflects in the lens, where that is simulated.
    pub fn reflections(&self) -> Option<&Reflections> {
        self.reflections.as_deref()
    }

    /// Whether diffraction at the lens's aperture is simulated.
    pub(crate) fn is_diffracted(&self) -> bool {
        self.lens_diffraction.is_some()
    }

    /// Diffraction at the lens's aperture, where it is simulated.
    pub(in crate::render) fn lens_diffraction(&self) -> Option<&LensDiffraction> {
        self.lens_diffraction.as_deref()
    }
}
