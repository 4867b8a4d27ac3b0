//! The camera with maps in the place of its lens.

use std::sync::Arc;

use super::super::lens_maps::{LensMaps, LensTracing};
use super::Camera;
use crate::lens::{LensMap, MapBound, MapFailure, MapReport, MapTask};

/// A map takes as long to make as about this many rays take to be traced: fewer are traced.
const LEAST_RAYS: usize = 1 << 20;
/// Wavelengths that are mapped from traced rays; those between are interpolated, and measured as the others are.
const TRACED_WAVELENGTHS: usize = 4;

impl Camera {
    /// The camera with maps of its lens in the place of its surfaces, for renders of so many rays per pixel and
    /// channel: they pay where each map that is traced serves more than a million. The lens is traced exactly where it
    /// cannot be mapped within the bound ([`Camera::lens_maps`] tells why), and so is everything but a
    /// [`Render`](crate::render::Render).
    pub fn with_lens_maps(self, tracing: &LensTracing, rays_per_pixel: usize) -> Self {
        let Some(bound) = tracing.bound().filter(|_| self.lens_pupils().is_some()) else {
            return self;
        };
        let sensor = self.sensor();
        let rays = sensor.width() * sensor.height() * rays_per_pixel / self.colours().count();
        let wavelengths = self.colours().systems().len();
        if shared(rays, wavelengths) < LEAST_RAYS {
            return self.mapped(Vec::new(), LensMaps::TooFewRays);
        }
        match self.maps(bound, rays) {
            Ok(maps) => {
                let report = (maps.iter()).fold(MapReport::default(), |r, m| r.worse(m.report()));
                let maps = maps.into_iter().map(|map| Some(Arc::new(map))).collect();
                self.mapped(maps, LensMaps::Mapped { bound, report })
            }
            Err((wavelength_nm, failure)) => {
                let failed = LensMaps::Failed {
                    bound,
                    wavelength_nm,
                    failure,
                };
                self.mapped(Vec::new(), failed)
            }
        }
    }

    /// A map of each system, for so many rays of each; or the wavelength (nm) that has none, and why.
    fn maps(&self, bound: MapBound, rays: usize) -> Result<Vec<LensMap>, (f64, MapFailure)> {
        let (sensor, systems) = (self.sensor(), self.colours().systems());
        let Some(pupils) = self.lens_pupils() else {
            return Ok(Vec::new());
        };
        let task = |number: usize, rays: usize| MapTask {
            system: &systems[number],
            pupils,
            window: sensor.window_mm(),
            pitch_mm: sensor.pitch_mm(),
            focus_mm: self.focus_distance_mm(),
            bound,
            rays,
        };
        let mut order: Vec<usize> = (0..systems.len()).collect();
        order.sort_by(|a, b| {
            systems[*a]
                .wavelength_nm
                .total_cmp(&systems[*b].wavelength_nm)
        });
        let traced = spread(order.len());
        let served = shared(rays, order.len());
        let mut maps: Vec<Option<LensMap>> = vec![None; systems.len()];
        let mut like: Option<usize> = None;
        for &place in &traced {
            let number = order[place];
            let like_map = like.and_then(|like| maps[like].as_ref());
            let map = LensMap::new(&task(number, served), like_map)
                .map_err(|failure| (systems[number].wavelength_nm, failure))?;
            maps[number] = Some(map);
            like = like.or(Some(number));
        }
        let (known, others): (Vec<usize>, Vec<usize>) = order
            .into_iter()
            .partition(|number| maps[*number].is_some());
        for number in others {
            let nm = systems[number].wavelength_nm;
            let weights = known.iter().map(|k| {
                let other = systems[*k].wavelength_nm;
                let rest = known
                    .iter()
                    .filter(|j| *j != k)
                    .map(|j| systems[*j].wavelength_nm);
                rest.fold(1.0, |weight, node| weight * (nm - node) / (other - node))
            });
            let from: Vec<(&LensMap, f64)> = (known.iter().zip(weights))
                .filter_map(|(k, weight)| Some((maps[*k].as_ref()?, weight)))
                .collect();
            let task = task(number, rays);
            let map = match LensMap::between(&task, &from) {
                Some(map) => map,
                None => {
                    let like = from.first().map(|(map, _)| *map);
                    LensMap::new(&task, like).map_err(|failure| (nm, failure))?
                }
            };
            maps[number] = Some(map);
        }
        Ok(maps.into_iter().flatten().collect())
    }
}

/// Rays that a traced map serves: what it takes to be made is shared by the wavelengths between.
fn shared(rays: usize, wavelengths: usize) -> usize {
    rays * wavelengths / wavelengths.clamp(1, TRACED_WAVELENGTHS)
}

/// Places of [`TRACED_WAVELENGTHS`] of `count` sorted wavelengths: the extrema of Chebyshev's polynomial, or all.
fn spread(count: usize) -> Vec<usize> {
    if count <= TRACED_WAVELENGTHS {
        return (0..count).collect();
    }
    let last = (count - 1) as f64;
    let extremum = |k: usize| {
        let angle = std::f64::consts::PI * k as f64 / (TRACED_WAVELENGTHS - 1) as f64;
        (0.5 * last * (1.0 - angle.cos())).round() as usize
    };
    (0..TRACED_WAVELENGTHS).map(extremum).collect()
}
