//! The numbers of a sensor's electronics, checked.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::range::{OutOfRange, require, within};
use crate::sensor::Subpixels;

/// Linear value of a sub-pixel, as a multiple of the largest share of white, that has the largest code where no gain is
/// given.
const HEADROOM: f64 = 1.5;

/// See the equation of [`crate::sensor::readout`]. Electrons, well and noise are those of one sub-pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReadoutSettings {
    /// Photons a µm² of each colour channel in the middle of the window at the linear value 1 (H).
    pub photons_um2: f64,
    /// Exposure time, s (t): counts for the dark current.
    pub exposure_s: f64,
    /// Dark current, e⁻/s (d).
    pub dark_current_e_s: f64,
    /// Full well, e⁻ (w).
    pub full_well_e: f64,
    /// Photo-response non-uniformity: standard deviation of the sensitivity over its mean (s₁).
    pub prnu: f64,
    /// Read noise: standard deviation, e⁻ (σ).
    pub read_noise_e: f64,
    /// Gain, digital numbers an electron (K); absent: the one at which 1.5 times the largest share of white that a
    /// sub-pixel gets, or a full well if that is less, has the largest code, as a camera's choice of its ISO speed
    /// would have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain_dn_per_e: Option<f64>,
    /// Digital number of no electrons (b).
    pub black_level: u16,
    /// Bits of the converter, 2 to 16.
    pub bits: u32,
    /// Gain of each sub-pixel's amplifier relative to K, in stored order (g).
    pub subpixel_gains: Vec<f64>,
    /// Seed of what stays from shot to shot: PRNU.
    pub sensor_seed: u64,
    /// Seed of the shot: photons, dark electrons, read noise.
    pub shot_seed: u64,
}

impl ReadoutSettings {
    /// N = H p² η: electrons of a whole pixel at the linear value 1.
    pub fn electrons_at_white(&self, pitch_um: f64, quantum_efficiency: f64) -> f64 {
        self.photons_um2 * pitch_um * pitch_um * quantum_efficiency
    }

    /// Standard deviation of the noise of a sub-pixel at its equal share of white, over that: photons, dark electrons,
    /// read noise, PRNU.
    pub fn relative_noise_at_white(&self, subpixels: Subpixels, electrons_at_white: f64) -> f64 {
        let share = electrons_at_white / subpixels.count() as f64;
        let dark = self.dark_current_e_s * self.exposure_s;
        let variance = share + dark + self.read_noise_e.powi(2) + (self.prnu * share).powi(2);
        variance.sqrt() / share
    }

    /// Weighs the gains so that the left half of a pixel's columns gives `left_over_right` times what the right half
    /// does of the same light, at the same sum of both; a column in the middle is of neither.
    pub fn weigh_halves(&mut self, left_over_right: f64, columns: usize) {
        let right = 2.0 / (1.0 + left_over_right);
        for (k, gain) in self.subpixel_gains.iter_mut().enumerate() {
            *gain *= match (2 * (k % columns) + 1).cmp(&columns) {
                Ordering::Less => 2.0 - right,
                Ordering::Equal => 1.0,
                Ordering::Greater => right,
            };
        }
    }

    /// The largest digital number.
    pub fn largest_code(&self) -> u16 {
        ((1u32 << self.bits.clamp(1, 16)) - 1) as u16
    }

    /// K, given what the brightest sub-pixel collects at the linear value 1 of the sum.
    pub(super) fn gain(&self, largest_e: f64) -> f64 {
        self.gain_dn_per_e.unwrap_or_else(|| {
            let codes = f64::from(self.largest_code()) - f64::from(self.black_level);
            codes / (HEADROOM * largest_e).min(self.full_well_e)
        })
    }

    /// Whether every number is in its range and there is one gain per sub-pixel.
    pub(super) fn check(&self, subpixels: Subpixels) -> Result<(), OutOfRange> {
        let check = |field: &'static str, value: f64, fits: bool, allowed: &'static str| {
            require(fits, || OutOfRange::new("readout", field, value, allowed))
        };
        let positive = [
            ("photons_um2", self.photons_um2),
            ("full_well_e", self.full_well_e),
            ("gain_dn_per_e", self.gain_dn_per_e.unwrap_or(1.0)),
        ];
        for (field, value) in positive {
            let fits = value > 0.0 && value <= 1e9;
            check(field, value, fits, "above 0, at most 1e9")?;
        }
        let not_negative = [
            ("exposure_s", self.exposure_s),
            ("dark_current_e_s", self.dark_current_e_s),
            ("read_noise_e", self.read_noise_e),
        ];
        for (field, value) in not_negative {
            check(field, value, (0.0..=1e6).contains(&value), "0 to 1e6")?;
        }
        within("readout", "prnu", self.prnu, 0.0..=0.5)?;
        within("readout", "bits", f64::from(self.bits), 2.0..=16.0)?;
        let black = self.black_level;
        let fits = black < self.largest_code();
        check("black_level", f64::from(black), fits, "below 2^bits − 1")?;
        let count = self.subpixel_gains.len();
        let fits = count == subpixels.count();
        let field = "subpixel_gains (count)";
        check(field, count as f64, fits, "one per sub-pixel")?;
        (self.subpixel_gains.iter())
            .try_for_each(|&gain| within("readout", "subpixel_gains", gain, 0.1..=10.0))
    }
}
