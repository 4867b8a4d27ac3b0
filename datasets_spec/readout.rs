//! The noisy capture's part of `meta.json`: from photons to digital numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the digital numbers of `noisy.png` came about (SPEC.md, "Noise"). Electrons, well and noise are those of one
/// sub-pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Readout {
    /// Photons a µm² of each colour channel, in the middle of the window, at the linear value 1.
    pub photons_um2: f64,
    /// Part of them that the photodiodes of a pixel absorb together.
    pub quantum_efficiency: f64,
    /// Electrons of a whole pixel at the linear value 1: photons × pitch² × quantum efficiency.
    pub electrons_at_white: f64,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Mean number of dark electrons of a sub-pixel.
    pub dark_e: f64,
    /// Full well, electrons.
    pub full_well_e: f64,
    /// Photo-response non-uniformity: standard deviation of the sensitivity over its mean.
    pub prnu: f64,
    /// Read noise: standard deviation, electrons.
    pub read_noise_e: f64,
    /// Gain, digital numbers an electron.
    pub gain_dn_per_e: f64,
    /// Digital number of no electrons.
    pub black_level: u16,
    /// Bits of the converter.
    pub bits: u32,
    /// Gain of each sub-pixel's amplifier relative to `gain_dn_per_e`, in stored order: truth, not corrected in any
    /// file.
    pub subpixel_gains: Vec<f64>,
    /// Seed of the pattern that stays from shot to shot.
    pub sensor_seed: u64,
    /// Seed of the shot.
    pub shot_seed: u64,
    /// Values whose photodiode was full or whose code is the largest.
    pub saturated: u64,
}

impl Readout {
    /// The largest digital number, 2^bits − 1.
    pub fn largest_code(&self) -> u16 {
        ((1u32 << self.bits.clamp(1, 16)) - 1) as u16
    }

    /// The linear value of a digital number: ((code − black level)/gain − dark electrons)/electrons at white.
    pub fn linear(&self, code: f64) -> f64 {
        ((code - f64::from(self.black_level)) / self.gain_dn_per_e - self.dark_e)
            / self.electrons_at_white
    }
}
