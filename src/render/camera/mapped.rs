//! The camera with maps in the place of its lens.

use std::sync::Arc;

use super::super::lens_maps::{LensMaps, LensTracing};
use super::Camera;
use crate::lens::{LensMap, MapReport, MapTask};

/// A map takes as long to make as about this many rays take to be traced: fewer are traced.
const LEAST_RAYS: usize = 1 << 20;

impl Camera {
    /// The camera with maps of its lens in the place of its surfaces, for renders of so many rays per pixel and
    /// channel: they pay where each wavelength has more than a million. The lens is traced exactly where it cannot be
    /// mapped within the bound ([`Camera::lens_maps`] tells why), and so is everything but a
    /// [`Render`](crate::render::Render).
    pub fn with_lens_maps(self, tracing: &LensTracing, rays_per_pixel: usize) -> Self {
        let Some((bound, pupils)) = tracing.bound().zip(self.lens_pupils()) else {
            return self;
        };
        let sensor = self.sensor();
        let rays = sensor.width() * sensor.height() * rays_per_pixel;
        let colours = self.colours();
        if rays / colours.count() < LEAST_RAYS {
            return self.mapped(Vec::new(), LensMaps::TooFewRays);
        }
        let mut maps: Vec<Option<Arc<LensMap>>> = Vec::new();
        let mut report = MapReport::default();
        for system in colours.systems() {
            let task = MapTask {
                system,
                pupils,
                window: sensor.window_mm(),
                pitch_mm: sensor.pitch_mm(),
                focus_mm: self.focus_distance_mm(),
                bound,
                rays: rays / colours.count(),
            };
            match LensMap::new(&task, maps.last().and_then(|m| m.as_deref())) {
                Ok(map) => {
                    report = report.worse(map.report());
                    maps.push(Some(Arc::new(map)));
                }
                Err(failure) => {
                    let wavelength_nm = system.wavelength_nm;
                    let failed = LensMaps::Failed {
                        bound,
                        wavelength_nm,
                        failure,
                    };
                    return self.mapped(Vec::new(), failed);
                }
            }
        }
        self.mapped(maps, LensMaps::Mapped { bound, report })
    }
}
