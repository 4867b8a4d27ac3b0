//! `[readout]`: from what each sample's sensor electronics are drawn.

use serde::{Deserialize, Serialize};

use super::{ConfigError, Draw, number};

/// Sensor electronics; what a file leaves out is a small modern sensor's. Symbols as in [`quadpixel::sensor::readout`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadoutConfig {
    /// Photons a µm² of each colour channel in the middle of the window at the linear value 1.
    pub photons_um2: Draw,
    /// Exposure time, s.
    pub exposure_s: Draw,
    /// Dark current of a sub-pixel, e⁻/s.
    pub dark_current_e_s: Draw,
    /// Full well, e⁻ a µm² of the sub-pixel's area: so a pixel that is drawn smaller holds less.
    pub full_well_e_um2: Draw,
    /// Photo-response non-uniformity, standard deviation over mean.
    pub prnu: Draw,
    /// Read noise, standard deviation, e⁻.
    pub read_noise_e: Draw,
    /// Gain, DN/e⁻; absent: by the exposure, as a camera chooses its ISO speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_dn_per_e: Option<Draw>,
    /// Standard deviation of the sub-pixels' amplifier gains about 1.
    pub gain_mismatch: Draw,
    /// What the left half of a pixel's columns gives over the right half of the same light.
    #[serde(skip_serializing_if = "is_one")]
    pub left_over_right: Draw,
    /// Digital number of no electrons.
    pub black_level: u16,
    /// Bits of the converter, 2 to 16.
    pub bits: u32,
    /// Whether all samples share one sensor: its PRNU pattern and its sub-pixel gains.
    pub same_sensor: bool,
}

fn is_one(draw: &Draw) -> bool {
    *draw == Draw::Fixed(1.0)
}

impl Default for ReadoutConfig {
    fn default() -> Self {
        let between = |min, max, scale| Draw::Range(super::Range { min, max, scale });
        Self {
            photons_um2: between(100.0, 3000.0, super::Scale::Log),
            exposure_s: Draw::Fixed(0.02),
            dark_current_e_s: Draw::Fixed(5.0),
            full_well_e_um2: Draw::Fixed(5000.0),
            prnu: Draw::Fixed(0.01),
            read_noise_e: between(1.0, 3.0, super::Scale::Linear),
            gain_dn_per_e: None,
            gain_mismatch: Draw::Fixed(0.01),
            left_over_right: Draw::Fixed(1.0),
            black_level: 64,
            bits: 12,
            same_sensor: false,
        }
    }
}

impl ReadoutConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let least = 1e-6;
        #[rustfmt::skip] // because it is a table
        let rows = [
            ("readout.photons_um2", Some(self.photons_um2), [least, 1e9]),
            ("readout.exposure_s", Some(self.exposure_s), [0.0, 1e6]),
            ("readout.dark_current_e_s", Some(self.dark_current_e_s), [0.0, 1e6]),
            ("readout.full_well_e_um2", Some(self.full_well_e_um2), [least, 1e7]),
            ("readout.prnu", Some(self.prnu), [0.0, 0.5]),
            ("readout.read_noise_e", Some(self.read_noise_e), [0.0, 1e6]),
            ("readout.gain_dn_per_e", self.gain_dn_per_e, [least, 1e6]),
            ("readout.gain_mismatch", Some(self.gain_mismatch), [0.0, 0.1]),
            ("readout.left_over_right", Some(self.left_over_right), [0.5, 2.0]),
        ];
        number::check(&rows)?;
        let (bits, black) = (self.bits, self.black_level);
        if (2..=16).contains(&bits) && u32::from(black) < (1 << bits) - 1 {
            return Ok(());
        }
        Err(ConfigError::Together(format!(
            "readout.bits is {bits} and readout.black_level {black}; allowed: 2 to 16 bits, and a black level below 2^bits - 1"
        )))
    }
}
