//! From light to digital numbers: what a real sensor adds to the clean signal.
//!
//! The linear model of EMVA standard 1288 (release 4.0, section 2) for each sub-pixel and colour channel. v is its
//! clean linear value:
//!
//! ```text
//! N  = H p² η                              electrons of a whole pixel at the linear value 1
//! n  = min(Poisson(N v (1 + s₁ z₁) + d t), w)     electrons collected; z₁ a normal number of the place
//! DN = ⌊K g (n + σ z₂) + b + ½⌋, clipped to 0 … 2^bits − 1       z₂ a normal number of the shot
//! ```
//!
//! H: photons a µm² of one channel in the middle of the window at the linear value 1; p: pitch, µm; η: quantum
//! efficiency, the part of them that the photodiodes absorb: folded in the angular response, and measured with it; s₁:
//! photo-response non-uniformity (PRNU); d: dark current, e⁻/s; t: exposure time, s; w: full well, e⁻; σ: read noise,
//! e⁻; K: gain, DN/e⁻; g: gain of the sub-pixel's own amplifier relative to the mean; b: black level, DN.
//!
//! Over shots, for g = 1 and below saturation, mean and variance obey the photon-transfer relation (Janesick, *Photon
//! Transfer*, SPIE 2007), which the tests hold:
//!
//! ```text
//! var DN = K (mean DN − b) + K² σ² + 1/12,      over places as well: + s₁² (mean DN − b − K d t)²
//! ```
//!
//! Every random number is a function of (seed, column, row, channel) of the mosaic alone.

mod poisson;
mod settings;
mod stream;

pub use poisson::poisson;
pub use settings::ReadoutSettings;
pub use stream::Stream;

use rayon::prelude::*;

use super::Subpixels;
use crate::image::Image;
use crate::range::{OutOfRange, require};

/// Key words of the fixed pattern and of the shot.
const PATTERN: u64 = 0x9a77;
const SHOT: u64 = 0x5407;

/// A sensor's electronics at one exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Readout {
    settings: ReadoutSettings,
    subpixels: Subpixels,
    electrons_at_white: f64,
    dark_e: f64,
    gain_dn_per_e: f64,
}

/// What was read out.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposed {
    /// Digital numbers, integers, the mosaic's size and channels.
    pub codes: Image,
    /// Values whose photodiode was full or whose code is the largest.
    pub saturated: u64,
}

impl Readout {
    /// `electrons_at_white`: N of the module, see [`ReadoutSettings::electrons_at_white`]; `largest_share`: the part of
    /// it that the brightest sub-pixel collects.
    ///
    /// # Errors
    /// A setting out of its range, or not one gain a sub-pixel.
    pub fn new(
        settings: &ReadoutSettings,
        subpixels: Subpixels,
        electrons_at_white: f64,
        largest_share: f64,
    ) -> Result<Self, OutOfRange> {
        settings.check(subpixels)?;
        let absorbs = electrons_at_white.is_finite() && electrons_at_white > 0.0;
        require(absorbs, || {
            let allowed = "above 0: some light must be absorbed";
            OutOfRange::new("readout", "electrons_at_white", electrons_at_white, allowed)
        })?;
        Ok(Self {
            gain_dn_per_e: settings.gain(electrons_at_white * largest_share),
            dark_e: settings.dark_current_e_s * settings.exposure_s,
            settings: settings.clone(),
            subpixels,
            electrons_at_white,
        })
    }

    /// Gain, DN/e⁻ (K).
    pub fn gain_dn_per_e(&self) -> f64 {
        self.gain_dn_per_e
    }

    /// Mean dark electrons of a sub-pixel, d t.
    pub fn dark_e(&self) -> f64 {
        self.dark_e
    }

    /// Exposes and reads a clean sub-pixel mosaic (linear, not negative): m·W × n·H, any number of channels.
    pub fn expose(&self, mosaic: &Image) -> Exposed {
        self.expose_rows(mosaic, 0)
    }

    /// As [`Self::expose`], of the rows of a mosaic from `first_row` (a whole pixel's) on, alone.
    pub fn expose_rows(&self, mosaic: &Image, first_row: usize) -> Exposed {
        let (width, channels) = (mosaic.width(), mosaic.channels());
        let mut codes = Image::zeros(width, mosaic.height(), channels);
        let row_length = (width * channels).max(1);
        let rows = codes.data_mut().par_chunks_mut(row_length);
        let saturated = rows
            .zip(mosaic.data().par_chunks(row_length))
            .enumerate()
            .map(|(y, (codes, light))| {
                let values = codes.iter_mut().zip(light).enumerate();
                let full = values.map(|(i, (code, &light))| {
                    let place = [i / channels, first_row + y, i % channels];
                    let (value, full) = self.value(place, light);
                    *code = value;
                    u64::from(full)
                });
                full.sum::<u64>()
            })
            .sum();
        Exposed { codes, saturated }
    }

    /// The digital number at [column, row, channel] of the mosaic, and whether it is saturated.
    fn value(&self, [x, y, channel]: [usize; 3], light: f32) -> (f32, bool) {
        let s = &self.settings;
        let place = [x as u64, y as u64, channel as u64];
        let mut pattern = Stream::new(s.sensor_seed, &[PATTERN, place[0], place[1], place[2]]);
        let mut shot = Stream::new(s.shot_seed, &[SHOT, place[0], place[1], place[2]]);
        let sensitivity = (1.0 + s.prnu * pattern.normal()).max(0.0);
        let mean = self.electrons_at_white * f64::from(light) * sensitivity + self.dark_e;
        let collected = poisson(mean, &mut shot).min(s.full_well_e);
        let read = collected + s.read_noise_e * shot.normal();
        let gain = self.gain_dn_per_e * s.subpixel_gains[self.subpixel_at(x, y)];
        let top = f64::from(s.largest_code());
        let code = (gain * read + f64::from(s.black_level) + 0.5)
            .floor()
            .clamp(0.0, top);
        (code as f32, collected >= s.full_well_e || code >= top)
    }

    fn subpixel_at(&self, x: usize, y: usize) -> usize {
        let (m, n) = (self.subpixels.m(), self.subpixels.n());
        self.subpixels.index(x % m, y % n)
    }

    /// Linear values of digital numbers, on the scale of the clean mosaic: ((DN − b)/K − d t)/N. Noise makes some
    /// negative. The gains of the sub-pixels and the PRNU stay in, as in a real camera that was not calibrated.
    pub fn linear(&self, codes: &Image) -> Image {
        let mut linear = codes.clone();
        let black = f64::from(self.settings.black_level);
        for value in linear.data_mut() {
            let electrons = (f64::from(*value) - black) / self.gain_dn_per_e - self.dark_e;
            *value = (electrons / self.electrons_at_white) as f32;
        }
        linear
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
