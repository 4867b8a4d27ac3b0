//! With what the rays of each colour channel are traced and weighed: tracers and responses at its wavelengths.
//!
//! A channel of M wavelengths gives each an equal share of a pixel's N rays, one after the other, so that a share is a
//! scrambled net of its own and is traced as one batch. Where M does not divide N the bounds ⌈m N/M − ξ⌉, with one
//! uniform ξ a pixel, give each wavelength N/M rays on average: the mean of the estimate is that of the M wavelengths
//! for every N.

use std::sync::Arc;

use super::tracer::Tracer;
use crate::lens::{Lens, LensError, LensMap, OpticalSystem};
use crate::response::{Response, ResponseLookup};
use crate::sampling::uniform;
use crate::spectrum::ChannelWavelengths;

/// Keeps the bounds' random number apart from the samples'.
const BOUNDS: u64 = 0xC010_0125;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Colours {
    /// Wavelengths a channel, M.
    count: usize,
    tracers: Vec<Tracer>,
    /// What each tracer traces.
    systems: Vec<OpticalSystem>,
    responses: Vec<Arc<ResponseLookup>>,
    /// In the place of the tracers, where there are some.
    maps: Vec<Option<Arc<LensMap>>>,
    /// `[channel][wavelength]`: place in `tracers`, and in `responses`.
    uses: Vec<(usize, usize)>,
}

impl Colours {
    /// Of a lens: one tracer where it has no dispersion.
    ///
    /// # Errors
    /// A wavelength out of the range of the lens.
    pub fn for_lens(
        lens: &Lens,
        response: &Response,
        wavelengths: &ChannelWavelengths,
    ) -> Result<Self, LensError> {
        if !lens.prescription().is_dispersive() {
            let system = lens.at(wavelengths.reference_nm())?;
            return Ok(Self::for_system(&system, response, wavelengths));
        }
        let mut colours = Self::of_system_alone(response, wavelengths);
        let traced = (0..3).flat_map(|c| wavelengths.traced_nm(c));
        for (use_, nm) in colours.uses.iter_mut().zip(traced) {
            use_.0 = colours.tracers.len();
            let system = lens.at(nm)?;
            colours.tracers.push(Tracer::surfaces(&system));
            colours.systems.push(system);
        }
        Ok(colours)
    }

    /// Of an optical system that is the same at all wavelengths.
    pub fn for_system(
        system: &OpticalSystem,
        response: &Response,
        wavelengths: &ChannelWavelengths,
    ) -> Self {
        Self {
            tracers: vec![Tracer::surfaces(system)],
            systems: vec![system.clone()],
            ..Self::of_system_alone(response, wavelengths)
        }
    }

    /// Without tracers.
    fn of_system_alone(response: &Response, wavelengths: &ChannelWavelengths) -> Self {
        // One lookup for all wavelengths that read the same.
        let mut read: Vec<f64> = Vec::new();
        let mut responses = Vec::new();
        let weighed = (0..3).flat_map(|c| wavelengths.response_nm(c));
        let uses = weighed.map(|nm| {
            let nm = response.read_nm(nm);
            let place = read.iter().position(|&r| r == nm).unwrap_or_else(|| {
                read.push(nm);
                responses.push(Arc::new(response.at(nm)));
                responses.len() - 1
            });
            (0, place)
        });
        Self {
            count: wavelengths.per_channel(),
            tracers: Vec::new(),
            systems: Vec::new(),
            maps: Vec::new(),
            uses: uses.collect(),
            responses,
        }
    }

    /// Wavelengths a channel.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Where the share of wavelength `m` ends among `rays` rays of the pixel of this key.
    pub fn end_of_share(&self, m: usize, rays: usize, key: u64) -> usize {
        if m + 1 == self.count {
            return rays;
        }
        let end = (m + 1) as f64 * rays as f64 / self.count as f64;
        (end - uniform(key, &[BOUNDS])).ceil() as usize
    }

    /// The tracer of wavelength `m` of a channel; `None` where it shares the rays of the channel before.
    pub fn own_tracer(&self, channel: usize, m: usize) -> Option<&Tracer> {
        (channel == 0 || self.tracers.len() > 1).then(|| self.tracer(channel, m))
    }

    /// The tracer that serves wavelength `m` of a channel.
    pub fn tracer(&self, channel: usize, m: usize) -> &Tracer {
        &self.tracers[self.uses[channel * self.count + m].0]
    }

    /// The wavelength that serves wavelength `m` of a channel, nm.
    pub fn traced_nm(&self, channel: usize, m: usize) -> f64 {
        self.systems[self.uses[channel * self.count + m].0].wavelength_nm
    }

    /// The map that stands for it, and its number.
    pub fn map(&self, channel: usize, m: usize) -> Option<(usize, &LensMap)> {
        let number = self.uses[channel * self.count + m].0;
        Some((number, self.maps.get(number)?.as_deref()?))
    }

    /// The lens at each wavelength that is traced.
    pub fn systems(&self) -> &[OpticalSystem] {
        &self.systems
    }

    /// With maps in the place of the tracers, in the order of the systems.
    pub fn with_maps(self, maps: Vec<Option<Arc<LensMap>>>) -> Self {
        Self { maps, ..self }
    }

    /// Number of the response that weighs wavelength `m` of a channel.
    pub fn response_number(&self, channel: usize, m: usize) -> usize {
        self.uses[channel * self.count + m].1
    }

    /// A response by its number.
    pub fn response(&self, number: usize) -> &ResponseLookup {
        &self.responses[number]
    }

    /// All of them.
    pub fn responses(&self) -> impl Iterator<Item = &ResponseLookup> {
        self.responses.iter().map(AsRef::as_ref)
    }

    /// All channels and wavelengths by one tracer.
    pub fn traced_by(&self, system: &OpticalSystem, tracer: &Tracer) -> Self {
        Self {
            tracers: vec![tracer.clone()],
            systems: vec![system.clone()],
            maps: Vec::new(),
            uses: self.uses.iter().map(|&(_, r)| (0, r)).collect(),
            ..self.clone()
        }
    }

    /// One wavelength per channel: that of `systems` (one per channel, or one for all) with their tracers, and the
    /// response in the middle of those that there were.
    pub fn of_one_wavelength(&self, systems: &[OpticalSystem], tracers: Vec<Tracer>) -> Self {
        let last = tracers.len() - 1;
        let middle = self.count / 2;
        Self {
            count: 1,
            tracers,
            systems: systems.to_vec(),
            maps: Vec::new(),
            responses: self.responses.clone(),
            uses: (0..3)
                .map(|c| (c.min(last), self.response_number(c, middle)))
                .collect(),
        }
    }

    /// With other tracers of the same systems; `None` if one of them has none.
    pub fn retraced(&self, tracer: impl Fn(&OpticalSystem) -> Option<Tracer>) -> Option<Self> {
        Some(Self {
            tracers: self.systems.iter().map(tracer).collect::<Option<_>>()?,
            maps: Vec::new(),
            ..self.clone()
        })
    }

    /// With other responses in the place of these.
    pub fn responding(&self, other: impl Fn(&Arc<ResponseLookup>) -> Arc<ResponseLookup>) -> Self {
        Self {
            responses: self.responses.iter().map(other).collect(),
            ..self.clone()
        }
    }

    /// Whether all channels see the same: one tracer and one response.
    pub fn alike(&self) -> bool {
        self.tracers.len() == 1 && self.responses.len() == 1
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::response::GeometricResponse;
    use crate::sensor::Subpixels;
    use crate::spectrum::Bands;

    #[test]
    fn every_wavelength_gets_its_share_of_the_rays_on_average() {
        let pixel = GeometricResponse::new(Subpixels::new(2, 2).unwrap(), 2.0, 5.0).unwrap();
        let wavelengths = ChannelWavelengths::from_bands(Bands::default()).unwrap();
        let colours = Colours::of_system_alone(&Response::Geometric(pixel), &wavelengths);
        assert_eq!((colours.count(), colours.responses.len()), (4, 1));
        for rays in [1, 3, 10, 128] {
            let pixels = 20_000;
            let mut shares = [0.0; 4];
            for key in 0..pixels {
                let mut first = 0;
                for (m, share) in shares.iter_mut().enumerate() {
                    let end = colours.end_of_share(m, rays, key);
                    assert!(end >= first && end <= rays);
                    *share += (end - first) as f64;
                    first = end;
                }
                assert_eq!(first, rays);
            }
            // Each count is one of two neighbouring integers, of variance 1/4 at most; five standard errors.
            let error = 5.0 * 0.5 / (pixels as f64).sqrt();
            let exact = rays as f64 / 4.0;
            let near = |s: &f64| (s / pixels as f64 - exact).abs() <= error;
            assert!(shares.iter().all(near), "{rays}: {shares:?}");
        }
    }
}
